//! `SimulationSummary`: the results of the flights of a scenario beside the predictions.

use super::adjusted::Adjusted;
use super::comparison::{BandComparison, CONFIDENCE, Claim, ClaimKind, Family, confidence_each};
use super::flight_tally::{CHECKPOINTS, FlightTally, TrackTally};
use super::prediction::Prediction;
use super::prediction::RISK;
use super::scenario::{AfterFailure, FailureLaw};
use super::simulated_flights::SimulatedFlights;
use crate::trial::quantiles::Quantiles;
use overfly_core::coupling::Mode;
use serde::Serialize;

/// A scenario in a mode, predicted and simulated, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulationSummary {
    /// `base`, or the variation's name.
    pub variation: String,
    /// The mode.
    pub mode: Mode,
    /// Number of flights.
    pub runs: u32,
    /// T0, seconds.
    pub mission_s: f64,
    /// n, for the sequential mode.
    pub relative_count: Option<u64>,
    /// The assumptions of the model that do not hold, as words.
    pub departures: Vec<&'static str>,
    /// The predictions of the models.
    pub predicted: Prediction,
    /// The predictions with what the models leave out; absent if there is no closed form.
    pub adjusted: Option<Adjusted>,
    /// The simulated figures.
    pub simulated: Simulated,
    /// The score of the filters.
    pub covariance: Option<CovarianceScore>,
    /// Predicted figures against simulated ones.
    pub comparisons: Vec<BandComparison>,
}

/// The simulated figures. Counts are means over the flights unless stated otherwise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Simulated {
    /// Absolute registrations of a flight.
    pub absolute_count: f64,
    /// Failures of a flight.
    pub failures: f64,
    /// Failures over absolute registrations.
    pub failure_probability: Option<f64>,
    /// The same after a failed registration: greater if failures cluster.
    pub failure_probability_after_failure: Option<f64>,
    /// Variance of a flight's failures over their mean: 1 - p if they are independent, greater if they cluster.
    pub dispersion: Option<f64>,
    /// Drawn failures of all flights.
    pub drawn: u64,
    /// Failures of all flights because the image lay outside the searched region.
    pub outside_region: u64,
    /// Failures of all flights because the map does not show the image.
    pub no_map: u64,
    /// Failures of all flights with a wrong position.
    pub false_fixes: u64,
    /// Share of the flights with at least one failure.
    pub flights_with_failure: f64,
    /// Share of the flights whose searches left the range in which they settle.
    pub flights_lost: f64,
    /// 𝒩 of a search: the map that was read, in images.
    pub nominal_count: Option<f64>,
    /// t_exe, seconds.
    pub execution_s: Option<f64>,
    /// t_exe of each flight's last search, seconds.
    pub last_execution_s: Option<f64>,
    /// Length of the mission in which one failure is expected, seconds.
    pub max_mission_s: Option<f64>,
    /// Time within which 5 % of the flights had a failure, seconds.
    pub mission_within_risk_s: Option<f64>,
}

/// The score of the filters.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CovarianceScore {
    /// Flights with a filter.
    pub runs: usize,
    /// Images of these flights.
    pub images: u64,
    /// Share of all images at which the filter's own 95 % ellipse contains the truth.
    pub ellipse95_coverage: f64,
    /// The same at one image of each flight, at a random moment: these are independent.
    pub ellipse95_coverage_sampled: f64,
    /// Mean NEES e^T C^-1 e at those images: 2 if covariances are true.
    pub nees_mean: f64,
    /// Error at those images, metres.
    pub position_error_m: Option<Quantiles>,
    /// Coverage at evenly spaced moments of the mission, over the flights; absent if no image was taken after.
    pub coverage_over_time: Vec<Option<f64>>,
}

