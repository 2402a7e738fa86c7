//! `Orthophoto`: an opened source.

use super::affine::Affine;
use super::block::{BlockCache, BlockSource};
use super::error::RasterError;
use super::georeference::Georeference;
use super::options::OpenOptions;
use super::photo::PhotoSource;
use super::side_files::{prj_crs, world_placement};
use super::tiff::{TiffSource, placement};
use super::warp::Warp;
use crate::crs::Crs;
use crate::remedy::Remedy;
use image::ImageFormat;
use overfly_core::geodesy::Geodetic;
use overfly_core::pixels::MaskedColour;
use overfly_core::tile::TileId;
use overfly_store::require_regular;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The properties of an opened source.
#[derive(Debug, Clone)]
pub struct OrthophotoDescription {
    /// The file.
    pub path: PathBuf,
    /// "GeoTIFF", "PNG", ...
    pub format: String,
    /// Columns.
    pub width_px: u64,
    /// Rows.
    pub height_px: u64,
    /// The CRS for people: "EPSG:26914 (NAD83 / UTM zone 14N)", "user-defined Transverse Mercator", ...
    pub crs: String,
    /// Ground sample distance at the centre, in true metres: the geometric mean of both pixel axes.
    pub gsd_m_per_px: f64,
    /// The image's edge on the ground, with points along each side, not closed.
    pub outline: Vec<Geodetic>,
    /// Acquisition date that the file states, ISO 8601 (YYYY-MM-DD).
    pub acquired: Option<String>,
    /// The standard deviation per axis that the CRS's datum shift adds, metres.
    pub crs_error_m: f64,
    /// The CRS that the file states itself, where another one was given for it.
    pub overridden_crs: Option<String>,
}

/// An opened orthophoto. `Send + Sync`. Blocks are read on demand and cached within a bound.
pub struct Orthophoto {
    description: OrthophotoDescription,
    georeference: Georeference,
    source: Box<dyn BlockSource>,
    cache: Arc<BlockCache>,
    source_key: u64,
    heights: bool,
}

impl std::fmt::Debug for Orthophoto {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Orthophoto").field("description", &self.description).finish_non_exhaustive()
    }
}

impl Orthophoto {
    /// Opens a GeoTIFF or COG, or a PNG or JPEG with a world file. Reads headers only.
    ///
    /// # Errors
    /// [`RasterError`] where the file cannot be read or placed.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, RasterError> {
        let opened = OpenedFile::open(path, options)?;
        let given = options.crs.map(Crs::from_epsg).transpose().map_err(|e| RasterError::crs(path, e))?;
        let affine = match opened.affine {
            Some(affine) => affine,
            None => world_placement(path)?.ok_or_else(|| RasterError::NoGeoreference { path: path.into() })?,
        };
        let own_crs = given.is_some().then(|| opened.own_crs.or_else(|| prj_crs(path).ok()?.map(crs_name))).flatten();
        let crs = match given.or(opened.crs) {
            Some(crs) => crs,
            None => prj_crs(path)?.ok_or_else(|| RasterError::NoCrs { path: path.into(), detail: String::new() })?,
        };
        let size = opened.source.levels()[0];
        let georeference = Georeference::new(path, affine, crs, size.width_px, size.height_px)?;
        let description = OrthophotoDescription {
            path: path.into(),
            format: opened.format,
            width_px: size.width_px,
            height_px: size.height_px,
            crs: georeference.crs.name().into(),
            gsd_m_per_px: georeference.gsd_m_per_px,
            outline: georeference.outline.clone(),
            acquired: opened.acquired,
            crs_error_m: georeference.crs.error_m(),
            overridden_crs: own_crs.filter(|own| own != georeference.crs.name()),
        };
        let cache = options.cache.clone().unwrap_or_default();
        let source_key = cache.new_source();
        Ok(Self { description, georeference, source: opened.source, cache, source_key, heights: options.heights })
    }

    /// The properties of the source.
    pub fn description(&self) -> &OrthophotoDescription {
        &self.description
    }

    /// Warps the source to a tile: averaged by area where it shrinks, interpolated otherwise. `None` where the tile holds no
    /// valid pixel. Pixels depend on the source and the tile matrix only, so tiles join without seams.
    ///
    /// # Errors
    /// [`RasterError`] where a block cannot be read or decoded.
    pub fn warp(&self, tile: TileId) -> Result<Option<MaskedColour>, RasterError> {
        let warp = Warp {
            georeference: &self.georeference,
            source: self.source.as_ref(),
            cache: &self.cache,
            source_key: self.source_key,
            heights: self.heights,
        };
        warp.tile(tile)
    }
}

