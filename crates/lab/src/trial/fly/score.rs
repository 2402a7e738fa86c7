//! `FlyScore`: the score of a replayed flight against the truth.

use super::outcome::FlyOutcome;
use super::scale::FlightScale;
use crate::trial::integrity_score::IntegrityScore;
use crate::trial::quantiles::Quantiles;
use overfly_core::coupling::Mode;
use overfly_core::geodesy::{CHI_SQUARE_999, LocalFrame};
use overfly_core::integrity::DEFAULT_INTEGRITY_RISK;
use overfly_flight::navigate::PositionSource;
use serde::Serialize;

/// The summary of `fly`, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlyScore {
    /// The coupling mode.
    pub mode: Mode,
    /// Number of images.
    pub frames: usize,
    /// Absolute registrations with a fix, accepted by the filter or not.
    pub fixes: usize,
    /// Fixes farther than `right_m` from the truth.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Errors of all positions, propagated ones included, metres.
    pub position_error_m: Option<Quantiles>,
    /// Errors of dead reckoning by relative registrations alone, from the true start of each run between pauses,
    /// metres.
    pub dead_reckoning_error_m: Option<Quantiles>,
    /// Share of positions whose own 95 % ellipse contains the truth.
    pub ellipse95_coverage: Option<f64>,
    /// Positions by what they call themselves.
    pub sources: SourceScores,
    /// Absolute registrations begun.
    pub absolute_count: usize,
    /// Relative registrations tried.
    pub relative_count: usize,
    /// Clear images from the last disturbance (hidden images, or the start) until positions stayed within `right_m`;
    /// `None` if they never did.
    pub recovered_after_frames: Option<usize>,
    /// Protection levels against errors.
    pub integrity: IntegrityScore,
    /// Greatest error of a right position, metres.
    pub right_m: f64,
    /// One factor for all heights of the flight.
    pub scale: Option<FlightScale>,
    /// The score of dead reckoning, run by run.
    pub dead_reckoning_runs: Vec<RunScore>,
}

/// The positions of a flight by what they call themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct SourceScores {
    /// From a fix of that very image.
    pub absolute: SourceScore,
    /// Carried forward.
    pub propagated: SourceScore,
    /// In doubt.
    pub lost: SourceScore,
}

/// How many positions, and how many of them have the truth outside their own 99.9 % ellipse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct SourceScore {
    /// Positions.
    pub positions: usize,
    /// Those with the truth outside.
    #[serde(rename = "outside_999")]
    pub outside: usize,
}

impl SourceScores {
    /// Counts positions.
    pub fn count<'a>(outcomes: impl IntoIterator<Item = &'a FlyOutcome>) -> Self {
        let mut scores = Self::default();
        for outcome in outcomes {
            let score = match outcome.position.source {
                PositionSource::Absolute => &mut scores.absolute,
                PositionSource::Propagated => &mut scores.propagated,
                PositionSource::Lost => &mut scores.lost,
            };
            score.positions += 1;
            // A covariance that is not a number holds nothing.
            let is_inside = outcome.position.covariance.squared_mahalanobis(outcome.error) <= CHI_SQUARE_999;
            score.outside += usize::from(!is_inside);
        }
        scores
    }
}

/// The score of one run of dead reckoning, between pauses.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunScore {
    /// Name of the first image.
    pub image: String,
    /// Number of images.
    pub frames: usize,
    /// Length of the true path, metres.
    pub path_m: f64,
    /// Error at the last image, metres.
    pub end_error_m: f64,
    /// Error at the last image over the length of the path.
    pub end_error_share: f64,
    /// The same if all steps are scaled by [`FlyScore::scale`].
    pub scaled_end_error_share: Option<f64>,
}

impl FlyScore {
    /// Scores a flight and its dead reckoning.
    pub fn from_outcomes(mode: Mode, outcomes: &[FlyOutcome], reckoned: &[Vec<FlyOutcome>], right_m: f64) -> Self {
        let length_m = |o: &FlyOutcome| o.error.length_m();
        let fix_errors: Vec<f64> = outcomes.iter().filter_map(|o| o.fix_error_m).collect();
        let scale = FlightScale::estimate(outcomes, reckoned);
        let runs = reckoned.iter().filter(|run| run.len() > 1);
        let covered = outcomes.iter().filter(|o| is_in_ellipse95(o)).count();
        Self {
            mode,
            frames: outcomes.len(),
            fixes: fix_errors.len(),
            wrong: fix_errors.iter().filter(|e| **e > right_m).count(),
            position_error_m: Quantiles::from_values(outcomes.iter().map(length_m).collect()),
            dead_reckoning_error_m: Quantiles::from_values(reckoned.iter().flatten().map(length_m).collect()),
            ellipse95_coverage: (!outcomes.is_empty()).then(|| covered as f64 / outcomes.len() as f64),
            sources: SourceScores::count(outcomes),
            absolute_count: outcomes.iter().map(|o| o.position.absolute_count).sum(),
            relative_count: outcomes.iter().map(|o| o.position.relative_count).sum(),
            recovered_after_frames: recovered_after(outcomes, right_m),
            integrity: IntegrityScore::from_errors(
                &FlyOutcome::protected_errors(outcomes, DEFAULT_INTEGRITY_RISK),
                DEFAULT_INTEGRITY_RISK,
                None,
            ),
            right_m,
            scale,
            dead_reckoning_runs: runs.map(|run| run_score(run, scale)).collect(),
        }
    }
}

fn is_in_ellipse95(o: &FlyOutcome) -> bool {
    o.position.covariance.contains_95(o.error)
}

/// Number of clear images between the last hidden one (or the start) and the first from which on every position is
/// right.
fn recovered_after(outcomes: &[FlyOutcome], right_m: f64) -> Option<usize> {
    let begin = outcomes.iter().rposition(|o| o.is_hidden).map_or(0, |last| last + 1);
    let last_wrong = outcomes.iter().rposition(|o| o.error.length_m() > right_m && !o.is_hidden);
    if begin == outcomes.len() {
        return None;
    }
    match last_wrong {
        Some(last) if last + 1 == outcomes.len() => None,
        Some(last) if last >= begin => Some(last + 1 - begin),
        _ => Some(0),
    }
}

fn run_score(run: &[FlyOutcome], scale: Option<FlightScale>) -> RunScore {
    let between = |a, b| LocalFrame::at(a).enu_from_geodetic(b);
    let path_m: f64 = run.windows(2).map(|w| between(w[0].truth, w[1].truth).length_m()).sum();
    let (first, last) = (&run[0], &run[run.len() - 1]);
    let end_error_m = last.error.length_m();
    RunScore {
        image: first.image.clone(),
        frames: run.len(),
        path_m,
        end_error_m,
        end_error_share: end_error_m / path_m,
        scaled_end_error_share: scale.map(|s| s.end_error_m(run) / path_m),
    }
}
