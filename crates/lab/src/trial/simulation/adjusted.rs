//! `Adjusted`: the predictions of the models, corrected for what they leave out: whole images, tiles, positions
//! outside the region, regions that grow over failures.

use super::drift::chance_within_region;
use super::prediction::{MissionPlan, chance_of_any};
use super::scenario::{AfterFailure, FailureLaw, Scenario, whole_intervals};
use overfly_core::coupling::Mode;
use overfly_core::coupling::{Combined, CouplingError, mean_tile_count, nominal_count_sequential, region_edges_m};
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;

/// The same figures as in [`Prediction`](super::Prediction), means over a flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Adjusted {
    /// Nominal count of a search after a fix: the map that it reads, in images.
    pub nominal_count: f64,
    /// t_exe of that search, seconds.
    pub execution_s: f64,
    /// Probability that a search fails, drawn or because the image lies outside the region.
    pub failure_probability: f64,
    /// Absolute registrations in a mission, if no flight is lost.
    pub absolute_count: f64,
    /// Failures in a mission; absent if more than a hundredth of the flights is lost.
    pub failures: Option<f64>,
    /// Share of the flights whose region grows with each failure until every search comes too late.
    pub flights_lost: f64,
}

/// A search and the relative registrations before it.
struct Cycle {
    nominal_count: f64,
    execution_s: f64,
    probability: f64,
    duration_s: f64,
}

/// With more flights lost than this share, there is no steady state.
const MOST_LOST: f64 = 0.01;
/// Most failures in a row that are followed.
const MOST_IN_A_ROW: u32 = 100_000;
/// Headings over which the number of tiles is averaged.
const HEADINGS: u32 = 90;

impl Adjusted {
    /// Adjusts the prediction of a mode. `tile_m` is the edge of the store's tiles, if there is a store. `None` if
    /// there is no steady state or no closed form.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    pub fn new(
        mode: Mode,
        scenario: &Scenario,
        plan: MissionPlan,
        tile_m: Option<f64>,
    ) -> Result<Option<Self>, CouplingError> {
        match mode {
            Mode::Sequential => sequential(scenario, plan, tile_m),
            Mode::Parallel => settled(scenario, plan, |elapsed_s| {
                let count = whole_intervals(elapsed_s, scenario.aircraft.image_interval_s) / scenario.step_s();
                let whole = if scenario.aircraft.image_interval_s > 0.0 { (count + 1e-9).floor() } else { count };
                Ok((images(scenario, whole, tile_m)?, chance_within_region(&scenario.errors, whole)))
            }),
            Mode::Combined if tile_m.is_none() => {
                let model = Combined::new(scenario.parameters())?;
                let interval_s = scenario.aircraft.image_interval_s;
                settled(scenario, plan, |elapsed_s| {
                    Ok((model.nominal_count(whole_intervals(elapsed_s, interval_s).min(1e9))?, 1.0))
                })
            }
            Mode::Combined | Mode::RelativeOnly | Mode::Auto => Ok(None),
        }
    }
}

/// The sequential mode by renewal: from fix to fix, with any number of failures between.
fn sequential(scenario: &Scenario, plan: MissionPlan, tile_m: Option<f64>) -> Result<Option<Adjusted>, CouplingError> {
    let failures = &scenario.failures;
    let first = cycle(scenario, plan.relative_count, plan.relative_count, tile_m)?;
    let carries = failures.after != AfterFailure::Afresh;
    if carries && failures.false_share > 0.0 {
        return Ok(None);
    }
    let (mut reached, mut searches, mut failed, mut elapsed_s) = (1.0, 0.0, 0.0, 0.0);
    for in_a_row in 0..if carries { MOST_IN_A_ROW } else { 1 } {
        let before = match failures.after {
            AfterFailure::Retry if in_a_row > 0 => 1,
            _ => plan.relative_count,
        };
        let since = match failures.after {
            AfterFailure::Retry => plan.relative_count + u64::from(in_a_row),
            _ => plan.relative_count * (u64::from(in_a_row) + 1),
        };
        // Beyond the domain of the models there is no steady state either.
        let Ok(this) = cycle(scenario, before, since, tile_m) else { return Ok(None) };
        searches += reached;
        failed += reached * this.probability;
        elapsed_s += reached * this.duration_s;
        reached *= this.probability;
        if carries && this.probability >= 1.0 {
            // The flight goes from fix to fix until it is lost.
            let lost = -(-reached * plan.mission_s / elapsed_s).exp_m1();
            return Ok(Some(adjusted(&first, plan, [searches, failed, elapsed_s], lost)));
        }
        if reached < 1e-12 {
            break;
        }
    }
    Ok(Some(adjusted(&first, plan, [searches, failed, elapsed_s], 0.0)))
}

