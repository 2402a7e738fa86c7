//! `FlightTally`: the counts of one simulated flight.

use overfly_core::geodesy::CHI_SQUARE_95;

/// The counts of one simulated flight.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FlightTally {
    /// Absolute registrations that ended within the mission.
    pub absolute_count: u64,
    /// Absolute registrations that failed, for any of the three reasons.
    pub failures: u64,
    /// Failures that were drawn.
    pub drawn: u64,
    /// Failures because the image lay outside the searched region.
    pub outside_region: u64,
    /// The map does not show the image.
    pub no_map: u64,
    /// Failures with a wrong position instead of none.
    pub false_fixes: u64,
    /// Absolute registrations after a failed one, and the failures among them.
    pub after_failure: [u64; 2],
    /// End of the first failure, seconds since the start.
    pub first_failure_s: Option<f64>,
    /// Sum of t_exe, seconds.
    pub execution_s: f64,
    /// t_exe of the last one, seconds.
    pub last_execution_s: Option<f64>,
    /// Sum of 𝒩: the map that was read, in images.
    pub nominal_count: f64,
    /// Whether searches left the range in which they settle.
    pub is_lost: bool,
    /// The counts of the filter beside the flight.
    pub track: Option<Box<TrackTally>>,
}

/// Number of moments of a mission at which filters are compared with the truth.
pub const CHECKPOINTS: usize = 24;

/// The counts of the filter of one flight.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrackTally {
    /// Number of images.
    pub images: u64,
    /// Images at which the filter's own 95 % ellipse contains the truth.
    pub covered: u64,
    /// Normalised estimation error squared (NEES) at one image, at a random moment.
    pub nees: Option<f64>,
    /// Error at that image, metres.
    pub error_m: Option<f64>,
    /// Whether the ellipse contains the truth at the first image after each of [`CHECKPOINTS`] evenly spaced moments.
    pub checkpoints: [Option<bool>; CHECKPOINTS],
}

impl TrackTally {
    /// Whether a NEES lies in the 95 % ellipse.
    pub fn holds(nees: f64) -> bool {
        nees <= CHI_SQUARE_95
    }
}

/// The reason why an absolute registration failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureCause {
    /// The failure was drawn.
    Drawn,
    /// The image lies outside the searched region.
    OutsideRegion,
    /// The map does not show the image.
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
