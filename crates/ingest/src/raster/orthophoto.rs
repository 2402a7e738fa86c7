//! `Orthophoto`: an opened source.

use super::RasterError;
use super::affine::Affine;
use super::block::{BlockCache, BlockSource};
use super::georeference::Georeference;
use super::photo::PhotoSource;
use super::side_files::{prj_crs, world_placement};
use super::tiff::{TiffSource, placement};
use super::warp::Warp;
use crate::crs::Crs;
use image::ImageFormat;
use overfly_core::geodesy::Geodetic;
use overfly_core::pixels::MaskedColour;
use overfly_core::tile::TileId;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What the caller states about a source beyond what its file says.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// EPSG code that overrides (or supplies) the file's CRS.
    pub crs: Option<u32>,
    /// Source values shown as 0 and 255; needed for more than 8 bits.
    pub stretch: Option<(f64, f64)>,
    /// Where decoded blocks are kept; sources that share one stay within its bound together. Else each has its own.
    pub cache: Option<Arc<BlockCache>>,
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
    /// For people: "EPSG:26914 (NAD83 / UTM zone 14N)", "user-defined Transverse Mercator", ...
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

/// An opened orthophoto. `Send + Sync`; blocks are read as needed and cached within a bound.
pub struct Orthophoto {
    description: Description,
    georeference: Georeference,
    source: Box<dyn BlockSource>,
    cache: Arc<BlockCache>,
    source_key: u64,
}

impl std::fmt::Debug for Orthophoto {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Orthophoto").field("description", &self.description).finish_non_exhaustive()
    }
}

impl Orthophoto {
    /// Opens a GeoTIFF/COG, or PNG/JPEG with world file. Reads headers only.
    ///
    /// # Errors
    /// What [`RasterError`] says, each naming the file and the remedy.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, RasterError> {
        let opened = Opened::by_content(path, options)?;
        let given = options.crs.map(Crs::from_epsg).transpose().map_err(|e| RasterError::crs(path, e))?;
        let affine = match opened.affine {
            Some(affine) => affine,
            None => world_placement(path)?.ok_or_else(|| RasterError::NoGeoreference {
                path: path.into(),
                missing: "neither tags nor a world file place it; write them with gdal_translate -a_srs EPSG:n -a_ullr ulx uly lrx lry"
                    .into(),
            })?,
        };
        let crs = match given.or(opened.crs) {
            Some(crs) => crs,
            None => prj_crs(path)?.ok_or_else(|| RasterError::NoCrs { path: path.into(), detail: String::new() })?,
        };
        let size = opened.source.levels()[0];
        let georeference = Georeference::new(path, affine, crs, size.width_px, size.height_px)?;
        let description = Description {
            path: path.into(),
            format: opened.format,
            width_px: size.width_px,
            height_px: size.height_px,
            crs: georeference.crs.name().into(),
            gsd_m_per_px: georeference.gsd_m_per_px,
            outline: georeference.outline.clone(),
            acquired: opened.acquired,
            crs_error_m: georeference.crs.error_m(),
        };
        let cache = options.cache.clone().unwrap_or_default();
        let source_key = cache.new_source();
        Ok(Self { description, georeference, source: opened.source, cache, source_key })
    }

    /// What it is.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// The source seen through a tile, area-correct where it shrinks, interpolated otherwise; `None` where the tile
    /// holds no valid pixel of it. Pixels depend on the source and the tile matrix only, so tiles join without seams.
    ///
    /// # Errors
    /// Blocks that cannot be read or decoded.
    pub fn warp(&self, tile: TileId) -> Result<Option<MaskedColour>, RasterError> {
        let warp = Warp {
            georeference: &self.georeference,
            source: self.source.as_ref(),
            cache: &self.cache,
            source_key: self.source_key,
        };
        warp.tile(tile)
    }
}

/// A file with a decoder, and what it says itself about its place.
struct Opened {
    source: Box<dyn BlockSource>,
    format: String,
    affine: Option<Affine>,
    crs: Option<Crs>,
    acquired: Option<String>,
}

impl Opened {
    /// By the first bytes, not by the name.
    fn by_content(path: &Path, options: &OpenOptions) -> Result<Self, RasterError> {
        let mut start = Vec::new();
        let file = std::fs::File::open(path).map_err(|e| RasterError::io(path, e))?;
        file.take(8).read_to_end(&mut start).map_err(|e| RasterError::io(path, e))?;
        match start.as_slice() {
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => match Self::tiff(path, options) {
                Err(error @ RasterError::Unsupported { .. }) => Self::other(path, options, error),
                known => known,
            },
            [0x89, b'P', b'N', b'G', ..] => Self::photo(path, ImageFormat::Png, options),
            [0xFF, 0xD8, 0xFF, ..] => Self::photo(path, ImageFormat::Jpeg, options),
            [] => Err(RasterError::Format { path: path.into(), reason: "it is empty".into() }),
            other => {
                let reason = format!("it starts with {other:02x?}");
                Self::other(path, options, RasterError::Format { path: path.into(), reason })
            }
        }
    }

    fn tiff(path: &Path, options: &OpenOptions) -> Result<Self, RasterError> {
        let source = TiffSource::open(path, options)?;
        let (affine, crs) = placement(path, source.base(), options.crs.is_some())?;
        let acquired = source.acquired();
        Ok(Self { source: Box::new(source), format: "GeoTIFF".into(), affine, crs, acquired })
    }

    fn photo(path: &Path, format: ImageFormat, options: &OpenOptions) -> Result<Self, RasterError> {
        let source = PhotoSource::open(path, format, options)?;
        let (format, acquired) = (source.format_name().to_string(), source.acquired());
        Ok(Self { source: Box::new(source), format, affine: None, crs: None, acquired })
    }

    /// What GDAL makes of a file that is not read here.
    #[cfg(feature = "gdal")]
    fn other(path: &Path, options: &OpenOptions, _refusal: RasterError) -> Result<Self, RasterError> {
        let source = super::gdal::GdalSource::open(path, options)?;
        let (affine, crs) = source.placement(options.crs.is_some())?;
        Ok(Self { format: source.format_name(), source: Box::new(source), affine, crs, acquired: None })
    }

    #[cfg(not(feature = "gdal"))]
    fn other(_path: &Path, _options: &OpenOptions, refusal: RasterError) -> Result<Self, RasterError> {
        Err(refusal)
    }
}
