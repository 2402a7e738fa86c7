//! `Request`: what a build is asked to do.

use super::BuildError;
use overfly_core::tile::MAX_ZOOM;
use std::path::PathBuf;

/// What a build is asked to do to one layer of one store.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// The store; made where there is none.
    pub db: PathBuf,
    /// The layer; `ortho` by default on the command line.
    pub layer: String,
    /// Orthophotos to add: files, or folders that are walked.
    pub sources: Vec<PathBuf>,
    /// Base zoom; else the finest source's resolution decides.
    pub zoom: Option<u8>,
    /// Acquisition date of all given sources; else their metadata's.
    pub date: Option<String>,
    /// EPSG code of all given sources, over what they say.
    pub crs: Option<u32>,
    /// Values shown as 0 and 255.
    pub stretch: Option<(f64, f64)>,
    /// One standard deviation per axis of the given sources' positions, metres; 0 where not stated.
    pub horizontal_error_m: Option<f64>,
    /// Threads that warp and encode, at least 1.
    pub threads: usize,
    /// Whether the layer shall be made of the given sources only.
    pub replace_layer: bool,
    /// Sources to take out: paths, or at least 8 digits of content hashes.
    pub remove_sources: Vec<String>,
}

impl Request {
    /// Checks what can be checked without reading a file.
    ///
    /// # Errors
    /// [`BuildError::Date`], [`BuildError::Parameter`], a bad layer name.
    pub fn check(&self) -> Result<(), BuildError> {
        overfly_store::check_name(&self.layer)?;
        if let Some(date) = &self.date
            && !is_date(date)
        {
            return Err(BuildError::Date { date: date.clone() });
        }
        let refuse = |name, value, expected| Err(BuildError::Parameter { name, value, expected });
        match (self.zoom, self.stretch, self.horizontal_error_m) {
            (Some(zoom), ..) if zoom > MAX_ZOOM => refuse("--zoom", zoom.into(), "a zoom from 0 to 23"),
            (_, Some((low, high)), _) if !(low.is_finite() && high.is_finite() && low < high) => {
                refuse("--stretch", low, "two numbers LO,HI with LO below HI")
            }
            (.., Some(error_m)) if !(0.0..1e6).contains(&error_m) => {
                refuse("--horizontal-error-m", error_m, "metres, zero or more")
            }
            _ => Ok(()),
        }
    }
}

/// Whether a text is YYYY-MM-DD or YYYY-MM-DDTHH:MM:SSZ, and a day that exists.
fn is_date(text: &str) -> bool {
    let shape = |pattern: &str| {
        text.len() == pattern.len()
            && text.bytes().zip(pattern.bytes()).all(|(c, p)| if p == b'0' { c.is_ascii_digit() } else { c == p })
    };
    if !shape("0000-00-00") && !shape("0000-00-00T00:00:00Z") {
        return false;
    }
    let number = |range: std::ops::Range<usize>| text[range].parse::<u32>().expect("digits");
    let (year, month, day) = (number(0..4), number(5..7), number(8..10));
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days = match month {
        2 => 28 + u32::from(leap),
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => return false,
    };
    let time = text.len() == 10 || (number(11..13) < 24 && number(14..16) < 60 && number(17..19) < 61);
    (1..=days).contains(&day) && time
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_dates() {
        for date in ["2018-07-16", "2020-02-29", "2018-07-16T23:59:60Z"] {
            assert!(is_date(date), "{date}");
        }
        for date in
            ["", "2018", "2018-7-16", "2019-02-29", "2018-13-01", "2018-07-16T24:00:00Z", "16.07.2018", "２018-07-1"]
        {
            assert!(!is_date(date), "{date}");
        }
    }

    #[test]
    fn refuses_parameters_without_sense() {
        let good = Request { layer: "ortho".into(), ..Request::default() };
        assert!(good.check().is_ok());
        let bad = [
            Request { layer: "a b".into(), ..good.clone() },
            Request { zoom: Some(24), ..good.clone() },
            Request { stretch: Some((5.0, 5.0)), ..good.clone() },
            Request { stretch: Some((f64::NAN, 5.0)), ..good.clone() },
            Request { horizontal_error_m: Some(-1.0), ..good.clone() },
            Request { date: Some("yesterday".into()), ..good },
        ];
        assert!(bad.iter().all(|r| r.check().is_err()));
    }
}
