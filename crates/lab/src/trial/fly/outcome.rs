//! `FlyOutcome`: one image of a replayed flight, compared with the truth.

use crate::trial::recorded_flight::RecordedFrame;
use overfly_core::geodesy::{Enu, Geodetic, LocalFrame};
use overfly_flight::navigate::Position;

/// One image of a replayed flight.
#[derive(Debug, Clone)]
pub struct FlyOutcome {
    /// As `flight.csv` names it.
    pub image: String,
    /// Where it was put.
    pub position: Position,
    /// Where it was.
    pub truth: Geodetic,
    /// Less truth, metres.
    pub error: Enu,
    /// How far the fix begun at this image is from its truth, metres; `None` without one.
    pub fix_error_m: Option<f64>,
    /// Whether the image showed nothing.
    pub is_hidden: bool,
}

impl FlyOutcome {
    /// Compares a position, and the fix that belongs to it, with the truth.
    pub fn new(frame: &RecordedFrame, position: Position, truth: Geodetic, is_hidden: bool) -> Self {
        let here = LocalFrame::at(truth);
        let error = here.enu_from_geodetic(position.position);
        let fix_error_m = position.fix.as_ref().and_then(|fix| {
            let at = Geodetic::from_degrees(fix.latitude_deg, fix.longitude_deg).ok()?;
            Some(here.enu_from_geodetic(at).length_m())
        });
        Self { image: frame.image.clone(), position, truth, error, fix_error_m, is_hidden }
    }
}