/// Summarises all flights, and counts the comparisons inside their bands.
pub fn summarize(flown: &[SimulatedFlights]) -> (Vec<SimulationSummary>, Family) {
    let claims: Vec<Vec<Claim>> = flown.iter().map(claims).collect();
    let count = claims.iter().map(Vec::len).sum();
    let each = confidence_each(count);
    let summaries: Vec<SimulationSummary> = flown
        .iter()
        .zip(claims)
        .map(|(flown, claims)| SimulationSummary {
            variation: flown.variation.clone(),
            mode: flown.mode,
            runs: flown.scenario.runs,
            mission_s: flown.plan.mission_s,
            relative_count: (flown.mode == Mode::Sequential).then_some(flown.plan.relative_count),
            departures: flown.departures.clone(),
            predicted: flown.prediction.clone(),
            adjusted: flown.adjusted,
            simulated: Simulated::from_tallies(&flown.tallies, flown.plan.mission_s),
            covariance: CovarianceScore::from_tallies(&flown.tallies),
            comparisons: claims.iter().map(|claim| claim.judged(each)).collect(),
        })
        .collect();
    let family = Family {
        flights: flown.iter().map(|f| f.tallies.len() as u64).sum(),
        absolute_count: flown.iter().flat_map(|f| &f.tallies).map(|t| t.absolute_count).sum(),
        comparisons: count,
        inside: summaries.iter().flat_map(|s| &s.comparisons).filter(|c| c.inside).count(),
        confidence: CONFIDENCE,
        confidence_each: each,
    };
    (summaries, family)
}

/// The predictions to compare for the flights of a scenario.
fn claims(flown: &SimulatedFlights) -> Vec<Claim> {
    let (predicted, scenario, runs) = (&flown.prediction, &flown.scenario, flown.tallies.len() as f64);
    let simulated = Simulated::from_tallies(&flown.tallies, flown.plan.mission_s);
    let mut claims = Vec::new();
    // A flight has N registrations, rounded up or down.
    let trials = |n: f64| runs as u64 * (n - 1e-9).ceil().max(1.0) as u64;
    let mut failures = |what, count: Option<f64>, mean: Option<f64>| {
        if let (Some(n), Some(mean)) = (count, mean) {
            let kind = ClaimKind::Count { trials: trials(n).max((mean * runs).ceil() as u64), per: runs };
            claims.push(Claim { what, predicted: mean, simulated: simulated.failures, kind });
        }
    };
    failures("failures", predicted.absolute_count, predicted.failures);
    failures("failures_printed", predicted.absolute_count, predicted.failures_printed);
    let is_afresh = scenario.failures.after == AfterFailure::Afresh;
    if let Some(adjusted) = flown.adjusted.filter(|_| is_afresh && scenario.store.is_none()) {
        let differs = |mean: f64| predicted.failures.is_none_or(|model| (mean - model).abs() > 1e-6 * model);
        let mean = adjusted.failures.filter(|mean| *mean > 0.0 && differs(*mean));
        failures("failures_adjusted", Some(adjusted.absolute_count), mean);
    }
    if let Some(chance) = predicted.chance_of_failure {
        let kind = ClaimKind::Count { trials: runs as u64, per: runs };
        let simulated = simulated.flights_with_failure;
        claims.push(Claim { what: "flights_with_failure", predicted: chance, simulated, kind });
    }
    claims.extend(settling_claims(flown, &simulated));
    claims.extend(CovarianceScore::from_tallies(&flown.tallies).iter().flat_map(covariance_claims));
    claims
}

/// Without random influence, searches must settle as predicted, at the predicted duration.
fn settling_claims(flown: &SimulatedFlights, simulated: &Simulated) -> Vec<Claim> {
    let failures = &flown.scenario.failures;
    let is_undisturbed = failures.after == AfterFailure::Afresh || failures.law == FailureLaw::Overlap;
    let Some(settles) = flown.prediction.settles.filter(|_| is_undisturbed) else { return Vec::new() };
    let kind = ClaimKind::Exact;
    let lost = if settles { 0.0 } else { 1.0 };
    let mut claims = vec![Claim { what: "flights_lost", predicted: lost, simulated: simulated.flights_lost, kind }];
    if let (Some(predicted), Some(simulated)) = (flown.prediction.execution_s, simulated.last_execution_s) {
        claims.push(Claim { what: "execution_s", predicted, simulated, kind });
    }
    claims
}

