//! Numbers on the command line: finite, and in range, or named in clap's own complaint.

fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("not a finite number".into()),
    }
}

/// Greater than zero.
pub fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err("must be greater than zero".into()) })
}

/// Degrees in [-90, 90].
pub fn latitude_deg(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v.abs() <= 90.0 { Ok(v) } else { Err("must lie in [-90, 90]".into()) })
}

/// Degrees in [-360, 360].
pub fn turn_deg(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v.abs() <= 360.0 { Ok(v) } else { Err("must lie in [-360, 360]".into()) })
}

/// Degrees off nadir in (-90, 90).
pub fn tilt_deg(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v.abs() < 90.0 { Ok(v) } else { Err("must lie in (-90, 90)".into()) })
}

/// A share in [0, 1].
pub fn share(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if (0.0..=1.0).contains(&v) { Ok(v) } else { Err("must lie in [0, 1]".into()) })
}

/// Any finite number.
pub fn any(text: &str) -> Result<f64, String> {
    finite(text)
}

/// Source values shown as 0 and 255: LO,HI.
pub fn stretch(text: &str) -> Result<(f64, f64), String> {
    let expected = "two numbers LO,HI, as in 0,4000";
    let (low, high) = text.split_once(',').ok_or(expected)?;
    let number = |part: &str| part.trim().parse::<f64>().map_err(|_| expected.to_owned());
    Ok((number(low)?, number(high)?))
}
