//! Parsers of numbers on the command line, as people type them. The domains of requests are checked by the library.
//!
//! An error states what is wrong with the text. `usage` adds what the flag expects, with an example.

use overfly_core::integrity::INTEGRITY_RISKS;

/// Metres in the units of length that a number may have; longer names first.
const LENGTHS_M: [(&str, f64); 5] = [("nmi", 1852.0), ("km", 1000.0), ("ft", 0.3048), ("NM", 1852.0), ("m", 1.0)];

/// Bytes in the units of size, lower case; longer names first.
const SIZES: [(&str, f64); 7] = [
    ("gib", 1_073_741_824.0),
    ("mib", 1_048_576.0),
    ("kib", 1024.0),
    ("gb", 1e9),
    ("mb", 1e6),
    ("kb", 1e3),
    ("b", 1.0),
];

/// The least memory with which a service can search.
const LEAST_MEMORY_BYTES: f64 = 32e6;

/// Parses any finite number.
pub fn any(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err("not a finite number".into()),
        Err(_) => Err(decimal_comma(text).unwrap_or_else(|| "not a number".into())),
    }
}

/// What is wrong with a number that has a comma, and how it is written: `None` if a comma is not what is wrong.
fn decimal_comma(text: &str) -> Option<String> {
    let (whole, decimals) = text.trim().split_once(',')?;
    let pointed = format!("{whole}.{decimals}");
    pointed.parse::<f64>().ok().filter(|v| v.is_finite())?;
    let is_zero = whole.trim_start_matches('-').chars().all(|c| c == '0');
    let thousands = decimals.len() == 3 && !is_zero;
    Some(match thousands {
        true => format!("a number has no comma: write {pointed} for a decimal, or {whole}{decimals}"),
        false => format!("a decimal is written with a point: {pointed}"),
    })
}

/// Parses a finite number greater than zero.
pub fn positive(text: &str) -> Result<f64, String> {
    any(text).and_then(more_than_zero)
}

fn more_than_zero(value: f64) -> Result<f64, String> {
    if value > 0.0 { Ok(value) } else { Err("must be greater than zero".into()) }
}

/// Parses a length, metres: a number with its unit (`400m`, `0.4km`, `1300ft`, `2nmi`), or metres without a unit.
pub fn metres(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let of_unit = LENGTHS_M.into_iter().find_map(|(unit, metres)| Some((text.strip_suffix(unit)?, metres)));
    let (number, unit_m) = of_unit.unwrap_or((text, 1.0));
    // `1nm` is no number of metres, and no length of a flight.
    if number.strip_suffix('n').is_some_and(|number| any(number).is_ok()) {
        return Err("nm is a nanometre: a nautical mile is nmi or NM".into());
    }
    any(number.trim_end()).map(|value| value * unit_m)
}

/// Parses a length greater than zero, metres; see [`metres`].
pub fn positive_metres(text: &str) -> Result<f64, String> {
    metres(text).and_then(more_than_zero)
}

/// Parses an integrity risk.
pub fn risk(text: &str) -> Result<f64, String> {
    let is_risk = |value: &f64| INTEGRITY_RISKS.contains(value);
    any(text).and_then(|v| if is_risk(&v) { Ok(v) } else { Err("must lie in [1e-9, 0.5]".into()) })
}

/// Parses a share in [0, 1].
pub fn share(text: &str) -> Result<f64, String> {
    any(text).and_then(|v| if (0.0..=1.0).contains(&v) { Ok(v) } else { Err("must lie in [0, 1]".into()) })
}

/// Parses a size, bytes: a number with its unit (`5MB`, `64MiB`), in units of `unit_bytes` without one.
fn size(text: &str, unit_bytes: f64) -> Result<f64, String> {
    let lower = text.trim().to_ascii_lowercase();
    let of_unit = SIZES.into_iter().find_map(|(unit, bytes)| Some((lower.strip_suffix(unit)?, bytes)));
    let (number, bytes) = of_unit.unwrap_or((&lower, unit_bytes));
    let bytes = positive(number.trim_end())? * bytes;
    if bytes < 1e15 { Ok(bytes) } else { Err("more than any disk holds".into()) }
}

/// Parses bytes of a file: a number with its unit (`5MB`, `64MiB`), or bytes without a unit.
#[cfg(feature = "preflight")]
pub fn file_bytes(text: &str) -> Result<u64, String> {
    size(text, 1.0).map(|bytes| bytes as u64)
}

