//! Parsers of numbers on the command line. The domains of requests are checked by the library.

fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("not a finite number".into()),
    }
}

/// Parses a finite number greater than zero.
pub fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err("must be greater than zero".into()) })
}

/// Parses a share in [0, 1].
pub fn share(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if (0.0..=1.0).contains(&v) { Ok(v) } else { Err("must lie in [0, 1]".into()) })
}

/// Parses bytes of memory: a number with its unit (`128MB`, `1GB`, `1.5GB`), or megabytes without a unit.
pub fn memory_bytes(text: &str) -> Result<u64, String> {
    let lower = text.trim().to_ascii_lowercase();
    let (number, unit) = match ["gb", "mb", "kb"].into_iter().find_map(|unit| Some((lower.strip_suffix(unit)?, unit))) {
        Some((number, "gb")) => (number, 1e9),
        Some((number, "kb")) => (number, 1e3),
        Some((number, _)) => (number, 1e6),
        None => (lower.as_str(), 1e6),
    };
    let bytes =
        positive(number.trim_end()).map_err(|e| format!("{e}; expected megabytes, or as in 128MB or 1GB"))? * unit;
    if (LEAST_MEMORY_BYTES..1e15).contains(&bytes) { Ok(bytes as u64) } else { Err("expected at least 32MB".into()) }
}

/// The least memory with which a service can search.
const LEAST_MEMORY_BYTES: f64 = 32e6;

/// Parses any finite number.
pub fn any(text: &str) -> Result<f64, String> {
    finite(text)
}

/// Parses a standard deviation of the attitude, degrees.
#[cfg(feature = "lab")]
pub fn attitude_sigma(text: &str) -> Result<f64, String> {
    let most = overfly_core::camera::MAX_ATTITUDE_SIGMA_DEG;
    let expected = || format!("must be degrees in [0, {most}]");
    finite(text).and_then(|v| if (0.0..=most).contains(&v) { Ok(v) } else { Err(expected()) })
}

/// Parses the sample values shown as 0 and 255: LO,HI.
pub fn stretch(text: &str) -> Result<(f64, f64), String> {
    let expected = "two numbers LO,HI, as in 0,4000";
    let (low, high) = text.split_once(',').ok_or(expected)?;
    let number = |part: &str| part.trim().parse::<f64>().map_err(|_| expected.to_owned());
    Ok((number(low)?, number(high)?))
}

#[cfg(test)]
mod tests {
    use super::memory_bytes;

    #[test]
    fn memory_is_megabytes_or_has_its_unit() {
        for (text, bytes) in [
            ("128", 128_000_000),
            ("128MB", 128_000_000),
            ("1GB", 1_000_000_000),
            ("1.5 gb", 1_500_000_000),
            ("64000kB", 64_000_000),
        ] {
            assert_eq!(memory_bytes(text), Ok(bytes), "{text}");
        }
        for text in ["", "MB", "-1", "0", "31MB", "nan", "inf", "1TB", "128 M", "1e99GB"] {
            assert!(memory_bytes(text).is_err(), "{text}");
        }
    }
}
