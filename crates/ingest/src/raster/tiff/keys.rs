//! GeoTIFF keys, and the CRS that they define.
//!
//! Key and code numbers: OGC 19-008r4 (GeoTIFF 1.1), annex B and section 7.

use crate::crs::{Crs, CrsError, DatumShift, Definition, Ellipsoid, Method};
use crate::raster::error::RasterError;
use crate::remedy::Remedy;
use geotiff_core::geokeys::GeoKeyDirectory;
use std::path::Path;
use tiff_reader::{Ifd, TagValue};

const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const CITATION: u16 = 1026;
const GEODETIC_CRS: u16 = 2048;
const GEODETIC_DATUM: u16 = 2050;
const PRIME_MERIDIAN: u16 = 2051;
const ANGULAR_UNIT: u16 = 2054;
const ELLIPSOID: u16 = 2056;
const SEMI_MAJOR: u16 = 2057;
const SEMI_MINOR: u16 = 2058;
const INVERSE_FLATTENING: u16 = 2059;
const TO_WGS84: u16 = 2062;
const PROJECTED_CRS: u16 = 3072;
const PROJECTED_CITATION: u16 = 3073;
const PROJECTION: u16 = 3074;
const METHOD: u16 = 3075;
const LINEAR_UNIT: u16 = 3076;
const LINEAR_UNIT_SIZE: u16 = 3077;
const PARALLEL_1: u16 = 3078;
const PARALLEL_2: u16 = 3079;
/// Longitudes of the natural origin, the false origin, the centre and the pole.
const LONGITUDES: [u16; 4] = [3080, 3084, 3088, 3095];
const LATITUDES: [u16; 3] = [3081, 3085, 3089];
const EASTINGS: [u16; 3] = [3082, 3086, 3090];
const NORTHINGS: [u16; 3] = [3083, 3087, 3091];
const SCALES: [u16; 2] = [3092, 3093];

const USER_DEFINED: u16 = 32767;

/// The key directory of an image; empty where it has no readable one.
pub(super) struct GeoKeys(Option<GeoKeyDirectory>);

impl GeoKeys {
    pub fn from_image(image: &Ifd) -> Self {
        let directory = match image.tag(34735).map(|t| &t.value) {
            Some(TagValue::Short(values)) => values.as_slice(),
            _ => &[],
        };
        let doubles = match image.tag(34736).map(|t| &t.value) {
            Some(TagValue::Double(values)) => values.as_slice(),
            _ => &[],
        };
        let text = match image.tag(34737).map(|t| &t.value) {
            Some(TagValue::Ascii(text)) => text.as_str(),
            _ => "",
        };
        Self(GeoKeyDirectory::parse(directory, doubles, text))
    }

    /// Whether the coordinates are those of pixel centres.
    pub fn is_pixel_point(&self) -> bool {
        self.short(RASTER_TYPE) == Some(2)
    }

    fn short(&self, key: u16) -> Option<u16> {
        self.0.as_ref()?.get_short(key)
    }

    /// Returns a code, unless it is absent, 'undefined' or 'user-defined'.
    pub fn code(&self, key: u16) -> Option<u16> {
        self.short(key).filter(|v| !matches!(*v, 0 | USER_DEFINED))
    }

    /// Whether a code is 'user-defined'.
    pub fn is_user_defined(&self, key: u16) -> bool {
        self.short(key) == Some(USER_DEFINED)
    }

    pub fn text(&self, key: u16) -> Option<&str> {
        self.0.as_ref()?.get_ascii(key)
    }

    fn doubles(&self, key: u16) -> Option<&[f64]> {
        self.0.as_ref()?.get_double(key)
    }

    fn double(&self, key: u16) -> Option<f64> {
        self.doubles(key)?.first().copied()
    }

    fn first_double(&self, keys: &[u16]) -> Option<f64> {
        keys.iter().find_map(|key| self.double(*key))
    }

    fn citation(&self) -> Option<&str> {
        let directory = self.0.as_ref()?;
        [PROJECTED_CITATION, CITATION].into_iter().find_map(|key| directory.get_ascii(key))
    }
}

