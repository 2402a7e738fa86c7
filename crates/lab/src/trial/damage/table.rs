//! `damage.csv`: a row per trial, from which others recompute the score.

use super::outcome::{DamageOutcome, DamageResult};
use crate::trial::csv_file::{Decimals, write_csv};
use crate::trial::error::TrialError;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A row of `damage.csv`.
#[derive(Serialize, Default)]
struct DamageRow<'a> {
    trial: usize,
    format: &'static str,
    change: &'static str,
    image: &'a str,
    status: &'static str,
    code: &'static str,
    error_m: Option<Decimals<2>>,
    squared_mahalanobis: Option<Decimals<3>>,
    changed_share: Decimals<4>,
}

impl<'a> DamageRow<'a> {
    fn new(o: &'a DamageOutcome) -> Self {
        let (status, code, fix) = match o.result {
            DamageResult::Refused(code) => ("refused", code, None),
            DamageResult::Unchanged => ("unchanged", "", None),
            DamageResult::NoFix => ("no_fix", "", None),
            DamageResult::Fix { error_m, squared_mahalanobis } => ("fix", "", Some((error_m, squared_mahalanobis))),
        };
        let (error_m, squared_mahalanobis) = fix.map(|(error, square)| (Decimals(error), Decimals(square))).unzip();
        let (format, change) = (o.format.word(), o.change.word());
        let changed_share = Decimals(o.changed_share);
        Self {
            trial: o.number,
            format,
            change,
            image: &o.image,
            status,
            code,
            error_m,
            squared_mahalanobis,
            changed_share,
        }
    }
}

/// Writes `damage.csv` into a folder, which is made if absent, and returns the path of the file.
///
/// # Errors
/// [`TrialError`] if the file cannot be written.
pub fn write_damage(folder: &Path, outcomes: &[DamageOutcome]) -> Result<PathBuf, TrialError> {
    write_csv(folder, "damage.csv", outcomes.iter().map(DamageRow::new))
}
