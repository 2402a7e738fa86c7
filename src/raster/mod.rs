//! Reading orthophotos: files in, masked colour tiles of the tile matrix out.

mod frame;

pub use frame::{FrameError, MAX_EDGE_PX, MAX_FILE_BYTES, MAX_PIXELS, decode_frame, read_frame};

use crate::geodesy::Geodetic;
use crate::pixels::MaskedColour;
use crate::tile::TileId;
use std::path::{Path, PathBuf};

/// What the caller states about a source beyond what its file says.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// EPSG code that overrides (or supplies) the file's CRS.
    pub crs: Option<u32>,
    /// Source values shown as 0 and 255; needed for more than 8 bits.
    pub stretch: Option<(f64, f64)>,
}

/// What an opened source is.
#[derive(Debug, Clone)]
pub struct Description {
    /// Where it was opened.
    pub path: PathBuf,
    /// "GeoTIFF", "PNG", ...
    pub format: String,
    /// Columns.
    pub width_px: u64,
    /// Rows.
    pub height_px: u64,
    /// For people: "EPSG:26914", "user-defined Transverse Mercator", ...
    pub crs: String,
    /// Ground sample distance at the centre (geometric mean of both pixel axes), true metres.
    pub gsd_m_per_px: f64,
    /// The image's edge on the ground, densified (points along each side), not closed.
    pub outline: Vec<Geodetic>,
    /// Acquisition date from metadata, ISO 8601 (YYYY-MM-DD), where the file states one.
    pub acquired: Option<String>,
    /// One standard deviation per axis that the CRS's datum shift or projection adds, metres.
    pub crs_error_m: f64,
}

/// Why a source cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RasterError {
    /// The skeleton's placeholder.
    #[error("not built")]
    NotBuilt,
}

/// An opened orthophoto. `Send + Sync`; blocks are read as needed and cached within a bound.
pub struct Orthophoto {}

impl Orthophoto {
    /// Opens a GeoTIFF/COG, or PNG/JPEG with world file. Reads headers only.
    pub fn open(_path: &Path, _options: &OpenOptions) -> Result<Self, RasterError> {
        Err(RasterError::NotBuilt)
    }

    /// What it is.
    pub fn description(&self) -> &Description {
        unimplemented!()
    }

    /// The source seen through a tile, area-correct where it shrinks, bilinear otherwise; `None` where the tile holds no valid pixel of it.
    pub fn warp(&self, _tile: TileId) -> Result<Option<MaskedColour>, RasterError> {
        Err(RasterError::NotBuilt)
    }
}
