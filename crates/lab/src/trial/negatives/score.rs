//! `NegativeScore`: how often the search accepted a false fix, what this proves about the rate, and whether the
//! stated false alarms are true.

use super::kind::NegativeKind;
use super::outcome::NegativeOutcome;
use super::probability::{ProbabilityBin, probability_bins};
use super::repeating::PatternKind;
use crate::trial::quantiles::Quantiles;
use crate::trial::rate_bound::{lower95, upper95};
use serde::Serialize;

/// Evidence is compared down to this power of ten.
const DEEPEST_LOG10: i32 = -8;

/// The summary of `evaluate negatives`, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NegativeScore {
    /// Number of searches.
    pub trials: usize,
    /// Trials for which the layer has no room.
    pub skipped: usize,
    /// Searches that accepted a false fix.
    pub accepted: usize,
    /// Of the accepted: the true place outside their own 99.99 % ellipse.
    pub outside: usize,
    /// Searches that found the frame's true place.
    pub right: usize,
    /// One-sided 95 % upper bound on the rate of false fixes among such searches.
    pub false_rate_upper95: f64,
    /// Results by size of the region.
    pub by_region: Vec<RegionScore>,
    /// Results by kind and size of the region.
    pub by_kind: Vec<KindScore>,
    /// Results by pattern, of the kinds in which map and frame repeat themselves.
    pub by_pattern: Vec<PatternScore>,
    /// Stated false alarms beside those observed, over all searches of frames whose ground the region does not show.
    pub calibration: Vec<CalibrationStep>,
    /// Stated probabilities that the best place is wrong beside the share that is, over repeating ground whose true place was searched.
    pub probabilities: Vec<ProbabilityBin>,
    /// Durations from the frame in memory to the answer, milliseconds.
    pub elapsed_ms: Option<Quantiles>,
    /// Searches at the same time.
    pub threads: usize,
}

/// All searches of regions of one size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegionScore {
    /// Requested area, in usual squares.
    pub region: f64,
    /// Area with imagery, in usual squares.
    pub searched_ratio: Option<Quantiles>,
    /// Number of searches.
    pub trials: usize,
    /// Trials for which the layer has no room.
    pub skipped: usize,
    /// Searches that accepted a false fix.
    pub accepted: usize,
    /// Of the accepted: the true place outside their own 99.99 % ellipse.
    pub outside: usize,
    /// Searches that found the frame's true place.
    pub right: usize,
    /// One-sided 95 % upper bound on the rate.
    pub false_rate_upper95: f64,
    /// Stated false alarms beside those observed.
    pub calibration: Vec<CalibrationStep>,
}

/// All searches of one kind over regions of one size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KindScore {
    /// The reason why a fix is false.
    pub kind: NegativeKind,
    /// Requested area, in usual squares.
    pub region: f64,
    /// Number of searches.
    pub trials: usize,
    /// Trials for which the layer has no room.
    pub skipped: usize,
    /// Searches that accepted a false fix.
    pub accepted: usize,
    /// Of the accepted: the true place outside their own 99.99 % ellipse.
    pub outside: usize,
    /// Searches that found the frame's true place.
    pub right: usize,
    /// One-sided 95 % upper bound on the rate.
    pub false_rate_upper95: f64,
    /// The strongest evidence that any search stated.
    pub least_log10_false_alarms: Option<f64>,
}

/// All searches over one pattern.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PatternScore {
    /// What repeats.
    pub pattern: PatternKind,
    /// Number of searches.
    pub trials: usize,
    /// Searches that accepted a false fix.
    pub accepted: usize,
    /// Of the accepted: the true place outside their own 99.99 % ellipse.
    pub outside: usize,
    /// Searches that found the frame's true place.
    pub right: usize,
    /// One-sided 95 % upper bound on the rate of false fixes.
    pub false_rate_upper95: f64,
}

/// Searches that stated fewer false alarms than a power of ten, and how many there may be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CalibrationStep {
    /// The exponent x of 10^x.
    pub log10_false_alarms: i32,
    /// Searches that stated less.
    pub observed: usize,
    /// Greatest expected number of such searches: searches times 10^x.
    pub expected: f64,
    /// One-sided 95 % lower bound on the true rate of such statements.
    pub rate_lower95: f64,
    /// One-sided 95 % upper bound on the same rate.
    pub rate_upper95: f64,
    /// Whether the statement can be true: 10^x is at least `rate_lower95`.
    pub is_kept: bool,
}

