//! The surface that a TIFF's heights are above, as its GeoTIFF keys state it, and the metres that its samples stand for.

use super::keys::GeoKeys;
use super::layout::file_directories;
use super::open::open_file;
use crate::raster::error::{RasterError, guarded};
use crate::raster::gdal_metadata::{metadata_xml, parse_items};
use crate::remedy::Remedy;
use overfly_core::geodesy::VerticalDatum;
use std::path::Path;
use tiff_reader::Ifd;

const GEODETIC_CRS: u16 = 2048;
const VERTICAL_CRS: u16 = 4096;
const VERTICAL_CITATION: u16 = 4097;
const VERTICAL_UNIT: u16 = 4099;
const METRE: u16 = 9001;
/// The metre, as files spell it.
const METRES: [&str; 6] = ["", "m", "metre", "metres", "meter", "meters"];
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

/// The heights that samples stand for: `scale * sample + offset`, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct HeightScale {
    scale: f64,
    offset: f64,
}

impl HeightScale {
    /// Returns the scale that GDAL's metadata of the first band state (`SCALE`, `OFFSET`, `UNITTYPE`): metres themselves, where they do not.
    ///
    /// # Errors
    /// [`RasterError`] for a scale that is no positive number, an offset that is no number, and heights in another unit than the metre.
    pub fn from_image(path: &Path, image: &Ifd) -> Result<Self, RasterError> {
        let items = parse_items(metadata_xml(image));
        let stated = |name: &str| {
            let item = items.iter().find(|item| item.name == name && item.sample.unwrap_or(0) == 0)?;
            Some(item.text.as_str())
        };
        let refused = |reason| RasterError::Unsupported { path: path.into(), reason, remedy: Remedy::HeightsInMetres };
        let number = |name: &str, default: f64| match stated(name).map(|text| (text, text.parse::<f64>())) {
            None => Ok(default),
            Some((_, Ok(value))) if value.is_finite() => Ok(value),
            Some((text, _)) => Err(refused(format!("the {name} of its heights is no number ({text:?})"))),
        };
        if let Some(unit) = stated("UNITTYPE").filter(|unit| !METRES.contains(&unit.to_lowercase().as_str())) {
            return Err(refused(format!("it counts heights in another unit than the metre ({unit:?})")));
        }
        let (scale, offset) = (number("SCALE", 1.0)?, number("OFFSET", 0.0)?);
        if scale <= 0.0 {
            return Err(refused(format!("the SCALE of its heights is {scale}: they would be upside down")));
        }
        Ok(Self { scale, offset })
    }

    /// The height of a sample, metres.
    pub fn metres(self, sample: f64) -> f64 {
        self.scale * sample + self.offset
    }
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
        let unit = match keys.code(VERTICAL_UNIT) {
            Some(METRE) => None,
            Some(code) => Some(format!("EPSG code {code}")),
            None => keys.is_user_defined(VERTICAL_UNIT).then(|| "one of its own".into()),
        };
        if let Some(unit) = unit {
            let reason = format!("it counts heights in another unit than the metre ({unit})");
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
