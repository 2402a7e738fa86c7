//! `ReplayedFlight`: a flight replayed in one mode, as its page shows it.

use crate::trial::{FlyOutcome, FlyScore, ProtectedError};
use overfly_flight::navigate::ExecutionTimes;

/// A flight replayed in one mode.
pub struct ReplayedFlight<'a> {
    /// The result of each image.
    pub outcomes: &'a [FlyOutcome],
    /// The score.
    pub score: &'a FlyScore,
    /// The error of each position with its protection level.
    pub protected: Vec<ProtectedError>,
    /// Execution times.
    pub execution_times: ExecutionTimes,
}
