//! `Velocity`: the last known velocity, for dead reckoning between images that cannot be registered.

use super::filter::NavigationFilter;
use super::measurements::SensorReading;
use super::options::NavigateOptions;
use overfly_core::geodesy::{Enu, EnuCovariance, LocalFrame, wrap_turn_rad};

/// Speed over ground and drift angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocity {
    speed_mps: f64,
    speed_sigma_mps: f64,
    /// Drift angle: course minus heading, radians.
    drift_angle_rad: f64,
    /// Images reckoned over since the velocity was measured.
    images_reckoned: u32,
}

/// One standard deviation of a measured speed, as a share of the speed.
const SPEED_SIGMA_SHARE: f64 = 0.05;
/// Where the heading turns by more than this between two positions, the chord does not measure the drift angle.
const STRAIGHT_RAD: f64 = 0.05;
/// Where the heading turns by more than this, the chord does not measure the speed either.
const MAX_TURN_RAD: f64 = 0.6;

impl Velocity {
    /// The velocity stated before the flight, without drift.
    pub fn new(options: &NavigateOptions) -> Self {
        Self {
            speed_mps: options.speed_mps,
            speed_sigma_mps: options.speed_sigma_mps,
            drift_angle_rad: 0.0,
            images_reckoned: 0,
        }
    }

    /// The velocity measured between two filter states; `self` where they are too close together or the aircraft turned.
    pub fn measured(self, from: &NavigationFilter, to: &NavigationFilter, elapsed_s: f64) -> Self {
        let moved = LocalFrame::at(from.position()).enu_from_geodetic(to.position());
        let EnuCovariance { ee_m2: ee, nn_m2: nn, .. } = to.position_covariance();
        let turn = wrap_turn_rad(to.heading().radians() - from.heading().radians()).abs();
        let is_measurable = elapsed_s > 0.0 && moved.length_m() > 4.0 * ((ee + nn) / 2.0).sqrt().min(50.0);
        if !is_measurable || turn > MAX_TURN_RAD {
            return self;
        }
        let speed_mps = moved.length_m() / elapsed_s;
        let course = moved.east_m.atan2(moved.north_m);
        let drift_angle_rad = wrap_turn_rad(course - mean_heading(from.heading().radians(), to.heading().radians()));
        Self {
            speed_mps,
            speed_sigma_mps: SPEED_SIGMA_SHARE * speed_mps,
            drift_angle_rad: if turn < STRAIGHT_RAD { drift_angle_rad } else { self.drift_angle_rad },
            images_reckoned: 0,
        }
    }

    /// The displacement that dead reckoning expects in a time, and one standard deviation per axis, metres. The course follows
    /// the mean of the two headings. Errors of speed and drift angle persist from image to image, so the total error grows
    /// with the distance. The aircraft may turn as tightly as it can, but the compass shows by how much.
    pub fn dead_reckon(
        &mut self,
        from: &NavigationFilter,
        reading: SensorReading,
        elapsed_s: f64,
        min_turn_radius_m: f64,
    ) -> (Enu, f64) {
        let length_m = self.speed_mps * elapsed_s;
        let course = mean_heading(from.heading().radians(), reading.heading_rad - from.compass_offset_rad())
            + self.drift_angle_rad;
        let moved = Enu { east_m: length_m * course.sin(), north_m: length_m * course.cos() };
        // The sagitta of the tightest arc, at most half the distance.
        let sideways_m = (length_m.powi(2) / (8.0 * min_turn_radius_m)).min(length_m / 2.0);
        self.images_reckoned += 1;
        // After k images the error is k times that of one image: its square grows by 2 k - 1 times the square of one.
        let persistent_m = self.speed_sigma_mps * elapsed_s * f64::from(2 * self.images_reckoned - 1).sqrt();
        (moved, persistent_m.hypot(sideways_m).max(1.0))
    }
}

/// The circular mean of two headings.
fn mean_heading(a_rad: f64, b_rad: f64) -> f64 {
    let (sin, cos) = (a_rad.sin() + b_rad.sin(), a_rad.cos() + b_rad.cos());
    if sin.hypot(cos) < 1e-6 { a_rad } else { sin.atan2(cos) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_heading_crosses_north() {
        let found = mean_heading(350f64.to_radians(), 20f64.to_radians());
        assert!((found - 5f64.to_radians()).abs() < 1e-12);
    }
}
