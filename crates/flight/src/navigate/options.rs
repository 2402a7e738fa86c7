//! What a flight is navigated by.

use super::{Clock, SensorSigmas};
use overfly_core::coupling::Mode;

/// Everything that is stated before a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct NavigateOptions {
    /// Layer to search.
    pub layer: String,
    /// How to couple.
    pub mode: Mode,
    /// n: relative registrations between two absolute ones in the sequential mode.
    pub relative_count: usize,
    /// How far compass and altimeter are trusted.
    pub sensors: SensorSigmas,
    /// One standard deviation of the position at the start, per axis, metres.
    pub start_sigma_m: f64,
    /// Speed over ground where no registration has told it yet, m/s, and one standard deviation of it.
    pub speed_mps: f64,
    /// As [`NavigateOptions::speed_mps`].
    pub speed_sigma_mps: f64,
    /// R_min: smallest turn radius, metres.
    pub min_turn_radius_m: f64,
    /// Execution times.
    pub clock: Clock,
    /// Threads of one registration.
    pub threads: usize,
}

/// What `overfly fly` takes where nothing is stated: a small aircraft with a magnetic compass and a barometer.
impl Default for NavigateOptions {
    fn default() -> Self {
        Self {
            layer: "ortho".into(),
            mode: Mode::Auto,
            relative_count: 5,
            sensors: SensorSigmas {
                heading_offset_rad: 3f64.to_radians(),
                heading_noise_rad: 3f64.to_radians(),
                height_offset_ratio: 0.03,
                height_noise_ratio: 0.03,
            },
            start_sigma_m: 50.0,
            speed_mps: 40.0,
            speed_sigma_mps: 20.0,
            min_turn_radius_m: 500.0,
            clock: Clock::default(),
            threads: 1,
        }
    }
}
