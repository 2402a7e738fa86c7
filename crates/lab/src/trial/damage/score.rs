//! `DamageScore`: the trials counted by format and change.

use super::change::FileChange;
use super::format::FrameFormat;
use super::outcome::{DamageOutcome, DamageResult};
use crate::trial::rate_bound::upper95;
use serde::Serialize;
use std::collections::BTreeMap;

/// The counts of one change in one format.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DamageScoreRow {
    /// The format.
    pub format: FrameFormat,
    /// The change.
    pub change: FileChange,
    /// Trials.
    pub trials: usize,
    /// Files that were refused.
    pub refused: usize,
    /// Files with the same pixels as before.
    pub unchanged: usize,
    /// Other pixels, no fix.
    pub no_fix: usize,
    /// Other pixels, a fix within `right_m` of the truth.
    pub right: usize,
    /// Other pixels, a fix farther off.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Of the false ones: the truth outside their own 99.99 % ellipse.
    pub outside: usize,
}

/// The score of a trial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DamageScore {
    /// Trials whose change damages.
    pub trials: usize,
    /// Of these: refused.
    pub refused: usize,
    /// Of these: the same pixels as before.
    pub unchanged: usize,
    /// Of these: no fix.
    pub no_fix: usize,
    /// Of these: right fixes.
    pub right: usize,
    /// Of these: false fixes.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Of the false ones: the truth outside their own 99.99 % ellipse.
    pub outside: usize,
    /// What the rate of false fixes lies below with 95 % confidence.
    pub false_rate_upper95: f64,
    /// Trials whose change is harmless.
    pub harmless: usize,
    /// Of these: not read as before.
    pub harmless_lost: usize,
    /// The greatest error of a right fix, metres.
    pub right_m: f64,
    /// By format and change.
    pub rows: Vec<DamageScoreRow>,
}

impl DamageScore {
    /// Counts outcomes; a fix within `right_m` of the truth is right.
    pub fn from_outcomes(outcomes: &[DamageOutcome], right_m: f64) -> Self {
        let mut rows = BTreeMap::new();
        for outcome in outcomes {
            let (format, change) = (outcome.format, outcome.change);
            let row = rows.entry((format, change)).or_insert(DamageScoreRow {
                format,
                change,
                trials: 0,
                refused: 0,
                unchanged: 0,
                no_fix: 0,
                right: 0,
                wrong: 0,
                outside: 0,
            });
            row.trials += 1;
            row.outside += usize::from(outcome.is_outside(right_m));
            match outcome.result {
                DamageResult::Refused(_) => row.refused += 1,
                DamageResult::Unchanged => row.unchanged += 1,
                DamageResult::NoFix => row.no_fix += 1,
                DamageResult::Fix { .. } if outcome.is_false(right_m) => row.wrong += 1,
                DamageResult::Fix { .. } => row.right += 1,
            }
        }
        let rows: Vec<DamageScoreRow> = rows.into_values().collect();
        let (harmless, damaged): (Vec<_>, Vec<_>) = rows.iter().partition(|row| row.change.is_harmless());
        let sum = |of: fn(&&DamageScoreRow) -> usize| damaged.iter().map(of).sum::<usize>();
        let (trials, wrong) = (sum(|r| r.trials), sum(|r| r.wrong));
        Self {
            trials,
            refused: sum(|r| r.refused),
            unchanged: sum(|r| r.unchanged),
            no_fix: sum(|r| r.no_fix),
            right: sum(|r| r.right),
            wrong,
            outside: sum(|r| r.outside),
            false_rate_upper95: upper95(wrong, trials),
            harmless: harmless.iter().map(|r| r.trials).sum(),
            harmless_lost: harmless.iter().map(|r| r.trials - r.unchanged).sum(),
            right_m,
            rows,
        }
    }
}
