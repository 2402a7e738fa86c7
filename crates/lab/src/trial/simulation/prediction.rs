//! `Prediction`: the predictions of `coupling` for a scenario flown in a mode.

use super::scenario::{FailureLaw, Scenario};
use overfly_core::coupling::Mode;
use overfly_core::coupling::{
    Combined, CouplingError, CouplingParameters, ExecutionSequence, Parallel, Sequential, absolute_count,
    chance_of_no_failure, expected_failures, mission_of_one_failure_s, mission_within_risk_s,
};
use serde::Serialize;

/// The risk of [`Prediction::mission_within_risk_s`].
pub const RISK: f64 = 0.05;

/// The predictions of the models. A figure is absent if the models say nothing; in JSON an infinite number is `null`.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Prediction {
    /// n_opt of (13), at most n_max, for the sequential mode.
    pub optimal_relative_count: Option<f64>,
    /// n_max of (8).
    pub max_relative_count: Option<f64>,
    /// 𝒩 of a search: (3) at n; for settled searches (17) and its counterpart of the combined mode.
    pub nominal_count: Option<f64>,
    /// t_exe: (4); (21) and its counterpart.
    pub execution_s: Option<f64>,
    /// t_cycle (9); t_exe if nothing stands between searches.
    pub cycle_s: Option<f64>,
    /// p: (5), or as stated.
    pub failure_probability: Option<f64>,
    /// N of a mission (10).
    pub absolute_count: Option<f64>,
    /// p N of a mission (11), at the n that is flown.
    pub failures: Option<f64>,
    /// The least p N as printed in (14), where the best n is flown.
    pub failures_printed: Option<f64>,
    /// Probability of at least one failure in a mission.
    pub chance_of_failure: Option<f64>,
    /// T0_max at the n that is flown (16), seconds.
    pub max_mission_s: Option<f64>,
    /// T0_max as printed in (16), seconds, where the best n is flown.
    pub max_mission_printed_s: Option<f64>,
    /// Length of the mission in which a failure has a probability of 5 %, seconds.
    pub mission_within_risk_s: Option<f64>,
    /// Whether searches settle from the start of the flight: conditions of (20) to (22), and those of the combined
    /// mode.
    pub settles: Option<bool>,
    /// The longest time without a fix from which searches settle: (22), and the combined mode's, seconds.
    pub unstable_s: Option<f64>,
}

/// The parameters of a mode that a flight needs as well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MissionPlan {
    /// T0, seconds.
    pub mission_s: f64,
    /// n of the sequential mode.
    pub relative_count: u64,
}

/// Mission time and n, as stated or as the sequential model advises.
///
/// # Errors
/// Names what must be stated because the model does not give it.
pub fn plan(scenario: &Scenario) -> Result<MissionPlan, String> {
    let mode = Sequential::new(scenario.parameters()).map_err(|e| e.to_string())?;
    let relative_count = match scenario.sequential.relative_count {
        Some(count) => count,
        None if !scenario.modes.contains(&Mode::Sequential) => 0,
        None => match mode.best_whole_relative_count() {
            Ok(count) if count <= 1_000_000_000 => count,
            Ok(_) => return Err("sequential.relative_count: equation 13 has no bound here, state it".into()),
            Err(e) => return Err(format!("sequential.relative_count: state it, for {e}")),
        },
    };
    let mission_s = match scenario.mission_s {
        Some(mission_s) => mission_s,
        None => match mode.max_mission_s() {
            Ok(mission_s) if mission_s <= 1e9 => mission_s,
            Ok(_) => return Err("mission_s: equation 16 has no bound here, state it".into()),
            Err(e) => return Err(format!("mission_s: state it, for {e}")),
        },
    };
    Ok(MissionPlan { mission_s, relative_count })
}

impl Prediction {
    /// Computes the predictions for a mode.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`]. A mode that does not work has absent figures.
    pub fn new(mode: Mode, scenario: &Scenario, plan: MissionPlan) -> Result<Self, CouplingError> {
        let parameters = scenario.parameters();
        match mode {
            Mode::Sequential => Self::sequential(scenario, parameters, plan),
            Mode::Parallel => {
                let model = Parallel::new(parameters)?;
                Self::settled(scenario, plan, model.sequence()?, |t| model.nominal_count(t))
            }
            Mode::Combined => {
                let model = Combined::new(parameters)?;
                Self::settled(scenario, plan, model.sequence()?, |t| model.nominal_count(t))
            }
            Mode::RelativeOnly | Mode::Auto => Ok(Self::default()),
        }
    }

