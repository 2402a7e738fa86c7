//! `Velocity`: how the aircraft moved last, to carry a position over where no image tells.

use super::{Estimate, NavigateOptions, Sensed};
use crate::geodesy::{Enu, LocalFrame};

/// Speed over ground and the angle of the course off the heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocity {
    speed_mps: f64,
    speed_sigma_mps: f64,
    /// Course less heading, radians.
    drift_angle_rad: f64,
}

/// A speed that was seen holds to this share of it from image to image.
const SPEED_SHARE: f64 = 0.05;

impl Velocity {
    /// Before anything was seen.
    pub fn stated(options: &NavigateOptions) -> Self {
        Self { speed_mps: options.speed_mps, speed_sigma_mps: options.speed_sigma_mps, drift_angle_rad: 0.0 }
    }

    /// Between two places and the times between them.
    pub fn seen(from: &Estimate, to: &Estimate, elapsed_s: f64) -> Option<Self> {
        let moved = LocalFrame::at(from.position()).enu_from_geodetic(to.position());
        let [[ee, _], [_, nn]] = to.position_covariance_m2();
        let speed_mps = moved.length_m() / elapsed_s;
        let is_told = elapsed_s > 0.0 && moved.length_m() > 4.0 * ((ee + nn) / 2.0).sqrt();
        is_told.then(|| Self {
            speed_mps,
            speed_sigma_mps: SPEED_SHARE * speed_mps,
            drift_angle_rad: moved.east_m.atan2(moved.north_m) - half_way(from.heading_rad(), to.heading_rad()),
        })
    }

    /// Where it leads from an estimate in a time, by the heading half-way, and one standard deviation per axis: speed may
    /// change, and the aircraft may turn as tightly as it can, but the compass shows how far round.
    pub fn lead(&self, from: &Estimate, sensed: Sensed, elapsed_s: f64, min_turn_radius_m: f64) -> (Enu, f64) {
        let length_m = self.speed_mps * elapsed_s;
        let course =
            half_way(from.heading_rad(), sensed.heading_rad - from.compass_offset_rad()) + self.drift_angle_rad;
        let moved = Enu { east_m: length_m * course.sin(), north_m: length_m * course.cos() };
        // An arc's sagitta, at most as wide as the way is long.
        let sideways_m = (length_m.powi(2) / (8.0 * min_turn_radius_m)).min(length_m / 2.0);
        let sigma_m = (self.speed_sigma_mps * elapsed_s).hypot(sideways_m).max(1.0);
        (moved, sigma_m)
    }
}

/// The heading half-way between two, by the shorter turn.
fn half_way(a_rad: f64, b_rad: f64) -> f64 {
    let (sin, cos) = (a_rad.sin() + b_rad.sin(), a_rad.cos() + b_rad.cos());
    if sin.hypot(cos) < 1e-6 { a_rad } else { sin.atan2(cos) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_way_crosses_north() {
        let found = half_way(350f64.to_radians(), 20f64.to_radians());
        assert!((found - 5f64.to_radians()).abs() < 1e-12);
    }
}
