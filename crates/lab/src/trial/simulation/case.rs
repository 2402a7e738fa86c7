//! `ScenarioCase`: a scenario in one mode, ready to fly.

use super::adjusted::Adjusted;
use super::map::SimulatedMap;
use super::prediction::{MissionPlan, Prediction, plan};
use super::scenario::{AfterFailure, DrawnDrift, FailureLaw, Scenario, whole_intervals};
use overfly_core::coupling::DriftGrowth;
use overfly_core::coupling::Mode;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Limits that keep a case to some minutes: absolute registrations of all flights; of those that look up a store's
/// tiles; of those that draw the outline of the aircraft's reach; images of all filters.
const MOST_REGISTRATIONS: f64 = 1e10;
const MOST_STORED: f64 = 1e7;
const MOST_OUTLINES: f64 = 1e5;
const MOST_IMAGES: f64 = 3e8;

/// A scenario in one mode.
pub struct ScenarioCase<'a> {
    /// Name of the scenario.
    pub name: &'a str,
    /// The mode.
    pub mode: Mode,
    /// The parameters.
    pub scenario: &'a Scenario,
    /// Mission time and n.
    pub plan: MissionPlan,
    /// The map that is searched.
    pub map: &'a SimulatedMap,
    /// The predictions of the models.
    pub prediction: Prediction,
    /// The predictions with what the models leave out.
    pub adjusted: Option<Adjusted>,
    /// Number of the case, which selects its random stream.
    number: u64,
}

/// The purpose of random numbers. Each has its own stream, so that a flight is the same with and without a filter
/// beside it.
#[derive(Debug, Clone, Copy)]
pub enum Draws {
    /// Errors and failures.
    Flight,
    /// Waypoints.
    Route,
    /// Sensors and fixes of the filter.
    Track,
}

impl<'a> ScenarioCase<'a> {
    /// Computes what is needed before a flight.
    ///
    /// # Errors
    /// Names what must be stated, what is too much work, or where the models have no answer.
    pub fn new(
        name: &'a str,
        scenario: &'a Scenario,
        mode: Mode,
        map: &'a SimulatedMap,
        number: u64,
    ) -> Result<Self, String> {
        let plan = plan(scenario)?;
        let tile_m = match map {
            SimulatedMap::Endless => None,
            SimulatedMap::Stored(stored) => Some(stored.tile_m),
        };
        let prediction = Prediction::new(mode, scenario, plan).map_err(|e| e.to_string())?;
        let adjusted = Adjusted::new(mode, scenario, plan, tile_m).map_err(|e| e.to_string())?;
        let case = Self { name, mode, scenario, plan, map, prediction, adjusted, number };
        case.bound_work()?;
        Ok(case)
    }

    fn bound_work(&self) -> Result<(), String> {
        let (scenario, mission_s) = (self.scenario, self.plan.mission_s);
        // The least that a search reads: its image or, off the map, one tile.
        let image_m2 = scenario.aircraft.across_m * scenario.aircraft.along_m;
        let least_images = match self.map {
            SimulatedMap::Endless => 1.0,
            SimulatedMap::Stored(map) => (map.tile_m * map.tile_m / image_m2).min(1.0),
        };
        let search_s = scenario.execution.constant_s + scenario.execution.seconds_per_tile * least_images;
        let shortest_s = whole_intervals(search_s, scenario.aircraft.image_interval_s).max(search_s);
        let least_count = match (self.mode, scenario.failures.after) {
            (Mode::Sequential, AfterFailure::Retry) => self.plan.relative_count.min(1),
            (Mode::Sequential, _) => self.plan.relative_count,
            _ => 0,
        };
        let registrations =
            f64::from(scenario.runs) * mission_s / (shortest_s + least_count as f64 * scenario.step_s());
        let most = match (self.map, self.mode) {
            (SimulatedMap::Endless, _) => MOST_REGISTRATIONS,
            (SimulatedMap::Stored(_), Mode::Combined) => MOST_OUTLINES,
            (SimulatedMap::Stored(_), _) => MOST_STORED,
        };
        if registrations > most && self.mode != Mode::RelativeOnly {
            return Err(format!("runs: {registrations:.1e} absolute registrations may come, of at most {most:.0e}"));
        }
        let image_s = if self.mode == Mode::Parallel { shortest_s.min(scenario.step_s()) } else { scenario.step_s() };
        let images = scenario.covariance.as_ref().map_or(0.0, |c| f64::from(c.runs) * mission_s / image_s);
        if images > MOST_IMAGES {
            return Err(format!("covariance.runs: {images:.1e} images, of at most {MOST_IMAGES:.0e}"));
        }
        Ok(())
    }

    /// The random generator of one flight. It does not depend on other flights or on threads.
    pub fn rng(&self, run: u32, draws: Draws) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.scenario.seed);
        rng.set_stream(self.number << 40 | (draws as u64) << 36 | u64::from(run));
        rng
    }

    /// The assumptions of model and filter that do not hold here, as words.
    pub fn departures(&self) -> Vec<&'static str> {
        let (s, mode) = (self.scenario, self.mode);
        let sequential = mode == Mode::Sequential;
        let drifts = matches!(mode, Mode::Sequential | Mode::Parallel);
        let searches = mode != Mode::RelativeOnly;
        let best = self.prediction.optimal_relative_count;
        let is_best = best.is_some_and(|n| (n - self.plan.relative_count as f64).abs() <= 1.0);
        let linear = s.errors.drift_growth == DriftGrowth::Linear;
        let repeats = s.errors.drift == DrawnDrift::Bias;
        let tracked = s.covariance.as_ref().filter(|_| mode != Mode::Combined);
        let carries = s.failures.after != AfterFailure::Afresh;
        [
            ("inaccuracy", searches && s.errors.inaccuracy_m > 0.0),
            ("search_constant", searches && s.execution.constant_s > 0.0),
            ("relative_count", sequential && !is_best),
            ("root_growth", drifts && !linear),
            ("repeated_drift", drifts && repeats && !linear),
            ("independent_drift", drifts && !repeats && linear),
            ("law_constant", searches && s.failures.law == FailureLaw::Constant),
            ("law_per_image", searches && s.failures.law == FailureLaw::PerImage),
            ("image_interval", searches && s.aircraft.image_interval_s > 0.0),
            ("growing_region", searches && carries),
            ("false_fixes", searches && carries && s.failures.false_share > 0.0),
            ("store", searches && s.store.is_some()),
            ("estimate_repeated_drift", tracked.is_some() && repeats),
            ("estimate_independent_fixes", searches && tracked.is_some_and(|c| c.fix_common_share < 1.0)),
            ("estimate_misinformed", tracked.is_some_and(|c| c.stated_ratio != 1.0)),
        ]
        .into_iter()
        .filter_map(|(word, holds)| holds.then_some(word))
        .collect()
    }
}
