//! `Velocity`: the last known velocity, for dead reckoning between images that cannot be registered.

use super::filter::NavigationFilter;
use super::flight_limits::{Manoeuvre, is_possible_speed, max_velocity_change_mps};
use super::measurements::{OdometryStep, SensorReading};
use super::options::NavigateOptions;
use super::time_update::TimeUpdate;
use overfly_core::geodesy::{BodyFrame, BodyOffset, Enu, EnuCovariance, LocalFrame, wrap_turn_rad};

/// Speed over ground and drift angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocity {
    speed_mps: f64,
    speed_sigma_mps: f64,
    /// Drift angle: course minus heading, radians.
    drift_angle_rad: f64,
    /// Whether a registration measured it; else it is the stated one.
    is_measured: bool,
    /// Images reckoned over since the velocity was measured, and their time, seconds.
    images_reckoned: u32,
    reckoned_s: f64,
}

/// One standard deviation of a measured speed, as a share of the speed.
const SPEED_SIGMA_SHARE: f64 = 0.05;
/// Where the heading turns by more than this between two positions, the chord does not measure the drift angle.
const STRAIGHT_RAD: f64 = 0.05;
/// Where the heading turns by more than this, the chord does not measure the speed either.
const MAX_TURN_RAD: f64 = 0.6;
/// The gate on a measured velocity, in standard deviations, beyond what the aircraft can change it by.
const GATE_SIGMAS: f64 = 4.0;

impl Velocity {
    /// The velocity stated before the flight, without drift.
    pub fn new(options: &NavigateOptions) -> Self {
        Self {
            speed_mps: options.speed_mps,
            speed_sigma_mps: options.speed_sigma_mps,
            drift_angle_rad: 0.0,
            is_measured: false,
            images_reckoned: 0,
            reckoned_s: 0.0,
        }
    }

    /// Speed over ground, m/s.
    pub fn speed_mps(self) -> f64 {
        self.speed_mps
    }

    /// The least distance that the aircraft has moved in a time, metres: 0 while no registration has measured the velocity.
    pub fn least_distance_m(self, elapsed_s: f64) -> f64 {
        let change_mps = max_velocity_change_mps(elapsed_s + self.reckoned_s) + GATE_SIGMAS * self.speed_sigma_mps;
        if self.is_measured { elapsed_s * (self.speed_mps - change_mps).max(0.0) } else { 0.0 }
    }

    /// How far a step leads from where the velocity leads, metres, where no aircraft can fly it; `None` where one can.
    /// `sway_m`: one standard deviation of what changes of the attitude's error add to the step.
    pub fn contradiction_m(
        self,
        from: &NavigationFilter,
        step: &OdometryStep,
        elapsed_s: f64,
        sway_m: f64,
    ) -> Option<f64> {
        let [right_m, ahead_m] = step.per_height.map(|v| v * from.height_m());
        let heading_rad = from.heading().radians();
        let moved = BodyFrame::from_heading_rad(heading_rad).enu_from_body(BodyOffset { right_m, ahead_m });
        let expected = self.displacement(heading_rad, heading_rad + step.turn_rad, elapsed_s);
        let off_m = (moved.east_m - expected.east_m).hypot(moved.north_m - expected.north_m);
        // The stated velocity is no measurement: any possible speed may turn out to be the true one.
        let is_flyable = is_possible_speed(moved.length_m() / elapsed_s)
            && (!self.is_measured || off_m <= self.allowance_m(from, elapsed_s) + GATE_SIGMAS * sway_m);
        (!is_flyable).then_some(off_m)
    }

    /// How far a displacement may be from where the velocity leads, metres.
    fn allowance_m(self, from: &NavigationFilter, elapsed_s: f64) -> f64 {
        let scale = from.heading_sigma_rad().hypot(from.height_sigma_ratio());
        let sigma_mps = self.speed_sigma_mps.hypot(self.speed_mps * scale);
        elapsed_s * (max_velocity_change_mps(elapsed_s + self.reckoned_s) + GATE_SIGMAS * sigma_mps)
    }

    /// The displacement in a time at the mean of two headings.
    fn displacement(self, from_rad: f64, to_rad: f64, elapsed_s: f64) -> Enu {
        let length_m = self.speed_mps * elapsed_s;
        let course = mean_heading(from_rad, to_rad) + self.drift_angle_rad;
        Enu { east_m: length_m * course.sin(), north_m: length_m * course.cos() }
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
            is_measured: true,
            images_reckoned: 0,
            reckoned_s: 0.0,
        }
    }

    /// The time update of dead reckoning. The course follows the mean of the two headings; where there is no reading, the last
    /// heading. Errors of speed and drift angle persist from image to image, so the total error grows with the distance. The
    /// aircraft may turn as tightly as it can, but the compass shows by how much.
    pub fn dead_reckon(
        &mut self,
        from: &NavigationFilter,
        reading: SensorReading,
        elapsed_s: f64,
        options: &NavigateOptions,
    ) -> TimeUpdate {
        let length_m = self.speed_mps * elapsed_s;
        let heading_rad = from.heading().radians();
        let read_rad = reading.heading_rad - from.compass_offset_rad();
        let displacement =
            self.displacement(heading_rad, if read_rad.is_finite() { read_rad } else { heading_rad }, elapsed_s);
        let unseen = Manoeuvre::largest(options, self.speed_mps, from.height_m(), elapsed_s);
        // The sagitta of the tightest arc, at most half the distance; without a compass the chord of the arc turns too.
        let sideways_m = (length_m.powi(2) / (8.0 * options.min_turn_radius_m)).min(length_m / 2.0);
        let unseen_m = if read_rad.is_finite() { 0.0 } else { length_m * (unseen.turn_rad / 2.0).min(1.0) };
        self.images_reckoned += 1;
        self.reckoned_s += elapsed_s;
        // After k images the error is k times that of one image: its square grows by 2 k - 1 times the square of one.
        let persistent_m = self.speed_sigma_mps * elapsed_s * f64::from(2 * self.images_reckoned - 1).sqrt();
        let sigma_m = persistent_m.hypot(sideways_m).hypot(unseen_m).max(1.0);
        TimeUpdate::DeadReckoning { displacement, sigma_m, reading, unseen }
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
