//! `Date`: a day of the Gregorian calendar, as ISO 8601 writes it.

use std::fmt;
use std::str::FromStr;

/// A day; ordered. Years 0001 to 9999.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Date {
    /// Days since 1970-01-01.
    day: i64,
}

impl Date {
    /// The day that holds a moment, seconds since 1970-01-01 UTC.
    pub fn of_unix_s(seconds: i64) -> Self {
        Self { day: seconds.div_euclid(86_400) }
    }

    /// The day of an acquisition date, which may have a time behind it; `None` where it is none.
    pub fn of_acquired(text: &str) -> Option<Self> {
        text.get(..10)?.parse().ok()
    }

    /// Days from `other` to this one; negative where this one is the earlier.
    pub fn days_since(self, other: Self) -> i64 {
        self.day - other.day
    }
}

impl FromStr for Date {
    type Err = String;

    /// `YYYY-MM-DD`, a day that exists.
    fn from_str(text: &str) -> Result<Self, String> {
        let refuse = || format!("{text:?} is no date: write YYYY-MM-DD");
        let bytes = text.as_bytes();
        if bytes.len() != 10 || bytes[4] != b'-' || bytes[7] != b'-' {
            return Err(refuse());
        }
        let number = |range: std::ops::Range<usize>| {
            let digits = text.get(range).filter(|d| d.bytes().all(|b| b.is_ascii_digit()));
            digits.and_then(|d| d.parse::<i64>().ok()).ok_or_else(refuse)
        };
        let (year, month, day) = (number(0..4)?, number(5..7)?, number(8..10)?);
        let date = Self { day: days_from_civil(year, month, day) };
        // A day that does not exist is another one when it is written back.
        if year >= 1 && (1..=12).contains(&month) && date.to_string() == text { Ok(date) } else { Err(refuse()) }
    }
}

impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (year, month, day) = civil_from_days(self.day);
        write!(f, "{year:04}-{month:02}-{day:02}")
    }
}

/// Days since 1970-01-01 of a day of the proleptic Gregorian calendar.
///
/// # References
/// H. Hinnant, chrono-compatible low-level date algorithms, days_from_civil.
fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let of_era = year.rem_euclid(400);
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

/// The inverse of [`days_from_civil`].
fn civil_from_days(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468;
    let era = days.div_euclid(146_097);
    let of_era = days.rem_euclid(146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * of_year + 2) / 153;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    (year, month, of_year - (153 * shifted + 2) / 5 + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_days_as_the_calendar_does() {
        let date = |text: &str| text.parse::<Date>().unwrap();
        // `date -ud 2026-11-22 +%s` is 1795305600.
        assert_eq!(date("2026-11-22"), Date::of_unix_s(1_795_305_600));
        assert_eq!(date("2026-11-22"), Date::of_unix_s(1_795_305_600 + 86_399));
        assert_eq!(date("2000-03-01").days_since(date("2000-02-28")), 2);
        assert_eq!(date("1900-03-01").days_since(date("1900-02-28")), 1);
        assert_eq!(date("1970-01-01").days_since(date("1969-12-31")), 1);
        for day in (-700_000..2_900_000).step_by(97) {
            let date = Date { day };
            assert_eq!(date.to_string().parse::<Date>(), Ok(date));
        }
    }

    #[test]
    fn refuses_days_that_do_not_exist() {
        for text in [
            "",
            "2026-11-31",
            "2026-13-01",
            "2026-00-10",
            "2025-02-29",
            "0000-01-01",
            "26-01-01",
            "2026-1-01",
            "2026-01-01T",
            "２026-01-0",
        ] {
            assert!(text.parse::<Date>().is_err(), "{text}");
        }
        assert!("2024-02-29".parse::<Date>().is_ok());
        assert_eq!(Date::of_acquired("2018-07-16T10:00:00Z"), "2018-07-16".parse().ok());
    }
}
