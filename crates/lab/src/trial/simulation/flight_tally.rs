//! `FlightTally`: what one flight came to.

use overfly_core::geodesy::CHI_SQUARE_95;

/// What one flight came to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FlightTally {
    /// Absolute registrations that ended within the mission.
    pub absolute_count: u64,
    /// Of them, those that failed, for any of the three reasons.
    pub failures: u64,
    /// By what is drawn.
    pub drawn: u64,
    /// The image was not where it was searched.
    pub outside_region: u64,
    /// The map does not show it.
    pub no_map: u64,
    /// Failures that gave a wrong position instead of none.
    pub false_fixes: u64,
    /// Absolute registrations whose predecessor had failed, and of them the failures.
    pub after_failure: [u64; 2],
    /// End of the first failure, seconds since the start.
    pub first_failure_s: Option<f64>,
    /// Sum of t_exe, seconds.
    pub execution_s: f64,
    /// t_exe of the last one, seconds.
    pub last_execution_s: Option<f64>,
    /// Sum of 𝒩: images' worth of map read.
    pub nominal_count: f64,
    /// Whether searches left the range from which they settle.
    pub is_lost: bool,
    /// What became of the estimate beside it.
    pub track: Option<Box<TrackTally>>,
}

/// Moments of a mission at which estimates are looked at.
pub const CHECKPOINTS: usize = 24;

/// What became of one flight's estimate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrackTally {
    /// Images.
    pub images: u64,
    /// Of them, those whose truth lies in the estimate's own 95 % ellipse.
    pub covered: u64,
    /// Normalised squared error at one image, at a moment drawn.
    pub nees: Option<f64>,
    /// Error there, metres.
    pub error_m: Option<f64>,
    /// Whether the ellipse holds the truth at the first image after each of [`CHECKPOINTS`] even moments.
    pub checkpoints: [Option<bool>; CHECKPOINTS],
}

impl TrackTally {
    /// Whether a squared error in standard deviations lies in the 95 % ellipse.
    pub fn holds(nees: f64) -> bool {
        nees <= CHI_SQUARE_95
    }
}

/// Why an absolute registration gave no right position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureCause {
    /// Drawn.
    Drawn,
    /// The image is not where it is searched.
    OutsideRegion,
    /// The map does not show it.
    NoMap,
}

impl FlightTally {
    /// Counts an absolute registration that ended at `end_s`.
    pub fn count(
        &mut self,
        cause: Option<FailureCause>,
        execution_s: f64,
        nominal_count: f64,
        end_s: f64,
        after_failure: bool,
    ) {
        self.absolute_count += 1;
        self.execution_s += execution_s;
        self.last_execution_s = Some(execution_s);
        self.nominal_count += nominal_count;
        let failed = u64::from(cause.is_some());
        if after_failure {
            self.after_failure[0] += 1;
            self.after_failure[1] += failed;
        }
        self.failures += failed;
        match cause {
            None => return,
            Some(FailureCause::Drawn) => self.drawn += 1,
            Some(FailureCause::OutsideRegion) => self.outside_region += 1,
            Some(FailureCause::NoMap) => self.no_map += 1,
        }
        self.first_failure_s = self.first_failure_s.or(Some(end_s));
    }
}
