//! What a flight is navigated by.

use super::{Clock, SensorSigmas};

/// How relative and absolute registration are coupled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// So many relative registrations, then an absolute one, for which they wait.
    Sequential,
    /// Both at once: an absolute registration's result is carried forward by the relative ones made meanwhile.
    Parallel,
    /// Absolute registrations alone, each searching all that the aircraft can have reached since the last.
    Combined,
    /// Whichever of these the execution times and the last answers speak for, image by image.
    Auto,
    /// Relative registrations alone, from the start on: dead reckoning, to compare with.
    RelativeOnly,
}

impl Mode {
    /// The modes that `all` means.
    pub const ALL: [Self; 4] = [Self::Sequential, Self::Parallel, Self::Combined, Self::Auto];

    /// As JSON and the command line spell it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Sequential => "sequential",
            Self::Parallel => "parallel",
            Self::Combined => "combined",
            Self::Auto => "auto",
            Self::RelativeOnly => "relative_only",
        }
    }
}

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