fn covariance_claims(score: &CovarianceScore) -> [Claim; 2] {
    let count = score.runs as u64;
    [
        Claim {
            what: "ellipse95_coverage",
            predicted: 0.95,
            simulated: score.ellipse95_coverage_sampled,
            kind: ClaimKind::Count { trials: count, per: count as f64 },
        },
        Claim { what: "nees_mean", predicted: 2.0, simulated: score.nees_mean, kind: ClaimKind::Nees { count } },
    ]
}

impl Simulated {
    fn from_tallies(tallies: &[FlightTally], mission_s: f64) -> Self {
        let runs = tallies.len() as f64;
        let total = |of: fn(&FlightTally) -> u64| tallies.iter().map(of).sum::<u64>();
        let (count, failures) = (total(|t| t.absolute_count), total(|t| t.failures));
        let ratio = |part: f64, whole: f64| (whole > 0.0).then(|| part / whole);
        let mean = failures as f64 / runs;
        let variance = tallies.iter().map(|t| (t.failures as f64 - mean).powi(2)).sum::<f64>() / (runs - 1.0).max(1.0);
        let lasts: Vec<f64> = tallies.iter().filter_map(|t| t.last_execution_s).collect();
        Self {
            absolute_count: count as f64 / runs,
            failures: mean,
            failure_probability: ratio(failures as f64, count as f64),
            failure_probability_after_failure: ratio(
                total(|t| t.after_failure[1]) as f64,
                total(|t| t.after_failure[0]) as f64,
            ),
            dispersion: ratio(variance, mean),
            drawn: total(|t| t.drawn),
            outside_region: total(|t| t.outside_region),
            no_map: total(|t| t.no_map),
            false_fixes: total(|t| t.false_fixes),
            flights_with_failure: total(|t| u64::from(t.failures > 0)) as f64 / runs,
            flights_lost: total(|t| u64::from(t.is_lost)) as f64 / runs,
            nominal_count: ratio(tallies.iter().map(|t| t.nominal_count).sum(), count as f64),
            execution_s: ratio(tallies.iter().map(|t| t.execution_s).sum(), count as f64),
            last_execution_s: ratio(lasts.iter().sum(), lasts.len() as f64),
            max_mission_s: ratio(mission_s * runs, failures as f64),
            mission_within_risk_s: first_share_s(tallies),
        }
    }
}

/// The time within which a share of [`RISK`] of the flights had a failure.
fn first_share_s(tallies: &[FlightTally]) -> Option<f64> {
    let mut firsts: Vec<f64> = tallies.iter().filter_map(|t| t.first_failure_s).collect();
    firsts.sort_by(f64::total_cmp);
    firsts.get((RISK * tallies.len() as f64).ceil().max(1.0) as usize - 1).copied()
}

impl CovarianceScore {
    /// The score of the flights with a filter; `None` without any.
    fn from_tallies(tallies: &[FlightTally]) -> Option<Self> {
        let tracks: Vec<&TrackTally> = tallies.iter().filter_map(|t| t.track.as_deref()).collect();
        let nees: Vec<f64> = tracks.iter().filter_map(|t| t.nees).collect();
        let images: u64 = tracks.iter().map(|t| t.images).sum();
        if nees.is_empty() {
            return None;
        }
        let over_time = (0..CHECKPOINTS).map(|k| {
            let seen: Vec<bool> = tracks.iter().filter_map(|t| t.checkpoints[k]).collect();
            let covered = seen.iter().filter(|c| **c).count();
            (!seen.is_empty()).then(|| covered as f64 / seen.len() as f64)
        });
        Some(Self {
            runs: nees.len(),
            images,
            ellipse95_coverage: tracks.iter().map(|t| t.covered).sum::<u64>() as f64 / images as f64,
            ellipse95_coverage_sampled: nees.iter().filter(|n| TrackTally::holds(**n)).count() as f64
                / nees.len() as f64,
            nees_mean: nees.iter().sum::<f64>() / nees.len() as f64,
            position_error_m: Quantiles::from_values(tracks.iter().filter_map(|t| t.error_m).collect()),
            coverage_over_time: over_time.collect(),
        })
    }
}
