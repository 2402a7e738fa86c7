//! Dates as stores, manifests and command lines write them: `YYYY-MM-DD`, days of the Gregorian calendar.

use jiff::Timestamp;
use jiff::civil::Date;
use jiff::tz::Offset;

/// Parses `YYYY-MM-DD`: four, two and two digits, a day that exists, years 0001 to 9999.
///
/// # Errors
/// Where the text is anything else, including other forms of ISO 8601.
///
/// # Example
/// ```
/// use overfly_store::package::parse_date;
///
/// assert_eq!(parse_date("2024-02-29"), Ok(jiff::civil::date(2024, 2, 29)));
/// assert!(parse_date("2025-02-29").is_err());
/// ```
pub fn parse_date(text: &str) -> Result<Date, String> {
    let refuse = || format!("{text:?} is not a date: write YYYY-MM-DD");
    let bytes = text.as_bytes();
    if bytes.len() != 10 || bytes[4] != b'-' || bytes[7] != b'-' {
        return Err(refuse());
    }
    let number = |range: std::ops::Range<usize>| {
        let digits = text.get(range).filter(|d| d.bytes().all(|b| b.is_ascii_digit()));
        digits.and_then(|d| d.parse::<i16>().ok()).ok_or_else(refuse)
    };
    let (year, month, day) = (number(0..4)?, number(5..7)?, number(8..10)?);
    if year < 1 {
        return Err(refuse());
    }
    // Both have two digits.
    Date::new(year, month as i8, day as i8).map_err(|_| refuse())
}

/// Returns the day of an acquisition date, which may be followed by a time: `None` if the text does not begin with a date.
pub fn acquisition_day(text: &str) -> Option<Date> {
    parse_date(text.get(..10)?).ok()
}

/// Returns the UTC day of a moment, seconds since 1970-01-01 UTC. A moment that jiff cannot represent gives its nearest day, at
/// most 9999-12-30.
pub fn utc_day(unix_s: i64) -> Date {
    let moment = Timestamp::from_second(unix_s).unwrap_or(if unix_s < 0 { Timestamp::MIN } else { Timestamp::MAX });
    Offset::UTC.to_datetime(moment).date()
}

/// Returns the days from `earlier` to `later`: negative if `later` is the earlier day.
pub fn days_between(earlier: Date, later: Date) -> i64 {
    later.duration_since(earlier).as_hours() / 24
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_days_as_the_calendar_does() {
        let date = |text: &str| parse_date(text).unwrap();
        // `date -ud 2026-11-22 +%s` is 1795305600.
        assert_eq!(date("2026-11-22"), utc_day(1_795_305_600));
        assert_eq!(date("2026-11-22"), utc_day(1_795_305_600 + 86_399));
        assert_eq!(days_between(date("2000-02-28"), date("2000-03-01")), 2);
        assert_eq!(days_between(date("1900-02-28"), date("1900-03-01")), 1);
        assert_eq!(days_between(date("1969-12-31"), date("1970-01-01")), 1);
        assert_eq!(days_between(date("9999-12-31"), date("0001-01-01")), -3_652_058);
        for day in (-700_000..2_900_000).step_by(97) {
            let date = utc_day(day * 86_400);
            assert_eq!(parse_date(&date.to_string()), Ok(date));
        }
    }

    #[test]
    fn moments_out_of_range_give_the_nearest_day() {
        assert_eq!(utc_day(i64::MAX), jiff::civil::date(9999, 12, 30));
        assert_eq!(utc_day(-1), jiff::civil::date(1969, 12, 31));
    }

    #[test]
    fn rejects_days_that_do_not_exist() {
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
            assert!(parse_date(text).is_err(), "{text}");
        }
        assert!(parse_date("2024-02-29").is_ok());
        assert_eq!(acquisition_day("2018-07-16T10:00:00Z"), parse_date("2018-07-16").ok());
    }
}
