//! `Scenario`: one set of parameters of a simulation, as a table of `sim.toml`.

use overfly_core::coupling::Mode;
use overfly_core::coupling::{CouplingParameters, DriftGrowth};
use serde::{Deserialize, Deserializer};
use std::path::PathBuf;

/// One set of parameters. [`check`](Scenario::check) tells whether the models accept it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// The modes to fly in.
    #[serde(deserialize_with = "modes")]
    pub modes: Vec<Mode>,
    /// Flights of each mode.
    pub runs: u32,
    /// Seed of everything random.
    #[serde(default = "one")]
    pub seed: u64,
    /// T0, seconds; `None`: T0_max of (16).
    pub mission_s: Option<f64>,
    /// Time since the image of the last fix at the start, seconds; `None`: a random moment, as in the middle of a
    /// flight.
    pub without_fix_s: Option<f64>,
    /// The aircraft.
    pub aircraft: AircraftModel,
    /// The errors of registrations.
    pub errors: ErrorModel,
    /// The cost of registrations.
    pub execution: ExecutionModel,
    /// How absolute registrations fail.
    #[serde(default)]
    pub failures: FailureModel,
    /// The parameters of the sequential mode.
    #[serde(default)]
    pub sequential: SequentialModel,
    /// A store to fly over; `None`: an endless map, searched by equation 3.
    pub store: Option<StoreModel>,
    /// The sensors of a `navigate::NavigationFilter` beside the flights; `None`: no filter.
    pub covariance: Option<CovarianceModel>,
}

/// The aircraft and the footprint of its images.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AircraftModel {
    /// v, m/s.
    pub speed_mps: f64,
    /// a, metres.
    pub across_m: f64,
    /// b, metres.
    pub along_m: f64,
    /// R_min, metres.
    #[serde(default = "infinite")]
    pub min_turn_radius_m: f64,
    /// Time between images, seconds; 0: an image is taken when it is needed, as in the paper.
    #[serde(default)]
    pub image_interval_s: f64,
}

/// The errors of registrations, and the errors that the search assumes.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorModel {
    /// I, full width, metres: the error of a fix is uniform, up to half of I along and across.
    pub inaccuracy_m: f64,
    /// D_U, metres.
    pub unit_drift_m: f64,
    /// How drift adds up in the search's assumption.
    #[serde(default)]
    pub drift_growth: DriftGrowth,
    /// How drift really adds up.
    #[serde(default)]
    pub drift: DrawnDrift,
    /// For independent drift: D_U in standard deviations of one registration, per axis.
    #[serde(default = "three")]
    pub drift_sigmas: f64,
}

/// How relative registrations drift.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DrawnDrift {
    /// After each fix one error per axis, uniform within D_U, which every registration repeats: (2) is then the
    /// bound.
    #[default]
    Bias,
    /// An independent normal error for each registration.
    Independent,
}

/// The cost of registrations.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExecutionModel {
    /// t0, seconds.
    pub relative_s: f64,
    /// K1, seconds per image of map.
    pub seconds_per_tile: f64,
    /// The part of t_exe that does not grow with the map, seconds.
    #[serde(default)]
    pub constant_s: f64,
}

/// How absolute registrations fail.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FailureModel {
    /// The law of failures.
    pub law: FailureLaw,
    /// p of `constant`; for `per_image`, the probability for each image of map.
    pub probability: Option<f64>,
    /// The consequence of a failure.
    pub after: AfterFailure,
    /// Share of the failures with a wrong position instead of none.
    pub false_share: f64,
}

impl Default for FailureModel {
    fn default() -> Self {
        Self { law: FailureLaw::Overlap, probability: None, after: AfterFailure::Afresh, false_share: 0.0 }
    }
}

/// The law of the failure probability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureLaw {
    /// Equations 5 and 6, in the sequential mode: the ground that the next relative registration needs has left the
    /// image. The other modes do not wait for a search, and have no drawn failures.
    Overlap,
    /// The same probability for all.
    Constant,
    /// 1 - (1 - probability)^𝒩: each image of map can contain a false match.
    PerImage,
}

/// The consequence of a failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AfterFailure {
    /// As after a fix: all registrations are alike and independent, as (1) to (16) count them.
    Afresh,
    /// The next cycle; drift and region continue to grow.
    NextCycle,
    /// One relative registration, then another search; drift and region continue to grow.
    Retry,
}

