//! `NavigateOptions`: everything that is stated before a flight.

use super::execution_times::ExecutionTimes;
use super::measurements::SensorSigmas;
use overfly_core::coupling::Mode;

/// The options of a [`super::Navigator`].
#[derive(Debug, Clone, PartialEq)]
pub struct NavigateOptions {
    /// Layer to search.
    pub layer: String,
    /// Coupling mode.
    pub mode: Mode,
    /// n: relative registrations between two absolute ones in the sequential mode.
    pub relative_count: usize,
    /// Error model of compass and altimeter.
    pub sensors: SensorSigmas,
    /// One standard deviation of the position at the start, per axis, metres.
    pub start_sigma_m: f64,
    /// Speed over ground until a registration measures it, m/s.
    pub speed_mps: f64,
    /// One standard deviation of [`NavigateOptions::speed_mps`], m/s.
    pub speed_sigma_mps: f64,
    /// R_min: smallest turn radius, metres.
    pub min_turn_radius_m: f64,
    /// Execution times of registrations.
    pub execution_times: ExecutionTimes,
    /// Whether places that one image cannot decide on are decided on by the images before.
    pub tracks: bool,
    /// Threads that one absolute registration may use.
    pub threads: usize,
}

impl Default for NavigateOptions {
    /// The options of a small aircraft with a magnetic compass and a barometer.
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
            execution_times: ExecutionTimes::default(),
            tracks: true,
            threads: 1,
        }
    }
}
