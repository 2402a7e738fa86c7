//! What an aircraft can fly: how far it turns, climbs and changes its velocity between two images.
//!
//! A motion that no aircraft can fly is a fault of the camera, of the clock or of the registration, and no measurement.

use super::options::NavigateOptions;

/// Largest speed of an aircraft over ground, m/s.
const MAX_SPEED_MPS: f64 = 300.0;
/// Largest acceleration along the track, and of the wind that an aircraft meets, m/s^2.
const MAX_ACCELERATION_MPS2: f64 = 3.0;
/// Largest change of the velocity within [`CHANGE_TIME_S`], m/s.
const MAX_VELOCITY_CHANGE_MPS: f64 = 12.0;
/// After a longer time the velocity can have changed in proportion, seconds.
const CHANGE_TIME_S: f64 = 30.0;
/// Largest rate of climb or descent, m/s.
const MAX_CLIMB_MPS: f64 = 10.0;
/// Turns are flown with at least this share of the stated smallest radius.
const RADIUS_SHARE: f64 = 0.5;

/// A turn and a climb between two images.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Manoeuvre {
    /// Turn, radians.
    pub turn_rad: f64,
    /// Natural logarithm of the height afterwards over the height before.
    pub log_climb: f64,
}

impl Manoeuvre {
    /// The largest turn and climb in a time, at a speed and a height.
    pub fn largest(options: &NavigateOptions, speed_mps: f64, height_m: f64, elapsed_s: f64) -> Self {
        let turn_rad = speed_mps * elapsed_s / (RADIUS_SHARE * options.min_turn_radius_m);
        Self {
            turn_rad: turn_rad.min(std::f64::consts::PI),
            log_climb: (MAX_CLIMB_MPS * elapsed_s / height_m.max(1.0)).ln_1p(),
        }
    }
}

/// The largest change of velocity in a time, m/s.
pub fn max_velocity_change_mps(elapsed_s: f64) -> f64 {
    (MAX_ACCELERATION_MPS2 * elapsed_s).min(MAX_VELOCITY_CHANGE_MPS * (elapsed_s / CHANGE_TIME_S).max(1.0))
}

/// Whether any aircraft flies this fast.
pub fn is_possible_speed(speed_mps: f64) -> bool {
    speed_mps <= MAX_SPEED_MPS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_aircraft_neither_stops_nor_turns_back_between_two_images() {
        // 45 m/s, images every 4 s: it can become 12 m/s faster or slower, not 45 or 90.
        assert_eq!(max_velocity_change_mps(4.0), 12.0);
        assert_eq!(max_velocity_change_mps(10.0), 12.0);
        assert_eq!(max_velocity_change_mps(60.0), 24.0);
        let most = Manoeuvre::largest(&NavigateOptions::default(), 45.0, 500.0, 4.0);
        // 180 m on an arc of 250 m; 40 m up from 500 m.
        assert!((most.turn_rad - 0.72).abs() < 1e-12 && (most.log_climb - 1.08f64.ln()).abs() < 1e-12, "{most:?}");
        assert!(is_possible_speed(250.0) && !is_possible_speed(450.0));
    }
}
