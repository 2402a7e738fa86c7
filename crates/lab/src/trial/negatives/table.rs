//! `negatives.csv`: a row per trial, from which others recompute the score.

use super::outcome::NegativeOutcome;
use super::repeating::PatternKind;
use crate::trial::csv_file::{Decimals, Shortest, write_csv};
use crate::trial::error::TrialError;
use overfly_flight::locate::{Answer, Reason};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A row of `negatives.csv`.
#[derive(Serialize, Default)]
struct NegativeRow<'a> {
    trial: usize,
    kind: &'static str,
    region: Shortest,
    image: &'a str,
    pattern: Option<PatternKind>,
    period_m: Option<Decimals<2>>,
    heading_known: bool,
    prior_latitude_deg: Option<Decimals<9>>,
    prior_longitude_deg: Option<Decimals<9>>,
    searched_ratio: Option<Decimals<4>>,
    status: &'static str,
    reason: Option<Reason>,
    error_m: Option<Decimals<3>>,
    squared_mahalanobis: Option<Decimals<3>>,
    score: Option<Decimals<4>>,
    log10_false_alarms: Option<Decimals<4>>,
    false_fix_probability: Option<Shortest>,
    best_error_m: Option<Decimals<3>>,
    best_false_probability: Option<Shortest>,
    rivals: Option<usize>,
    least_t_score: Option<Decimals<3>>,
    blocks: Option<usize>,
    elapsed_ms: Option<Decimals<3>>,
}

impl<'a> NegativeRow<'a> {
    fn new(o: &'a NegativeOutcome) -> Self {
        let skipped = Self {
            trial: o.number,
            kind: o.kind.word(),
            region: Shortest(o.region),
            image: &o.image,
            pattern: o.pattern.map(|p| p.kind),
            period_m: o.pattern.map(|p| Decimals(p.period_m)),
            heading_known: o.is_heading_known,
            status: "skipped",
            ..Self::default()
        };
        let Some(search) = &o.search else { return skipped };
        let (status, reason, score, probability) = match &search.answer {
            Answer::Fix(fix) => ("fix", None, Some(fix.score), Some(Shortest(fix.false_fix_probability))),
            Answer::NoFix(no_fix) => ("no_fix", Some(no_fix.reason), no_fix.score, None),
        };
        Self {
            prior_latitude_deg: Some(Decimals(search.prior.latitude_deg())),
            prior_longitude_deg: Some(Decimals(search.prior.longitude_deg())),
            searched_ratio: Some(Decimals(search.searched_ratio)),
            status,
            reason,
            error_m: o.error_m().map(Decimals),
            squared_mahalanobis: o.squared_mahalanobis().map(Decimals),
            score: score.map(Decimals),
            log10_false_alarms: o.log10_false_alarms().map(Decimals),
            false_fix_probability: probability,
            best_error_m: o.best_error_m().map(Decimals),
            best_false_probability: search.best.as_ref().map(|best| Shortest(best.false_fix_probability)),
            rivals: search.best.as_ref().and_then(|best| best.rivals),
            least_t_score: search.best.as_ref().and_then(|best| best.least_t_score).map(Decimals),
            blocks: search.best.as_ref().and_then(|best| best.blocks),
            elapsed_ms: Some(Decimals(search.elapsed_ms)),
            ..skipped
        }
    }
}

/// Writes `negatives.csv` into a folder, which is made if absent, and returns the path of the file. A trial that was skipped has
/// the status `skipped`.
///
/// # Errors
/// [`TrialError::Unwritable`].
pub fn write_negatives(folder: &Path, outcomes: &[NegativeOutcome]) -> Result<PathBuf, TrialError> {
    write_csv(folder, "negatives.csv", outcomes.iter().map(NegativeRow::new))
}

#[cfg(test)]
mod tests {
    use super::super::kind::NegativeKind;
    use super::super::score::tests::outcome;
    use super::*;
    use crate::trial::csv_file::csv_text;

    #[test]
    fn every_row_has_every_column() {
        let outcomes = [
            outcome(0, NegativeKind::Noise, 1.0, Some(-2.5), false),
            outcome(1, NegativeKind::Noise, 10.0, Some(-8.0), true),
            outcome(2, NegativeKind::Elsewhere, 100.0, None, false),
        ];
        let csv = csv_text(outcomes.iter().map(NegativeRow::new));
        let lines: Vec<_> = csv.lines().collect();
        let header = "trial,kind,region,image,pattern,period_m,heading_known,prior_latitude_deg,prior_longitude_deg,searched_ratio,status,reason,error_m,squared_mahalanobis,score,log10_false_alarms,false_fix_probability,best_error_m,best_false_probability,rivals,least_t_score,blocks,elapsed_ms";
        assert_eq!(lines[0], header);
        assert_eq!(
            lines[1],
            "0,noise,1,a.png,,,true,48.000000000,15.000000000,1.0000,no_fix,ambiguous,,,,-2.5000,,,,,,,30.000"
        );
        assert_eq!(lines[3], "2,elsewhere,100,a.png,,,true,,,,skipped,,,,,,,,,,,,");
    }
}