/// Returns the CRS that the keys define; `None` where they define none.
///
/// # Errors
/// [`RasterError::Crs`] for a CRS that cannot be projected correctly.
pub(super) fn crs_from_keys(path: &Path, keys: &GeoKeys) -> Result<Option<Crs>, RasterError> {
    let refuse = |source: CrsError| RasterError::crs(path, source);
    match keys.short(MODEL_TYPE) {
        Some(3) => Err(refuse(refusal(
            "the file's CRS",
            "it is geocentric; only projected and geographic systems place an image",
        ))),
        Some(2) => geographic(keys).map_err(refuse),
        Some(1) => projected(keys).map_err(refuse),
        _ if keys.short(PROJECTED_CRS).is_some() => projected(keys).map_err(refuse),
        _ if keys.short(GEODETIC_CRS).is_some() => geographic(keys).map_err(refuse),
        _ => Ok(None),
    }
}

fn refusal(name: &str, reason: impl Into<String>) -> CrsError {
    CrsError::Refused { name: name.into(), reason: reason.into(), remedy: Remedy::StateCrsOrReproject }
}

fn geographic(keys: &GeoKeys) -> Result<Option<Crs>, CrsError> {
    let name = "the file's geographic CRS";
    if angular_unit_deg(keys) != Some(1.0) {
        return Err(refusal(
            name,
            format!("its unit is not the degree (code {})", keys.short(ANGULAR_UNIT).unwrap_or(0)),
        ));
    }
    if let Some(code) = keys.code(GEODETIC_CRS) {
        return Crs::from_epsg(code.into()).map(Some);
    }
    let Some((ellipsoid, datum)) = datum_from_keys(keys)? else { return Ok(None) };
    Crs::from_definition(&Definition {
        method: Method::Geographic,
        origin_latitude_deg: 0.0,
        origin_longitude_deg: 0.0,
        false_easting: 0.0,
        false_northing: 0.0,
        unit_m: 1.0,
        ellipsoid,
        datum,
    })
    .map(Some)
}

fn projected(keys: &GeoKeys) -> Result<Option<Crs>, CrsError> {
    if let Some(code) = keys.code(PROJECTED_CRS) {
        let crs = Crs::from_epsg(code.into())?;
        if let (Some(stated), Some(own)) = (linear_unit_m(keys), crs.unit_m())
            && (stated / own - 1.0).abs() > 1e-9
        {
            return Err(refusal(crs.name(), format!("the file counts it in units of {stated} m, not {own} m")));
        }
        return Ok(Some(crs));
    }
    let Some((ellipsoid, datum)) = datum_from_keys(keys)? else { return Ok(None) };
    let name = keys
        .citation()
        .map_or("the file's user-defined CRS".to_string(), |c| format!("the file's CRS ({})", c.trim_matches('|')));
    let degree = angular_unit_deg(keys).ok_or_else(|| refusal(&name, "its angular unit is unknown"))?;
    let unit_m = match (keys.short(LINEAR_UNIT), linear_unit_m(keys)) {
        (_, Some(unit)) => unit,
        (None, None) => 1.0,
        (Some(code), None) => return Err(refusal(&name, format!("its linear unit (code {code}) is unknown"))),
    };
    if let Some(zone) = keys.code(PROJECTION).and_then(utm_zone) {
        return Crs::from_definition(&Definition { unit_m, ellipsoid, datum, ..zone }).map(Some);
    }
    let Some(method) = method_from_keys(keys, degree, &name)? else { return Ok(None) };
    let missing = |what: &str| refusal(&name, format!("its {what} is missing"));
    Crs::from_definition(&Definition {
        method,
        origin_latitude_deg: keys.first_double(&LATITUDES).ok_or_else(|| missing("latitude of origin"))? * degree,
        origin_longitude_deg: keys.first_double(&LONGITUDES).ok_or_else(|| missing("central meridian"))? * degree,
        false_easting: keys.first_double(&EASTINGS).unwrap_or(0.0),
        false_northing: keys.first_double(&NORTHINGS).unwrap_or(0.0),
        unit_m,
        ellipsoid,
        datum,
    })
    .map(Some)
}

/// Returns the projection's method with its parameters; `None` where none is stated. `degree` is the size of the keys'
/// angular unit in degrees.
fn method_from_keys(keys: &GeoKeys, degree: f64, name: &str) -> Result<Option<Method>, CrsError> {
    let scale = keys.first_double(&SCALES).unwrap_or(1.0);
    let parallel_deg = |key, which: &str| {
        let missing = || refusal(name, format!("its {which} standard parallel is missing"));
        keys.double(key).map(|angle| angle * degree).ok_or_else(missing)
    };
    let parallels = || Ok((parallel_deg(PARALLEL_1, "first")?, parallel_deg(PARALLEL_2, "second")?));
    Ok(Some(match keys.short(METHOD) {
        Some(1) => Method::TransverseMercator { scale },
        Some(7) => Method::Mercator { scale },
        Some(8) => {
            let (parallel_1_deg, parallel_2_deg) = parallels()?;
            Method::LambertConformal2 { parallel_1_deg, parallel_2_deg }
        }
        Some(9) => Method::LambertConformal1 { scale },
        Some(10) => Method::LambertAzimuthalEqualArea,
        Some(11) => {
            let (parallel_1_deg, parallel_2_deg) = parallels()?;
            Method::Albers { parallel_1_deg, parallel_2_deg }
        }
        Some(15) => Method::PolarStereographic { scale },
        Some(other) => {
            let why = format!("its projection (GeoTIFF method {other}) is not implemented exactly");
            return Err(refusal(name, why));
        }
        None => return Ok(None),
    }))
}