/// Counts of some outcomes.
struct OutcomeCounts {
    trials: usize,
    skipped: usize,
    accepted: usize,
    outside: usize,
    right: usize,
}

impl OutcomeCounts {
    fn from_outcomes(outcomes: &[&NegativeOutcome]) -> Self {
        let skipped = outcomes.iter().filter(|o| o.search.is_none()).count();
        let accepted = outcomes.iter().filter(|o| o.is_accepted()).count();
        let outside = outcomes.iter().filter(|o| o.is_outside()).count();
        let right = outcomes.iter().filter(|o| o.is_right()).count();
        Self { trials: outcomes.len() - skipped, skipped, accepted, outside, right }
    }

    fn false_rate_upper95(&self) -> f64 {
        upper95(self.accepted, self.trials)
    }
}

impl NegativeScore {
    /// Scores outcomes.
    pub fn from_outcomes(outcomes: &[NegativeOutcome], threads: usize) -> Self {
        let all: Vec<&NegativeOutcome> = outcomes.iter().collect();
        let mut regions: Vec<f64> = all.iter().map(|o| o.region).collect();
        regions.sort_by(f64::total_cmp);
        regions.dedup();
        let mut kinds: Vec<NegativeKind> = all.iter().map(|o| o.kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let count = OutcomeCounts::from_outcomes(&all);
        let chosen = |keep: &dyn Fn(&NegativeOutcome) -> bool| -> Vec<&NegativeOutcome> {
            all.iter().copied().filter(|o| keep(o)).collect()
        };
        let elapsed = all.iter().filter_map(|o| Some(o.search.as_ref()?.elapsed_ms)).collect();
        Self {
            trials: count.trials,
            skipped: count.skipped,
            accepted: count.accepted,
            outside: count.outside,
            right: count.right,
            false_rate_upper95: count.false_rate_upper95(),
            by_region: regions.iter().map(|&r| RegionScore::from_outcomes(r, &chosen(&|o| o.region == r))).collect(),
            by_kind: kinds
                .iter()
                .flat_map(|&k| regions.iter().map(move |&r| (k, r)))
                .map(|(k, r)| KindScore::from_outcomes(k, r, &chosen(&|o| o.kind == k && o.region == r)))
                .filter(|s| s.trials + s.skipped > 0)
                .collect(),
            by_pattern: PatternKind::ALL
                .into_iter()
                .map(|p| PatternScore::from_outcomes(p, &chosen(&|o| o.pattern.is_some_and(|d| d.kind == p))))
                .filter(|s| s.trials > 0)
                .collect(),
            calibration: calibration(&all),
            probabilities: probability_bins(&all),
            elapsed_ms: Quantiles::from_values(elapsed),
            threads,
        }
    }
}

impl RegionScore {
    fn from_outcomes(region: f64, outcomes: &[&NegativeOutcome]) -> Self {
        let count = OutcomeCounts::from_outcomes(outcomes);
        let searched = outcomes.iter().filter_map(|o| Some(o.search.as_ref()?.searched_ratio)).collect();
        Self {
            region,
            searched_ratio: Quantiles::from_values(searched),
            trials: count.trials,
            skipped: count.skipped,
            accepted: count.accepted,
            outside: count.outside,
            right: count.right,
            false_rate_upper95: count.false_rate_upper95(),
            calibration: calibration(outcomes),
        }
    }
}

impl KindScore {
    fn from_outcomes(kind: NegativeKind, region: f64, outcomes: &[&NegativeOutcome]) -> Self {
        let count = OutcomeCounts::from_outcomes(outcomes);
        let evidence = outcomes.iter().filter_map(|o| o.log10_false_alarms());
        Self {
            kind,
            region,
            trials: count.trials,
            skipped: count.skipped,
            accepted: count.accepted,
            outside: count.outside,
            right: count.right,
            false_rate_upper95: count.false_rate_upper95(),
            least_log10_false_alarms: evidence.reduce(f64::min),
        }
    }
}

impl PatternScore {
    fn from_outcomes(pattern: PatternKind, outcomes: &[&NegativeOutcome]) -> Self {
        let count = OutcomeCounts::from_outcomes(outcomes);
        Self {
            pattern,
            trials: count.trials,
            accepted: count.accepted,
            outside: count.outside,
            right: count.right,
            false_rate_upper95: count.false_rate_upper95(),
        }
    }
}

/// The calibration steps, from 10^-1 down.
fn calibration(outcomes: &[&NegativeOutcome]) -> Vec<CalibrationStep> {
    let outcomes: Vec<&NegativeOutcome> = outcomes.iter().copied().filter(|o| !o.kind.shows_its_ground()).collect();
    let trials = OutcomeCounts::from_outcomes(&outcomes).trials;
    let stated: Vec<f64> = outcomes.iter().filter_map(|o| o.log10_false_alarms()).collect();
    (DEEPEST_LOG10..=-1)
        .rev()
        .map(|x| {
            let observed = stated.iter().filter(|s| **s < f64::from(x)).count();
            let rate_lower95 = lower95(observed, trials);
            CalibrationStep {
                log10_false_alarms: x,
                observed,
                expected: trials as f64 * 10f64.powi(x),
                rate_lower95,
                rate_upper95: upper95(observed, trials),
                is_kept: 10f64.powi(x) >= rate_lower95,
            }
        })
        .collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::trial::fix_score::tests::outcome as fix_outcome;
    use crate::trial::negatives::outcome::NegativeSearch;

    /// A trial that stated `log10`, and was accepted, rejected or skipped.
    pub(crate) fn outcome(
        number: usize,
        kind: NegativeKind,
        region: f64,
        log10: Option<f64>,
        is_fix: bool,
    ) -> NegativeOutcome {
        let mut made = fix_outcome(is_fix.then_some([0.0, 0.0]), [[1.0, 0.0], [0.0, 1.0]]);
        match &mut made.answer {
            overfly_flight::locate::Answer::Fix(fix) => fix.log10_false_alarms = log10,
            overfly_flight::locate::Answer::NoFix(no_fix) => no_fix.log10_false_alarms = log10,
        }
        let search = NegativeSearch {
            prior: made.prior,
            searched_ratio: region,
            answer: made.answer,
            best: None,
            elapsed_ms: 30.0,
        };
        NegativeOutcome {
            number,
            kind,
            region,
            image: "a.png".into(),
            is_heading_known: true,
            place: None,
            pattern: None,
            search: (kind != NegativeKind::Elsewhere).then_some(search),
        }
    }

    #[test]
    fn counts_by_kind_and_region_and_bounds_the_rate() {
        let outcomes = [
            outcome(0, NegativeKind::Noise, 1.0, None, false),
            outcome(1, NegativeKind::Noise, 10.0, Some(-2.5), false),
            outcome(2, NegativeKind::Mirrored, 1.0, Some(-7.0), true),
            outcome(3, NegativeKind::Elsewhere, 10.0, None, false),
            outcome(4, NegativeKind::Scaled, 1.0, Some(-50.0), false),
        ];
        let score = NegativeScore::from_outcomes(&outcomes, 2);
        assert_eq!((score.trials, score.skipped, score.accepted), (4, 1, 1));
        let kinds: Vec<_> = score.by_kind.iter().map(|k| (k.kind, k.region, k.trials, k.accepted)).collect();
        let expected = [
            (NegativeKind::Elsewhere, 10.0, 0, 0),
            (NegativeKind::Mirrored, 1.0, 1, 1),
            (NegativeKind::Noise, 1.0, 1, 0),
            (NegativeKind::Noise, 10.0, 1, 0),
            (NegativeKind::Scaled, 1.0, 1, 0),
        ];
        assert_eq!(kinds, expected);
        assert_eq!(score.by_region.iter().map(|r| (r.trials, r.skipped)).collect::<Vec<_>>(), [(3, 0), (1, 1)]);
        assert_eq!(score.by_kind[3].least_log10_false_alarms, Some(-2.5));
        let observed: Vec<_> = score.calibration.iter().map(|c| c.observed).collect();
        assert_eq!(observed, [2, 2, 1, 1, 1, 1, 0, 0]);
        // One statement of 10^-7 in three searches contradicts 10^-6.
        assert!(!score.calibration[5].is_kept && score.calibration[6].is_kept);
    }
}
