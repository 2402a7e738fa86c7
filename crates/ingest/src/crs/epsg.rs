//! EPSG codes: the table's entry for a code, checked for everything that would come out silently wrong.

use super::datum::{DatumShift, Ellipsoid, OTHER_MODERN_ERROR_M, datum_error_m};
use super::error::CrsError;
use crate::remedy::Remedy;

/// A system that needs no projection library.
pub(super) enum BuiltIn {
    /// Degrees on a datum that is taken as WGS84.
    Degrees,
    /// EPSG:3857.
    WebMercator,
}

/// The table's entry for a code.
pub(super) struct EpsgEntry {
    /// The system's name in the EPSG register.
    pub name: String,
    /// The parameters for `proj4rs`.
    pub proj_string: String,
    /// The standard deviation per axis of its datum shift, metres.
    pub error_m: f64,
    /// Set where `proj_string` is not needed.
    pub built_in: Option<BuiltIn>,
}

/// Projections that agree with PROJ over the codes that use them (`tests/reference`).
const METHODS: &[&str] =
    &["longlat", "utm", "tmerc", "lcc", "aea", "laea", "merc", "stere", "sterea", "somerc", "cea", "eqc"];

/// Codes that EPSG defines on a sphere, which their entry does not state (an error of 11 to 18 km).
const SPHERICAL: &[u32] = &[3973, 3974, 3975];

/// Returns the entry of a code.
///
/// # Errors
/// [`CrsError::UnknownCode`], [`CrsError::Refused`].
pub(super) fn look_up(code: u32) -> Result<EpsgEntry, CrsError> {
    let unknown = || unknown_code(code);
    let found = u16::try_from(code).ok().and_then(crs_definitions::from_code).ok_or_else(unknown)?;
    let name = wkt_name(found.wkt).to_string();
    let refused = |reason: String, remedy| CrsError::Refused { name: format!("EPSG:{code} ({name})"), reason, remedy };
    let refuse = |reason: String| refused(reason, Remedy::Reproject);
    if code == 3857 {
        let proj_string = found.proj4.to_string();
        return Ok(EpsgEntry { name, proj_string, error_m: 0.0, built_in: Some(BuiltIn::WebMercator) });
    }
    if !(found.wkt.starts_with("PROJCS[") || found.wkt.starts_with("GEOGCS[")) {
        let reason = "only projected and geographic systems place an image".into();
        return Err(refused(reason, Remedy::StateHorizontalCrs));
    }
    let parameters = Parameters(found.proj4);
    let method = parameters.get("proj").ok_or_else(|| refuse("its projection is not implemented".into()))?;
    if !METHODS.contains(&method) {
        return Err(refuse(format!("the projection '{method}' is not implemented exactly")));
    }
    if SPHERICAL.contains(&code) {
        return Err(refuse("it is projected from a sphere, which the table does not state".into()));
    }
    for (key, what) in [("axis", "its axes do not run east and north"), ("nadgrids", "its datum needs a grid file")] {
        if parameters.get(key).is_some() {
            return Err(refuse(what.into()));
        }
    }
    if parameters.get("datum") == Some("NAD27") {
        return Err(refuse("NAD27 needs the NADCON or NTv2 grids (without them it is up to 100 m off)".into()));
    }
    let error_m = shift_error_m(&parameters, found.wkt)
        .ok_or_else(|| refuse("the shift of its datum to WGS 84 is not known to be right".into()))?;
    let is_plain = method == "longlat" && parameters.is_null_shift() && parameters.get("pm").is_none();
    let built_in = is_plain.then_some(BuiltIn::Degrees);
    Ok(EpsgEntry { name, proj_string: found.proj4.to_string(), error_m, built_in })
}

impl DatumShift {
    /// Returns the ellipsoid and the datum shift of a geographic CRS by its EPSG code.
    ///
    /// # Errors
    /// [`CrsError`] where the code is not known, or its system is refused.
    pub fn from_geographic_code(code: u32) -> Result<(Ellipsoid, Self), CrsError> {
        geographic_datum(code)
    }
}