    fn sequential(
        scenario: &Scenario,
        parameters: CouplingParameters,
        plan: MissionPlan,
    ) -> Result<Self, CouplingError> {
        let printed = Sequential::new(parameters)?;
        let count = plan.relative_count as f64;
        let nominal_count = printed.nominal_count(count)?;
        let law = scenario.failures.law;
        // To the model, a law of its own is a measured probability.
        let measured = match (law, scenario.failures.probability) {
            (FailureLaw::PerImage, Some(each)) => Some(chance_of_any(each, nominal_count)),
            _ => parameters.failure_probability,
        };
        let model = Sequential::new(CouplingParameters { failure_probability: measured, ..parameters })?;
        let cycle_s = model.cycle_s(count)?;
        // (14) and (16) hold for the best n, under (2) and (5).
        let is_best = (printed.optimal_relative_count() - count).abs() <= 1.0 && law == FailureLaw::Overlap;
        let as_printed = |value: f64| (is_best && value.is_finite() && value > 0.0).then_some(value);
        let probability = match model.failure_probability(count) {
            Ok(p) => Some(p),
            // Beyond n_max every search fails.
            Err(CouplingError::CountAboveMax { .. } | CouplingError::SpeedAboveMax { .. }) => Some(1.0),
            Err(other) => return Err(other),
        };
        Ok(Self {
            optimal_relative_count: printed.best_relative_count().ok().filter(|n| n.is_finite()),
            max_relative_count: printed.max_relative_count().ok().filter(|n| n.is_finite()),
            execution_s: Some(model.execution_s(count)?),
            failures_printed: as_printed(printed.least_expected_failures_paper(plan.mission_s)),
            max_mission_printed_s: as_printed(printed.max_mission_paper_s()),
            ..Self::counted(nominal_count, cycle_s, probability, plan.mission_s)?
        })
    }

    fn settled(
        scenario: &Scenario,
        plan: MissionPlan,
        sequence: ExecutionSequence,
        nominal_count: impl Fn(f64) -> Result<f64, CouplingError>,
    ) -> Result<Self, CouplingError> {
        let Some(points) = sequence.fixed_points() else {
            return Ok(Self { settles: Some(false), ..Self::default() });
        };
        let start_s = scenario.without_fix_s.unwrap_or(points.stable_s);
        let settles = Some(start_s < points.unstable_s);
        let unstable_s = Some(points.unstable_s).filter(|t| t.is_finite());
        if settles == Some(false) {
            return Ok(Self { settles, unstable_s, ..Self::default() });
        }
        let nominal_count = nominal_count(points.stable_s)?;
        let probability = match (scenario.failures.law, scenario.failures.probability) {
            (FailureLaw::Constant, p) => p,
            (FailureLaw::PerImage, Some(each)) => Some(chance_of_any(each, nominal_count)),
            (FailureLaw::Overlap | FailureLaw::PerImage, _) => None,
        };
        let counted = Self::counted(nominal_count, points.stable_s, probability, plan.mission_s)?;
        Ok(Self { settles, unstable_s, execution_s: Some(points.stable_s), ..counted })
    }

    /// N, p N and the figures that follow from them.
    fn counted(nominal_count: f64, cycle_s: f64, p: Option<f64>, mission_s: f64) -> Result<Self, CouplingError> {
        let count = absolute_count(mission_s, cycle_s)?;
        Ok(Self {
            nominal_count: Some(nominal_count),
            cycle_s: Some(cycle_s),
            failure_probability: p,
            absolute_count: Some(count),
            failures: p.map(|p| expected_failures(p, count)).transpose()?,
            chance_of_failure: p.map(|p| chance_of_no_failure(p, count)).transpose()?.map(|none| 1.0 - none),
            max_mission_s: p.map(|p| mission_of_one_failure_s(p, cycle_s)).transpose()?,
            mission_within_risk_s: p.map(|p| mission_within_risk_s(p, cycle_s, RISK)).transpose()?,
            ..Self::default()
        })
    }
}

/// Probability that at least one of `count` events happens (the count can be fractional), each with a probability of
/// `each`.
pub fn chance_of_any(each: f64, count: f64) -> f64 {
    -(count * (-each).ln_1p()).exp_m1()
}