/// A file with its decoder, and the position and date that it states.
struct OpenedFile {
    source: Box<dyn BlockSource>,
    format: String,
    affine: Option<Affine>,
    crs: Option<Crs>,
    /// The CRS that the file states, where it is overridden.
    own_crs: Option<String>,
    acquired: Option<String>,
}

fn crs_name(crs: Crs) -> String {
    crs.name().to_owned()
}

impl OpenedFile {
    /// Opens a file by the format that its first bytes state, whatever its name.
    fn open(path: &Path, options: &OpenOptions) -> Result<Self, RasterError> {
        let mut start = Vec::new();
        require_regular(path).map_err(|e| RasterError::io(path, e))?;
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
            other => Self::other(path, options, unknown_format(path, other)),
        }
    }

    fn tiff(path: &Path, options: &OpenOptions) -> Result<Self, RasterError> {
        let source = TiffSource::open(path, options)?;
        let (affine, crs) = placement(path, source.base(), options.crs.is_some())?;
        let acquired = source.acquired();
        // What it says itself, where that is read at all: another one was given, perhaps since it cannot be.
        let own = options.crs.and_then(|_| placement(path, source.base(), false).ok()?.1);
        let own_crs = own.map(crs_name);
        Ok(Self { source: Box::new(source), format: "GeoTIFF".into(), affine, crs, own_crs, acquired })
    }

    fn photo(path: &Path, format: ImageFormat, options: &OpenOptions) -> Result<Self, RasterError> {
        if options.heights {
            let reason = "heights are read from GeoTIFF files".into();
            return Err(RasterError::Unsupported { path: path.into(), reason, remedy: Remedy::ConvertToCog });
        }
        let source = PhotoSource::open(path, format, options)?;
        let (format, acquired) = (source.format_name().to_string(), source.acquired());
        Ok(Self { source: Box::new(source), format, affine: None, crs: None, own_crs: None, acquired })
    }

    /// Opens with GDAL a file that no other decoder here reads.
    #[cfg(feature = "gdal")]
    fn other(path: &Path, options: &OpenOptions, _refusal: RasterError) -> Result<Self, RasterError> {
        let source = super::gdal::GdalSource::open(path, options)?;
        let (affine, crs) = source.placement(options.crs.is_some())?;
        Ok(Self { format: source.format_name(), source: Box::new(source), affine, crs, own_crs: None, acquired: None })
    }

    #[cfg(not(feature = "gdal"))]
    fn other(_path: &Path, _options: &OpenOptions, refusal: RasterError) -> Result<Self, RasterError> {
        Err(refusal)
    }
}

/// The error for a file of another format, by its first bytes.
fn unknown_format(path: &Path, start: &[u8]) -> RasterError {
    let is_text = start.iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace());
    match start {
        b"SQLite f" => RasterError::Unsupported {
            path: path.into(),
            reason: "a GeoPackage or another database, not an orthophoto".into(),
            remedy: Remedy::NameSources,
        },
        text if is_text => {
            let text = String::from_utf8_lossy(text);
            RasterError::Format { path: path.into(), reason: format!("it is text that begins with {:?}", text.trim()) }
        }
        other => RasterError::Format { path: path.into(), reason: format!("it starts with {other:02x?}") },
    }
}