/// The figures from the means between two fixes: searches, failures, seconds.
fn adjusted(first: &Cycle, plan: MissionPlan, [searches, failed, elapsed_s]: [f64; 3], flights_lost: f64) -> Adjusted {
    Adjusted {
        nominal_count: first.nominal_count,
        execution_s: first.execution_s,
        failure_probability: failed / searches,
        absolute_count: plan.mission_s * searches / elapsed_s,
        failures: (flights_lost <= MOST_LOST).then_some(plan.mission_s * failed / elapsed_s),
        flights_lost,
    }
}

/// The cycle of `before` relative registrations and a search, `since` registrations after the last fix.
fn cycle(scenario: &Scenario, before: u64, since: u64, tile_m: Option<f64>) -> Result<Cycle, CouplingError> {
    let (aircraft, execution) = (&scenario.aircraft, &scenario.execution);
    let nominal_count = images(scenario, since as f64, tile_m)?;
    let execution_s = execution.constant_s + execution.seconds_per_tile * nominal_count;
    let drawn = match scenario.failures.law {
        FailureLaw::Overlap => (aircraft.speed_mps * execution_s / aircraft.along_m).min(1.0),
        _ => drawn_probability(scenario, nominal_count),
    };
    let within = chance_within_region(&scenario.errors, since as f64);
    let duration_s = before as f64 * scenario.step_s() + whole_intervals(execution_s, aircraft.image_interval_s);
    Ok(Cycle { nominal_count, execution_s, probability: 1.0 - within * (1.0 - drawn), duration_s })
}

/// Probability of a drawn failure if nothing waits for the search.
fn drawn_probability(scenario: &Scenario, nominal_count: f64) -> f64 {
    match (scenario.failures.law, scenario.failures.probability) {
        (FailureLaw::Constant, Some(p)) => p,
        (FailureLaw::PerImage, Some(each)) => chance_of_any(each, nominal_count),
        _ => 0.0,
    }
}

/// Searches that follow each other, each over the region that opened during the one before. `look` returns 𝒩 and the
/// probability that the image lies in the region.
fn settled(
    scenario: &Scenario,
    plan: MissionPlan,
    look: impl Fn(f64) -> Result<(f64, f64), CouplingError>,
) -> Result<Option<Adjusted>, CouplingError> {
    let (execution, interval_s) = (&scenario.execution, scenario.aircraft.image_interval_s);
    let mut execution_s = execution.constant_s + execution.seconds_per_tile;
    for _ in 0..20_000 {
        let (nominal_count, within) = look(execution_s)?;
        let next_s = execution.constant_s + execution.seconds_per_tile * nominal_count;
        if next_s > 1e9 {
            return Ok(None);
        }
        if (next_s - execution_s).abs() <= 1e-12 * execution_s {
            let probability = 1.0 - within * (1.0 - drawn_probability(scenario, nominal_count));
            if probability > 0.0 && scenario.failures.after != AfterFailure::Afresh {
                return Ok(None);
            }
            let this = Cycle { nominal_count, execution_s, probability, duration_s: 0.0 };
            let between_s = whole_intervals(execution_s, interval_s);
            return Ok(Some(adjusted(&this, plan, [1.0, probability, between_s], 0.0)));
        }
        execution_s = next_s;
    }
    Ok(None)
}

/// Nominal count of a search: by (3), or by the tiles that its rectangle meets on average.
fn images(scenario: &Scenario, count: f64, tile_m: Option<f64>) -> Result<f64, CouplingError> {
    let (errors, aircraft) = (&scenario.errors, &scenario.aircraft);
    let (across_m, along_m) = (aircraft.across_m, aircraft.along_m);
    let drift_m = errors.drift_growth.drift_m(count, errors.unit_drift_m)?;
    let Some(tile_m) = tile_m else {
        return Ok(nominal_count_sequential(across_m, along_m, errors.inaccuracy_m, drift_m));
    };
    let (width_m, length_m) = region_edges_m(across_m, along_m, errors.inaccuracy_m, drift_m);
    let mut sum = 0.0;
    for k in 0..HEADINGS {
        let turned_rad = (f64::from(k) + 0.5) / f64::from(HEADINGS) * FRAC_PI_2;
        sum += mean_tile_count(width_m, length_m, tile_m, tile_m, turned_rad)?;
    }
    Ok(sum / f64::from(HEADINGS) * tile_m * tile_m / (across_m * along_m))
}
