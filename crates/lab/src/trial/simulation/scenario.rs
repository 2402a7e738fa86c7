//! `Scenario`: one set of parameters of a simulation, as a table of `sim.toml`.

use overfly_core::coupling::Mode;
use overfly_core::coupling::{CouplingParameters, DriftGrowth};
use serde::{Deserialize, Deserializer};
use std::path::PathBuf;

/// One set of parameters. [`check`](Scenario::check) says whether the models speak of it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// The modes to fly in.
    #[serde(deserialize_with = "modes")]
    pub modes: Vec<Mode>,
    /// Flights of each mode.
    pub runs: u32,
    /// Of all that is drawn.
    #[serde(default = "one")]
    pub seed: u64,
    /// T0, seconds; `None`: T0_max of (16).
    pub mission_s: Option<f64>,
    /// Time since the last fix's image at the start, seconds; `None`: as in the middle of a flight, a moment drawn.
    pub without_fix_s: Option<f64>,
    /// The aircraft.
    pub aircraft: AircraftModel,
    /// What registrations err.
    pub errors: ErrorModel,
    /// What they cost.
    pub execution: ExecutionModel,
    /// How absolute registrations fail.
    #[serde(default)]
    pub failures: FailureModel,
    /// The sequential mode's own.
    #[serde(default)]
    pub sequential: SequentialModel,
    /// A store to fly over; `None`: a map without edge, searched by equation 3.
    pub store: Option<StoreModel>,
    /// What `navigate::NavigationFilter` is tried with beside; `None`: it is not.
    pub covariance: Option<CovarianceModel>,
}

/// The aircraft and what its images show.
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
    /// Time between images, seconds; 0: an image is taken whenever one is wanted, as the paper has it.
    #[serde(default)]
    pub image_interval_s: f64,
}

/// What registrations err, and what the search takes them to err.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorModel {
    /// I, full width, metres: a fix errs by up to half of it along and across, evenly drawn.
    pub inaccuracy_m: f64,
    /// D_U, metres.
    pub unit_drift_m: f64,
    /// How the search takes drift to add up.
    #[serde(default)]
    pub drift_growth: DriftGrowth,
    /// How it does.
    #[serde(default)]
    pub drift: DrawnDrift,
    /// Of independent drift: D_U is so many standard deviations of one registration, per axis.
    #[serde(default = "three")]
    pub drift_sigmas: f64,
}

/// How relative registrations drift.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DrawnDrift {
    /// After each fix one error per axis, evenly within D_U, which every registration repeats: (2) is then the bound.
    #[default]
    Bias,
    /// An error of its own for each, normal.
    Independent,
}

/// What registrations cost.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExecutionModel {
    /// t0, seconds.
    pub relative_s: f64,
    /// K1, seconds per image's worth of map.
    pub seconds_per_tile: f64,
    /// The part of a search that does not grow with the map, seconds.
    #[serde(default)]
    pub constant_s: f64,
}

/// How absolute registrations fail.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FailureModel {
    /// By what.
    pub law: FailureLaw,
    /// p of `constant`; of `per_image` that of each image's worth of map.
    pub probability: Option<f64>,
    /// What follows on a failure.
    pub after: AfterFailure,
    /// Share of the failures that give a wrong position instead of none.
    pub false_share: f64,
}

impl Default for FailureModel {
    fn default() -> Self {
        Self { law: FailureLaw::Overlap, probability: None, after: AfterFailure::Afresh, false_share: 0.0 }
    }
}

/// What p grows with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureLaw {
    /// Equations 5 and 6, in the sequential mode: what the next relative registration hangs on has left the image. The other modes do
    /// not wait for a search, and fail by nothing that is drawn.
    Overlap,
    /// The same for all.
    Constant,
    /// 1 - (1 - probability)^𝒩: each image's worth of map may hold what deceives.
    PerImage,
}

/// What follows on a failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AfterFailure {
    /// As if there had been a fix: every registration alike and on its own, as (1) to (16) count them.
    Afresh,
    /// The next cycle; drift and region grow on.
    NextCycle,
    /// One relative registration, then another search; drift and region grow on.
    Retry,
}

/// The sequential mode's own.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SequentialModel {
    /// n; `None`: the best whole one (13).
    pub relative_count: Option<u64>,
}

/// A store to fly over: a search reads its tiles, and fails where it has none.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoreModel {
    /// The file, beside `sim.toml`; `None`: named by the command.
    pub path: Option<PathBuf>,
    /// The layer; `None`: the only one, or `ortho`.
    pub layer: Option<String>,
    /// No fix where the map shows less than this share of the image.
    #[serde(default = "half")]
    pub least_covered: f64,
    /// How far beyond the bounds of the layer's tiles the aircraft's waypoints may lie, metres; negative: how far they stay within.
    #[serde(default)]
    pub beyond_m: f64,
}

/// What `navigate::NavigationFilter` is tried with: the simulated aircraft's sensors. One standard deviation each.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CovarianceModel {
    /// So many of the flights.
    pub runs: u32,
    /// Above ground, metres.
    pub height_m: f64,
    /// What the compass is wrong by throughout, degrees.
    pub heading_offset_deg: f64,
    /// What it is wrong by anew at each image, degrees.
    pub heading_noise_deg: f64,
    /// What the altimeter is wrong by throughout, as a ratio.
    pub height_offset_ratio: f64,
    /// What it is wrong by anew at each image, as a ratio.
    pub height_noise_ratio: f64,
    /// Of the turn that a relative registration tells, degrees.
    pub turn_noise_deg: f64,
    /// Of the climb that it tells, as a ratio of the height.
    pub climb_noise_ratio: f64,
    /// Of the start, per axis, metres.
    pub start_sigma_m: f64,
    /// Of a fix, per axis, metres.
    pub fix_sigma_m: f64,
    /// Share of a fix's variance that all fixes of a flight have in common, as the map's own error is.
    #[serde(default = "whole")]
    pub fix_common_share: f64,
    /// Of a fix's heading, degrees.
    pub fix_heading_deg: f64,
    /// Of a fix's scale, as a ratio.
    pub fix_scale_ratio: f64,
    /// What the estimate is told of its steps' and fixes' standard deviations, over what is drawn: 1, or the check must fail.
    #[serde(default = "whole")]
    pub stated_ratio: f64,
}

impl Scenario {
    /// What the models are reckoned from.
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

    /// From one relative registration to the next, seconds: t0, or the whole intervals between images that it takes.
    pub fn step_s(&self) -> f64 {
        whole_intervals(self.execution.relative_s, self.aircraft.image_interval_s)
    }
}

/// `elapsed_s`, or, where images come at intervals, the time until the first image not before that.
pub fn whole_intervals(elapsed_s: f64, interval_s: f64) -> f64 {
    // A rounding error is no reason to wait for another image.
    if interval_s > 0.0 { (elapsed_s / interval_s - 1e-9).ceil().max(0.0) * interval_s } else { elapsed_s }
}

/// A mode that is simulated, and how it may be spelt: `auto` looks at images.
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
