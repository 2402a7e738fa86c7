//! The current date.

use overfly_store::package::{Date, utc_day};
use std::time::{SystemTime, UNIX_EPOCH};

/// The current date by the system's clock, UTC. A clock before 1970 counts as 1970-01-01.
pub fn today() -> Date {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    utc_day(i64::try_from(since.as_secs()).unwrap_or(i64::MAX))
}
