//! `Velocity`: how the aircraft moved last, to carry a position over where no image tells.

use super::{Estimate, NavigateOptions, Sensed};
use overfly_core::geodesy::{Enu, LocalFrame};
use std::f64::consts::{PI, TAU};

/// Speed over ground and the angle of the course off the heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocity {
    speed_mps: f64,
    speed_sigma_mps: f64,
    /// Course less heading, radians.
    drift_angle_rad: f64,
    /// Images that it has led over since it was seen.
    led: u32,
}

/// What was seen of speed and course, as a share of the way, one standard deviation per axis.
const SHARE: f64 = 0.05;
/// Between images that turn by more, the chord's course says little of the drift.
const STRAIGHT_RAD: f64 = 0.05;
/// Nor does the chord say how fast it was, where the heading turned by more than this.
const MOST_TURN_RAD: f64 = 0.6;

impl Velocity {
    /// Before anything was seen.
    pub fn stated(options: &NavigateOptions) -> Self {
        Self { speed_mps: options.speed_mps, speed_sigma_mps: options.speed_sigma_mps, drift_angle_rad: 0.0, led: 0 }
    }

    /// As it was between two places of a time apart; itself where these do not tell.
    pub fn seen(self, from: &Estimate, to: &Estimate, elapsed_s: f64) -> Self {
        let moved = LocalFrame::at(from.position()).enu_from_geodetic(to.position());
        let [[ee, _], [_, nn]] = to.position_covariance_m2();
        let turn = wrapped(to.heading_rad() - from.heading_rad()).abs();
        let is_told = elapsed_s > 0.0 && moved.length_m() > 4.0 * ((ee + nn) / 2.0).sqrt().min(50.0);
        if !is_told || turn > MOST_TURN_RAD {
            return self;
        }
        let speed_mps = moved.length_m() / elapsed_s;
        let course = moved.east_m.atan2(moved.north_m);
        let drift_angle_rad = wrapped(course - half_way(from.heading_rad(), to.heading_rad()));
        Self {
            speed_mps,
            speed_sigma_mps: SHARE * speed_mps,
            drift_angle_rad: if turn < STRAIGHT_RAD { drift_angle_rad } else { self.drift_angle_rad },
            led: 0,
        }
    }

    /// Where it leads from an estimate in a time, by the heading half-way, and one standard deviation per axis. What speed and
    /// drift are wrong by stays wrong from image to image, so that the whole error grows with the way; and the aircraft may turn as
    /// tightly as it can, but the compass shows how far round.
    pub fn lead(&mut self, from: &Estimate, sensed: Sensed, elapsed_s: f64, min_turn_radius_m: f64) -> (Enu, f64) {
        let length_m = self.speed_mps * elapsed_s;
        let course =
            half_way(from.heading_rad(), sensed.heading_rad - from.compass_offset_rad()) + self.drift_angle_rad;
        let moved = Enu { east_m: length_m * course.sin(), north_m: length_m * course.cos() };
        // An arc's sagitta, at most as wide as the way is long.
        let sideways_m = (length_m.powi(2) / (8.0 * min_turn_radius_m)).min(length_m / 2.0);
        self.led += 1;
        // After k images the error is k times the first one's: its square has grown by 2 k - 1 times that one's.
        let lasting_m = self.speed_sigma_mps * elapsed_s * f64::from(2 * self.led - 1).sqrt();
        (moved, lasting_m.hypot(sideways_m).max(1.0))
    }
}

/// In [-pi, pi).
fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
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
