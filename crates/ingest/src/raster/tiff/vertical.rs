//! The surface that a TIFF's heights are above, as its GeoTIFF keys state it.

use super::keys::GeoKeys;
use super::layout::file_directories;
use super::open::open_file;
use crate::raster::error::{RasterError, guarded};
use crate::remedy::Remedy;
use overfly_core::geodesy::VerticalDatum;
use std::path::Path;

const GEODETIC_CRS: u16 = 2048;
const VERTICAL_CRS: u16 = 4096;
const VERTICAL_CITATION: u16 = 4097;
const VERTICAL_UNIT: u16 = 4099;
const METRE: u16 = 9001;
/// WGS 84 with ellipsoidal height, also where a file states it as its vertical system (as old writers do with 5030).
const WGS84_3D: [u16; 2] = [4979, 5030];
const EGM96_HEIGHT: u16 = 5773;
const EGM2008_HEIGHT: u16 = 3855;

/// The surface that a user-defined vertical system is named after: writers that know no code of a compound system leave its name alone.
fn by_name(citation: &str) -> StatedDatum {
    let name = citation.trim_matches(['|', ' ', '\0']);
    let is_one_of = |names: [&str; 3]| names.iter().any(|known| name.eq_ignore_ascii_case(known));
    if is_one_of(["EGM2008 height", "EGM2008 geoid", "EGM2008"]) {
        return StatedDatum::Known(VerticalDatum::Egm2008);
    }
    if is_one_of(["EGM96 height", "EGM96 geoid", "EGM96"]) {
        return StatedDatum::Known(VerticalDatum::Egm96);
    }
    StatedDatum::Other(if name.is_empty() { "a surface without a name".into() } else { format!("{name:?}") })
}

/// What a file states of the surface below its heights.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StatedDatum {
    /// Nothing.
    Unstated,
    /// One of those that are known.
    Known(VerticalDatum),
    /// Another: its EPSG code or its name.
    Other(String),
}

/// Returns what a TIFF file states of the surface below its heights.
///
/// # Errors
/// [`RasterError`] where the file cannot be read, or counts heights in another unit than the metre.
pub fn stated_datum(path: &Path) -> Result<StatedDatum, RasterError> {
    guarded(path, || {
        let file = open_file(path)?;
        let (directories, _) = file_directories(path, &file)?;
        let keys = GeoKeys::from_image(&directories[0].image);
        if let Some(unit) = keys.code(VERTICAL_UNIT).filter(|unit| *unit != METRE) {
            let reason = format!("it counts heights in another unit than the metre (EPSG code {unit})");
            return Err(RasterError::Unsupported { path: path.into(), reason, remedy: Remedy::HeightsInMetres });
        }
        Ok(match (keys.code(VERTICAL_CRS), keys.code(GEODETIC_CRS)) {
            (Some(EGM96_HEIGHT), _) => StatedDatum::Known(VerticalDatum::Egm96),
            (Some(EGM2008_HEIGHT), _) => StatedDatum::Known(VerticalDatum::Egm2008),
            (Some(code), _) if WGS84_3D.contains(&code) => StatedDatum::Known(VerticalDatum::Ellipsoid),
            (Some(code), _) => StatedDatum::Other(format!("EPSG:{code}")),
            (None, _) if keys.is_user_defined(VERTICAL_CRS) => {
                by_name(keys.text(VERTICAL_CITATION).unwrap_or_default())
            }
            (None, Some(code)) if WGS84_3D.contains(&code) => StatedDatum::Known(VerticalDatum::Ellipsoid),
            (None, _) => StatedDatum::Unstated,
        })
    })
}
