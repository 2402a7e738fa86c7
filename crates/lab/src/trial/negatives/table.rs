//! `negatives.csv`: a row per trial, from which others recompute the score.

use super::NegativeOutcome;
use crate::trial::TrialError;
use crate::trial::fix_table::{quoted, write_table};
use overfly_flight::locate::Answer;
use std::path::{Path, PathBuf};

const HEADER: &str = "trial,kind,region,image,heading_known,prior_latitude_deg,prior_longitude_deg,searched_ratio,status,reason,score,log10_false_alarms,elapsed_ms";

/// Writes `negatives.csv` into a folder (made where absent) and returns its path. A trial that was skipped has the
/// status `skipped`.
///
/// # Errors
/// Where the folder or file cannot be written.
pub fn write_negatives(folder: &Path, outcomes: &[NegativeOutcome]) -> Result<PathBuf, TrialError> {
    write_table(folder, "negatives.csv", &to_csv(outcomes))
}

fn to_csv(outcomes: &[NegativeOutcome]) -> String {
    let mut text = format!("{HEADER}\n");
    for o in outcomes {
        let begun = format!("{},{},{},{},{}", o.number, o.kind.word(), o.region, quoted(&o.image), o.is_heading_known);
        let rest = o.search.as_ref().map_or(",,,skipped,,,,".into(), |s| {
            let (status, reason, score) = match &s.answer {
                Answer::Fix(fix) => ("fix", String::new(), Some(fix.score)),
                Answer::NoFix(no_fix) => {
                    let reason = serde_json::to_value(no_fix.reason).expect("a word");
                    ("no_fix", reason.as_str().expect("a word").to_owned(), no_fix.score)
                }
            };
            let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.4}"));
            format!(
                "{:.9},{:.9},{:.4},{status},{reason},{},{},{:.3}",
                s.prior.latitude_deg(),
                s.prior.longitude_deg(),
                s.searched_ratio,
                number(score),
                number(o.log10_false_alarms()),
                s.elapsed_ms
            )
        });
        text.push_str(&format!("{begun},{rest}\n"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::Kind;
    use super::super::score::tests::outcome;
    use super::*;

    #[test]
    fn every_row_has_every_column() {
        let outcomes = [
            outcome(0, Kind::Noise, 1.0, Some(-2.5), false),
            outcome(1, Kind::Noise, 10.0, Some(-8.0), true),
            outcome(2, Kind::Elsewhere, 100.0, None, false),
        ];
        let csv = to_csv(&outcomes);
        let lines: Vec<_> = csv.lines().collect();
        assert!(lines.iter().all(|l| l.split(',').count() == HEADER.split(',').count()), "{csv}");
        assert_eq!(lines[1], "0,noise,1,a.png,true,48.000000000,15.000000000,1.0000,no_fix,ambiguous,,-2.5000,30.000");
        assert_eq!(lines[3], "2,elsewhere,100,a.png,true,,,,skipped,,,,");
    }
}