/// Returns the UTM zone of the projection codes 160zz (north) and 161zz (south).
fn utm_zone(code: u16) -> Option<Definition> {
    let (zone, false_northing) = match code {
        16001..=16060 => (code - 16000, 0.0),
        16101..=16160 => (code - 16100, 10_000_000.0),
        _ => return None,
    };
    Some(Definition {
        method: Method::TransverseMercator { scale: 0.9996 },
        origin_latitude_deg: 0.0,
        origin_longitude_deg: f64::from(zone) * 6.0 - 183.0,
        false_easting: 500_000.0,
        false_northing,
        unit_m: 1.0,
        ellipsoid: Ellipsoid::WGS84,
        datum: DatumShift::Unknown,
    })
}

/// Returns the ellipsoid and the datum shift, from the code of the geographic CRS, of the datum, or from the ellipsoid
/// alone; `None` where nothing is stated.
fn datum_from_keys(keys: &GeoKeys) -> Result<Option<(Ellipsoid, DatumShift)>, CrsError> {
    let name = "the file's datum";
    if keys.code(PRIME_MERIDIAN).is_some_and(|code| code != 8901) {
        return Err(refusal(name, "its prime meridian is not Greenwich"));
    }
    if let Some(code) = keys.code(GEODETIC_CRS) {
        return DatumShift::from_geographic_code(code.into()).map(Some);
    }
    // The code of an old datum is the code of its geographic system plus 2000.
    if let Some(code @ 6000..=6999) = keys.code(GEODETIC_DATUM)
        && let Ok(known) = DatumShift::from_geographic_code(u32::from(code) - 2000)
    {
        return Ok(Some(known));
    }
    let ellipsoid = match (keys.code(ELLIPSOID), keys.double(SEMI_MAJOR)) {
        (Some(7030), _) => Ellipsoid::WGS84,
        (Some(7019), _) => Ellipsoid::GRS80,
        (_, Some(semi_major_m)) => {
            let from_minor = || keys.double(SEMI_MINOR).map(|minor| semi_major_m / (semi_major_m - minor));
            let Some(inverse_flattening) = keys.double(INVERSE_FLATTENING).or_else(from_minor) else {
                return Err(refusal(name, "its ellipsoid's flattening is missing"));
            };
            Ellipsoid { semi_major_m, inverse_flattening }
        }
        (Some(code), None) => return Err(refusal(name, format!("its ellipsoid (code {code}) is unknown"))),
        (None, None) => return Ok(None),
    };
    let shift = match keys.doubles(TO_WGS84) {
        Some(p) if p.len() == 3 || p.len() == 7 => {
            DatumShift::from_parameters(std::array::from_fn(|i| p.get(i).copied().unwrap_or(0.0)))
        }
        _ => DatumShift::from_ellipsoid(ellipsoid),
    };
    Ok(Some((ellipsoid, shift)))
}

/// Returns the degrees in the file's angular unit; `None` for an unknown unit.
fn angular_unit_deg(keys: &GeoKeys) -> Option<f64> {
    match keys.short(ANGULAR_UNIT) {
        None | Some(0 | 9102 | 9122) => Some(1.0),
        Some(9101) => Some(1f64.to_degrees()),
        Some(9105 | 9106) => Some(0.9),
        Some(_) => None,
    }
}

/// Returns the metres in the file's linear unit; `None` for no or an unknown unit.
fn linear_unit_m(keys: &GeoKeys) -> Option<f64> {
    match keys.short(LINEAR_UNIT)? {
        9001 => Some(1.0),
        9002 => Some(0.3048),
        9003 => Some(1200.0 / 3937.0),
        9036 => Some(1000.0),
        USER_DEFINED => keys.double(LINEAR_UNIT_SIZE),
        _ => None,
    }
}