/// The parameters of the sequential mode.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SequentialModel {
    /// n; `None`: the best whole number (13).
    pub relative_count: Option<u64>,
}

/// A store to fly over: a search reads its tiles, and fails where the store has none.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoreModel {
    /// The file, relative to `sim.toml`; `None`: named by the command.
    pub path: Option<PathBuf>,
    /// The layer; `None`: the only one, or `ortho`.
    pub layer: Option<String>,
    /// Least share of the image that the map must show for a fix.
    #[serde(default = "half")]
    pub least_covered: f64,
    /// Distance beyond the bounds of the layer's tiles within which waypoints may lie, metres; negative: inside the
    /// bounds.
    #[serde(default)]
    pub beyond_m: f64,
}

/// The sensors of the simulated aircraft for `navigate::NavigationFilter`. One standard deviation each.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CovarianceModel {
    /// Number of the flights with a filter.
    pub runs: u32,
    /// Above ground, metres.
    pub height_m: f64,
    /// Constant error of the compass, degrees.
    pub heading_offset_deg: f64,
    /// Independent error of the compass at each image, degrees.
    pub heading_noise_deg: f64,
    /// Constant error of the altimeter, as a ratio.
    pub height_offset_ratio: f64,
    /// Independent error of the altimeter at each image, as a ratio.
    pub height_noise_ratio: f64,
    /// Turn of a relative registration, degrees.
    pub turn_noise_deg: f64,
    /// Climb of a relative registration, as a ratio of the height.
    pub climb_noise_ratio: f64,
    /// Start, per axis, metres.
    pub start_sigma_m: f64,
    /// Fix, per axis, metres.
    pub fix_sigma_m: f64,
    /// Share of the variance of a fix that all fixes of a flight have in common, like the map's own error.
    #[serde(default = "whole")]
    pub fix_common_share: f64,
    /// Heading of a fix, degrees.
    pub fix_heading_deg: f64,
    /// Scale of a fix, as a ratio.
    pub fix_scale_ratio: f64,
    /// Ratio of the standard deviations stated to the filter (steps and fixes) to the true ones. With any value but 1
    /// the check must fail.
    #[serde(default = "whole")]
    pub stated_ratio: f64,
}

impl Scenario {
    /// The parameters of the models.
    pub fn parameters(&self) -> CouplingParameters {
        CouplingParameters {
            across_m: self.aircraft.across_m,
            along_m: self.aircraft.along_m,
            inaccuracy_m: self.errors.inaccuracy_m,
            unit_drift_m: self.errors.unit_drift_m,
            drift_growth: self.errors.drift_growth,
            seconds_per_tile: self.execution.seconds_per_tile,
            search_constant_s: self.execution.constant_s,
            relative_s: self.execution.relative_s,
            speed_mps: self.aircraft.speed_mps,
            min_turn_radius_m: self.aircraft.min_turn_radius_m,
            failure_probability: match self.failures.law {
                FailureLaw::Constant => self.failures.probability,
                FailureLaw::Overlap | FailureLaw::PerImage => None,
            },
        }
    }

    /// Time from one relative registration to the next, seconds: t0, or the whole image intervals that it takes.
    pub fn step_s(&self) -> f64 {
        whole_intervals(self.execution.relative_s, self.aircraft.image_interval_s)
    }
}

/// `elapsed_s` or, if images come at intervals, the time until the first image at or after it.
pub fn whole_intervals(elapsed_s: f64, interval_s: f64) -> f64 {
    // A rounding error must not add an interval.
    if interval_s > 0.0 { (elapsed_s / interval_s - 1e-9).ceil().max(0.0) * interval_s } else { elapsed_s }
}

/// The modes that are simulated. `auto` is not: it depends on images.
const MODES: [Mode; 4] = [Mode::Sequential, Mode::Parallel, Mode::Combined, Mode::RelativeOnly];

fn modes<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Mode>, D::Error> {
    let words = Vec::<String>::deserialize(from)?;
    let find = |word: &String| {
        MODES.into_iter().find(|mode| mode.word() == word).ok_or_else(|| {
            let known = MODES.map(Mode::word).join(", ");
            serde::de::Error::custom(format!("modes: {word:?} is none of {known}"))
        })
    };
    words.iter().map(find).collect()
}

fn one() -> u64 {
    1
}

fn infinite() -> f64 {
    f64::INFINITY
}

fn three() -> f64 {
    3.0
}

fn half() -> f64 {
    0.5
}

fn whole() -> f64 {
    1.0
}
