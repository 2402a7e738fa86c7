//! `ReplayedFlight`: a flight replayed in one mode, as its page shows it.

use crate::trial::{FlyOutcome, FlyScore};
use overfly_flight::navigate::ExecutionTimes;

/// A flight replayed in one mode.
pub struct ReplayedFlight<'a> {
    /// The result of each image.
    pub outcomes: &'a [FlyOutcome],
    /// The score.
    pub score: &'a FlyScore,
    /// Execution times.
    pub execution_times: ExecutionTimes,
}
