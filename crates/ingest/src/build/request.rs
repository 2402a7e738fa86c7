//! `Request`: what a build has to do.

use super::error::BuildError;
use jiff::civil::Date;
use overfly_core::tile::MAX_ZOOM;
use overfly_store::package::{acquisition_day, is_future};
use overfly_store::{MOST_ERROR_M, Terms, Terrain};
use std::path::PathBuf;

/// A build of one layer of one store.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// The store's file; it is created where there is none.
    pub db: PathBuf,
    /// The layer.
    pub layer: String,
    /// Orthophotos to add: files, or folders to search.
    pub sources: Vec<PathBuf>,
    /// Base zoom; by default the one that keeps the finest source's resolution.
    pub zoom: Option<u8>,
    /// Acquisition date of all given sources; by default their metadata's.
    pub date: Option<String>,
    /// EPSG code of all given sources; it overrides what they state.
    pub crs: Option<u32>,
    /// Sample values shown as 0 and 255.
    pub stretch: Option<(f64, f64)>,
    /// Standard deviation per axis of the given sources' positions, metres: `None` where it is not known.
    pub horizontal_error_m: Option<f64>,
    /// What the sources state of their heights, where they are heights and not imagery.
    pub terrain: Option<Terrain>,
    /// Licence and attribution of the layer: where one is not stated, that which the layer has stays.
    pub terms: Terms,
    /// Threads that warp and encode, at least 1.
    pub threads: usize,
    /// Whether the layer is made of the given sources only.
    pub replace_layer: bool,
    /// Sources to remove: paths, or at least 8 digits of content hashes.
    pub remove_sources: Vec<String>,
    /// The day of the clock: imagery of the future is refused. `None` refuses no date.
    pub today: Option<Date>,
}

impl Request {
    /// Checks the request without reading a file.
    ///
    /// # Errors
    /// [`BuildError::Date`], [`BuildError::FutureDate`], [`BuildError::Parameter`], or an invalid layer name.
    pub fn check(&self) -> Result<(), BuildError> {
        overfly_store::check_name(&self.layer)?;
        self.date.as_deref().map_or(Ok(()), |date| check_date(date, self.today))?;
        let refuse = |name, value, expected| Err(BuildError::Parameter { name, value, expected });
        match (self.zoom, self.stretch, self.horizontal_error_m) {
            (Some(zoom), ..) if zoom > MAX_ZOOM => refuse("zoom", zoom.into(), "a zoom from 0 to 23"),
            (_, Some((low, high)), _) if !(low.is_finite() && high.is_finite() && low < high) => {
                refuse("stretch", low, "two finite numbers, the lower first")
            }
            (.., Some(error_m)) if !(0.0..=MOST_ERROR_M).contains(&error_m) => {
                refuse("horizontal_error_m", error_m, "metres, from 0 to 10000")
            }
            _ => Ok(()),
        }
    }
}

/// Checks that a text is an acquisition date, and not of the future.
///
/// # Errors
/// [`BuildError::Date`], [`BuildError::FutureDate`].
pub fn check_date(date: &str, today: Option<Date>) -> Result<(), BuildError> {
    if !is_date(date) {
        return Err(BuildError::Date { date: date.to_owned() });
    }
    match future_day(date, today) {
        Some((day, today)) => Err(BuildError::FutureDate { day, today }),
        None => Ok(()),
    }
}

/// Returns the day of an acquisition date and today, if no imagery of that day can exist.
pub fn future_day(date: &str, today: Option<Date>) -> Option<(Date, Date)> {
    let (day, today) = (acquisition_day(date)?, today?);
    is_future(day, today).then_some((day, today))
}

/// Whether a text is YYYY-MM-DD or YYYY-MM-DDTHH:MM:SSZ and names an existing day. Leap seconds are accepted.
pub fn is_date(text: &str) -> bool {
    let shape = |pattern: &str| {
        text.len() == pattern.len()
            && text.bytes().zip(pattern.bytes()).all(|(c, p)| if p == b'0' { c.is_ascii_digit() } else { c == p })
    };
    if !shape("0000-00-00") && !shape("0000-00-00T00:00:00Z") {
        return false;
    }
    let number = |range: std::ops::Range<usize>| text[range].parse::<i16>().expect("digits");
    let time = text.len() == 10 || (number(11..13) < 24 && number(14..16) < 60 && number(17..19) < 61);
    time && Date::new(number(0..4), number(5..7) as i8, number(8..10) as i8).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_dates() {
        for date in ["2018-07-16", "2020-02-29", "2018-07-16T23:59:60Z"] {
            assert!(is_date(date), "{date}");
        }
        for date in [
            "",
            "2018",
            "2018-7-16",
            "2018-00-10",
            "2018-07-00",
            "2019-02-29",
            "2018-13-01",
            "2018-07-16T24:00:00Z",
            "16.07.2018",
            "２018-07-1",
        ] {
            assert!(!is_date(date), "{date}");
        }
    }

    #[test]
    fn refuses_parameters_out_of_range() {
        let good = Request { layer: "ortho".into(), ..Request::default() };
        assert!(good.check().is_ok());
        let bad = [
            Request { layer: "a b".into(), ..good.clone() },
            Request { zoom: Some(24), ..good.clone() },
            Request { stretch: Some((5.0, 5.0)), ..good.clone() },
            Request { stretch: Some((f64::NAN, 5.0)), ..good.clone() },
            Request { horizontal_error_m: Some(-1.0), ..good.clone() },
            Request { date: Some("yesterday".into()), ..good.clone() },
        ];
        assert!(bad.iter().all(|r| r.check().is_err()));
        let today = Some(jiff::civil::date(2026, 7, 16));
        let dated = |date: &str| Request { date: Some(date.into()), today, ..good.clone() }.check();
        assert!(dated("2026-07-17").is_ok() && dated("2026-07-16T10:00:00Z").is_ok(), "it is tomorrow elsewhere");
        assert_eq!(dated("2026-07-18").unwrap_err().code(), "future_date");
        assert!(Request { date: Some("2112-07-31".into()), ..good }.check().is_ok(), "without a clock");
    }
}