/// Parses bytes of memory: a number with its unit (`128MB`, `1GiB`, `1.5GB`), or megabytes without a unit.
pub fn memory_bytes(text: &str) -> Result<u64, String> {
    let bytes = size(text, 1e6)?;
    if bytes >= LEAST_MEMORY_BYTES { Ok(bytes as u64) } else { Err("must be at least 32MB".into()) }
}

/// Parses an EPSG code: `32614`, or `EPSG:32614`.
#[cfg(feature = "preflight")]
pub fn epsg(text: &str) -> Result<u32, String> {
    let lower = text.trim().to_ascii_lowercase();
    let code = lower.rsplit_once(':').filter(|(authority, _)| authority.contains("epsg")).map_or(&*lower, |(_, c)| c);
    code.parse().map_err(|_| "not an EPSG code".into())
}

/// Parses a standard deviation of the attitude, degrees.
#[cfg(feature = "lab")]
pub fn attitude_sigma(text: &str) -> Result<f64, String> {
    let most = overfly_core::camera::MAX_ATTITUDE_SIGMA_DEG;
    let expected = || format!("must be degrees in [0, {most}]");
    any(text).and_then(|v| if (0.0..=most).contains(&v) { Ok(v) } else { Err(expected()) })
}

/// Parses the sample values shown as 0 and 255: LO,HI.
#[cfg(feature = "preflight")]
pub fn stretch(text: &str) -> Result<(f64, f64), String> {
    let parts: Vec<&str> = text.split(',').collect();
    let [low, high] = parts[..] else { return Err("not two numbers".into()) };
    Ok((any(low)?, any(high)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_megabytes_or_has_its_unit() {
        for (text, bytes) in [
            ("128", 128_000_000),
            ("128MB", 128_000_000),
            ("1GB", 1_000_000_000),
            ("1.5 gb", 1_500_000_000),
            ("64000kB", 64_000_000),
            ("64MiB", 67_108_864),
            ("1GiB", 1_073_741_824),
        ] {
            assert_eq!(memory_bytes(text), Ok(bytes), "{text}");
        }
        for text in ["", "MB", "-1", "0", "31MB", "nan", "inf", "1TB", "128 M", "1e99GB"] {
            assert!(memory_bytes(text).is_err(), "{text}");
        }
    }

    #[test]
    fn lengths_have_their_unit_or_are_metres() {
        for (text, expected_m) in
            [("400", 400.0), ("400m", 400.0), ("400 m", 400.0), ("0.4km", 400.0), ("1300ft", 396.24), ("2nmi", 3704.0)]
        {
            assert!((metres(text).unwrap() - expected_m).abs() < 1e-9, "{text}");
        }
        for text in ["", "m", "400cm", "km4", "inf", "nan", "nanm", "4 0"] {
            assert!(metres(text).is_err(), "{text}");
        }
        assert!(metres("1nm").unwrap_err().contains("nmi or NM"));
        assert_eq!(metres("1NM"), Ok(1852.0));
        assert!(positive_metres("-5m").is_err() && positive_metres("0").is_err());
    }

    #[test]
    fn a_decimal_comma_is_named_with_the_right_spelling() {
        assert_eq!(any("47,02").unwrap_err(), "a decimal is written with a point: 47.02");
        assert_eq!(metres("0,4km").unwrap_err(), "a decimal is written with a point: 0.4");
        assert_eq!(any("-0,125").unwrap_err(), "a decimal is written with a point: -0.125");
        assert_eq!(any("1,300").unwrap_err(), "a number has no comma: write 1.300 for a decimal, or 1300");
        assert_eq!(any("a,b").unwrap_err(), "not a number");
        assert_eq!(any("1,2,3").unwrap_err(), "not a number");
    }

    #[cfg(feature = "preflight")]
    #[test]
    fn sizes_and_epsg_codes_are_read_as_people_write_them() {
        assert_eq!(file_bytes("5000000"), Ok(5_000_000));
        assert_eq!(file_bytes("5MB"), Ok(5_000_000));
        assert_eq!(file_bytes("64 MiB"), Ok(67_108_864));
        assert!(file_bytes("5M").is_err() && file_bytes("-5MB").is_err());
        for text in ["32614", "EPSG:32614", "epsg:32614", "urn:ogc:def:crs:EPSG::32614"] {
            assert_eq!(epsg(text), Ok(32614), "{text}");
        }
        for text in ["", "WGS84", "EPSG:", "ESRI:102003", "-1", "UTM14"] {
            assert!(epsg(text).is_err(), "{text}");
        }
    }
}
