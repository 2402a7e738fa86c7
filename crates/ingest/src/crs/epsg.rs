//! EPSG codes: the table's entry for a code, checked for everything that would come out silently wrong.

use super::CrsError;
use super::datum::{DatumShift, Ellipsoid, OTHER_MODERN_ERROR_M, error_of_datum};

/// What needs no projection library.
pub(super) enum Plain {
    /// Degrees on a datum taken as WGS84.
    Degrees,
    /// EPSG:3857.
    WebMercator,
}

/// What is known of a code.
pub(super) struct Entry {
    /// Its name in the EPSG register.
    pub name: String,
    /// What `proj4rs` is given.
    pub proj_string: String,
    /// One standard deviation per axis, metres.
    pub error_m: f64,
    /// Set where `proj_string` is not needed.
    pub plain: Option<Plain>,
}

/// Projections that agree with PROJ over the codes that use them (`tests/reference`).
const METHODS: &[&str] =
    &["longlat", "utm", "tmerc", "lcc", "aea", "laea", "merc", "stere", "sterea", "somerc", "cea", "eqc"];

/// Codes whose entry leaves out that EPSG means a sphere (11 to 18 km).
const SPHERICAL: &[u32] = &[3973, 3974, 3975];

const REPROJECT: &str = "reproject the file with gdalwarp -t_srs EPSG:4326";

/// The entry of a code.
///
/// # Errors
/// [`CrsError::UnknownCode`], [`CrsError::Refused`].
pub(super) fn look_up(code: u32) -> Result<Entry, CrsError> {
    let unknown = || CrsError::UnknownCode { code, hint: hint_for(code) };
    let found = u16::try_from(code).ok().and_then(crs_definitions::from_code).ok_or_else(unknown)?;
    let name = wkt_name(found.wkt).to_string();
    let refuse = |reason: String| CrsError::Refused { name: format!("EPSG:{code} ({name})"), reason };
    if code == 3857 {
        let proj_string = found.proj4.to_string();
        return Ok(Entry { name, proj_string, error_m: 0.0, plain: Some(Plain::WebMercator) });
    }
    if !(found.wkt.starts_with("PROJCS[") || found.wkt.starts_with("GEOGCS[")) {
        return Err(refuse(
            "only projected and geographic systems place an image; pass the horizontal part with --crs EPSG".into(),
        ));
    }
    let parameters = Parameters(found.proj4);
    let method =
        parameters.get("proj").ok_or_else(|| refuse(format!("its projection has no equations here; {REPROJECT}")))?;
    if !METHODS.contains(&method) {
        return Err(refuse(format!("the projection '{method}' is not one that overfly can do exactly; {REPROJECT}")));
    }
    if SPHERICAL.contains(&code) {
        return Err(refuse(format!("it is projected from a sphere, which the table does not say; {REPROJECT}")));
    }
    for (key, what) in [("axis", "its axes do not run east and north"), ("nadgrids", "its datum needs a grid file")] {
        if parameters.get(key).is_some() {
            return Err(refuse(format!("{what}; {REPROJECT}")));
        }
    }
    if parameters.get("datum") == Some("NAD27") {
        return Err(refuse(format!(
            "NAD27 needs the NADCON or NTv2 grids (without them it is up to 100 m off); {REPROJECT}"
        )));
    }
    let error_m = shift_error_m(&parameters, found.wkt).ok_or_else(|| {
        refuse(format!("the shift of its datum to WGS 84 is not one that overfly knows to be right; {REPROJECT}"))
    })?;
    let plain =
        (method == "longlat" && parameters.is_null_shift() && parameters.get("pm").is_none()).then_some(Plain::Degrees);
    Ok(Entry { name, proj_string: found.proj4.to_string(), error_m, plain })
}

/// The ellipsoid and shift of a geographic CRS.
///
/// # Errors
/// As [`look_up`].
pub(super) fn datum_of(code: u32) -> Result<(Ellipsoid, DatumShift), CrsError> {
    let entry = look_up(code)?;
    let refuse =
        |reason: &str| CrsError::Refused { name: format!("EPSG:{code} ({})", entry.name), reason: reason.into() };
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
    if matches!(entry.plain, Some(Plain::Degrees)) {
        return Ok((ellipsoid, DatumShift::Null { error_m: entry.error_m }));
    }
    let shift = numbers("TOWGS84[", 0).and_then(|v| <[f64; 7]>::try_from(v).ok());
    let to_wgs84 = shift.ok_or_else(|| refuse("the shift of its datum to WGS 84 is not known"))?;
    Ok((ellipsoid, DatumShift::Helmert { to_wgs84, error_m: entry.error_m }))
}

/// `+key=value` pairs of a proj string.
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

/// One standard deviation per axis of the shift to WGS 84. `None` for a datum on an old ellipsoid that [`error_of_datum`]
/// does not list: the parameters that tables carry for such were seen 50 to 500 m off.
fn shift_error_m(parameters: &Parameters<'_>, wkt: &str) -> Option<f64> {
    let stated = datum_code(wkt).and_then(error_of_datum);
    if parameters.is_null_shift() { Some(stated.unwrap_or(OTHER_MODERN_ERROR_M)) } else { stated }
}

/// The first quoted text: the system's name.
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

/// What well-known codes outside the table are.
fn hint_for(code: u32) -> &'static str {
    match code {
        5701..=5799 | 5600..=5622 | 3855 | 8357 | 8228 => {
            " (it is a vertical system); pass the horizontal one with --crs EPSG"
        }
        0 | 32767 => " (it means 'user-defined'); pass the right code with --crs EPSG",
        _ => "; pass a known one with --crs EPSG, or reproject the file with gdalwarp -t_srs EPSG:4326",
    }
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
