//! `FlyOutcome`: one image of a replayed flight, compared with the truth.

use crate::trial::integrity_score::ProtectedError;
use crate::trial::recorded_flight::RecordedFrame;
use overfly_core::geodesy::{Enu, Geodetic, LocalFrame};
use overfly_flight::navigate::Position;

/// One image of a replayed flight.
#[derive(Debug, Clone)]
pub struct FlyOutcome {
    /// Name in `flight.csv`.
    pub image: String,
    /// The position that navigation gives.
    pub position: Position,
    /// The true position.
    pub truth: Geodetic,
    /// Position minus truth, metres.
    pub error: Enu,
    /// Error of the fix that was begun at this image, metres; `None` without one.
    pub fix_error_m: Option<f64>,
    /// Whether the image shows nothing of the ground.
    pub is_hidden: bool,
}

impl FlyOutcome {
    /// The error of each position with its protection level.
    pub fn protected_errors(outcomes: &[Self], integrity_risk: f64) -> Vec<ProtectedError> {
        let of = |o: &Self| ProtectedError {
            error_m: o.error.length_m(),
            protection_level_m: o.position.protection_level_m(integrity_risk),
        };
        outcomes.iter().map(of).collect()
    }

    /// Compares a position, and the fix that belongs to it, with the truth.
    pub fn new(frame: &RecordedFrame, position: Position, truth: Geodetic, is_hidden: bool) -> Self {
        let here = LocalFrame::at(truth);
        let error = here.enu_from_geodetic(position.position);
        let fix_error_m = position.fix.as_ref().map(|fix| here.enu_from_geodetic(fix.position).length_m());
        Self { image: frame.image.clone(), position, truth, error, fix_error_m, is_hidden }
    }
}