fn geographic_datum(code: u32) -> Result<(Ellipsoid, DatumShift), CrsError> {
    let entry = look_up(code)?;
    let refuse = |reason: &str| {
        let name = format!("EPSG:{code} ({})", entry.name);
        CrsError::Refused { name, reason: reason.into(), remedy: Remedy::Reproject }
    };
    let found = u16::try_from(code).ok().and_then(crs_definitions::from_code).ok_or_else(|| refuse("unknown"))?;
    let numbers = |key: &str, from: usize| -> Option<Vec<f64>> {
        let inside = found.wkt.split_once(key)?.1.split_once(']')?.0;
        Some(inside.split(',').skip(from).map_while(|v| v.parse().ok()).collect())
    };
    let Some([semi_major_m, inverse_flattening]) = numbers("SPHEROID[", 1).and_then(|v| v.first_chunk::<2>().copied())
    else {
        return Err(refuse("its ellipsoid is not stated"));
    };
    let ellipsoid = Ellipsoid { semi_major_m, inverse_flattening };
    if matches!(entry.built_in, Some(BuiltIn::Degrees)) {
        return Ok((ellipsoid, DatumShift::Null { error_m: entry.error_m }));
    }
    let shift = numbers("TOWGS84[", 0).and_then(|v| <[f64; 7]>::try_from(v).ok());
    let to_wgs84 = shift.ok_or_else(|| refuse("the shift of its datum to WGS 84 is not known"))?;
    Ok((ellipsoid, DatumShift::Helmert { to_wgs84, error_m: entry.error_m }))
}

/// The `+key=value` pairs of a PROJ string.
struct Parameters<'a>(&'a str);

impl<'a> Parameters<'a> {
    fn get(&self, key: &str) -> Option<&'a str> {
        self.0.split_whitespace().find_map(|word| {
            let (k, value) = word.strip_prefix('+')?.split_once('=')?;
            (k == key).then_some(value)
        })
    }

    fn to_wgs84(&self) -> Option<Vec<f64>> {
        self.get("towgs84")?.split(',').map(|v| v.parse().ok()).collect()
    }

    fn is_modern_ellipsoid(&self) -> bool {
        matches!(self.get("ellps"), Some("GRS80" | "WGS84")) || matches!(self.get("datum"), Some("WGS84" | "NAD83"))
    }

    fn is_null_shift(&self) -> bool {
        self.is_modern_ellipsoid() && self.to_wgs84().is_none_or(|p| p.iter().all(|&v| v == 0.0))
    }
}

/// The standard deviation per axis of the shift to WGS 84, metres. `None` for a datum on an old ellipsoid that
/// [`datum_error_m`] does not list: the tables' parameters of such datums were found to be 50 to 500 m off.
fn shift_error_m(parameters: &Parameters<'_>, wkt: &str) -> Option<f64> {
    let stated = datum_code(wkt).and_then(datum_error_m);
    if parameters.is_null_shift() { Some(stated.unwrap_or(OTHER_MODERN_ERROR_M)) } else { stated }
}

/// The first quoted text, which is the system's name.
fn wkt_name(wkt: &str) -> &str {
    wkt.split('"').nth(1).unwrap_or("unnamed")
}

/// The code in `DATUM[..., AUTHORITY["EPSG","6269"]]`: the last authority before the datum's bracket closes.
fn datum_code(wkt: &str) -> Option<u32> {
    let datum = &wkt[wkt.find("DATUM[")?..];
    let mut depth = 0usize;
    let end = datum.char_indices().find_map(|(i, c)| {
        match c {
            '[' => depth += 1,
            ']' => depth -= 1,
            _ => {}
        }
        (depth == 0 && c == ']').then_some(i)
    })?;
    let inside = &datum[..end];
    let authority = &inside[inside.rfind("AUTHORITY[\"EPSG\",\"")? + 18..];
    authority.split('"').next()?.parse().ok()
}

/// The error for a code outside the table; it says what well-known codes mean.
fn unknown_code(code: u32) -> CrsError {
    let (hint, remedy) = match code {
        5701..=5799 | 5600..=5622 | 3855 | 8357 | 8228 => (" (it is a vertical system)", Remedy::StateHorizontalCrs),
        0 | 32767 => (" (it means 'user-defined')", Remedy::StateCrs),
        _ => ("", Remedy::StateCrsOrReproject),
    };
    CrsError::UnknownCode { code, hint, remedy }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn refuses(code: u32, word: &str) {
        let refusal = look_up(code).map(|e| e.name).unwrap_err().to_string();
        assert!(refusal.contains(word) && refusal.contains(&code.to_string()), "EPSG:{code}: {refusal}");
    }

    #[test]
    fn refuses_by_name_what_would_come_out_wrong() {
        refuses(5514, "krovak");
        refuses(26714, "NAD27");
        refuses(4267, "NAD27");
        refuses(4978, "geographic");
        refuses(2046, "axes");
        refuses(31257, "datum");
        refuses(2400, "datum");
        refuses(3973, "sphere");
        refuses(5703, "vertical");
        refuses(32767, "user-defined");
        refuses(123_456, "123456");
        refuses(2008, "NAD27");
    }

    #[test]
    fn states_what_a_missing_grid_costs() {
        for (code, error_m) in
            [(4326, 0.0), (32614, 0.0), (3857, 0.0), (26914, 1.0), (27700, 2.0), (31467, 3.0), (2056, 1.0)]
        {
            assert_eq!(look_up(code).unwrap().error_m, error_m, "EPSG:{code}");
        }
    }
}
