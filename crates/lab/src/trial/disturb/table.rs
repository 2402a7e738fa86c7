//! `disturbed.csv`: a row per disturbed frame.

use super::kind::DisturbanceKind;
use super::trial::DisturbedOutcome;
use crate::trial::csv_file::{Decimals, write_csv};
use crate::trial::error::TrialError;
use overfly_flight::locate::{Answer, Reason};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A row of `disturbed.csv`.
#[derive(Serialize, Default)]
struct DisturbedRow<'a> {
    kind: Option<DisturbanceKind>,
    size: Decimals<4>,
    image: &'a str,
    status: &'static str,
    reason: Option<Reason>,
    nadir_error_east_m: Option<Decimals<3>>,
    nadir_error_north_m: Option<Decimals<3>>,
    nadir_squared_mahalanobis: Option<Decimals<3>>,
    centre_error_east_m: Option<Decimals<3>>,
    centre_error_north_m: Option<Decimals<3>>,
    centre_squared_mahalanobis: Option<Decimals<3>>,
    score: Option<Decimals<2>>,
    inliers: Option<usize>,
    log10_false_alarms: Option<Decimals<2>>,
}

impl<'a> DisturbedRow<'a> {
    fn new(outcome: &'a DisturbedOutcome) -> Self {
        let row =
            Self { kind: Some(outcome.kind), size: Decimals(outcome.size), image: &outcome.image, ..Self::default() };
        match (&outcome.answer, outcome.errors) {
            (Answer::Fix(fix), Some(errors)) => Self {
                status: "fix",
                nadir_error_east_m: Some(Decimals(errors.nadir.east_m)),
                nadir_error_north_m: Some(Decimals(errors.nadir.north_m)),
                nadir_squared_mahalanobis: Some(Decimals(fix.covariance.squared_mahalanobis(errors.nadir))),
                centre_error_east_m: Some(Decimals(errors.centre.east_m)),
                centre_error_north_m: Some(Decimals(errors.centre.north_m)),
                centre_squared_mahalanobis: Some(Decimals(
                    fix.image_centre_covariance.squared_mahalanobis(errors.centre),
                )),
                score: Some(Decimals(fix.score)),
                inliers: Some(fix.inliers),
                log10_false_alarms: fix.log10_false_alarms.map(Decimals),
                ..row
            },
            (Answer::NoFix(none), _) => Self { status: "no_fix", reason: Some(none.reason), ..row },
            (Answer::Fix(_), None) => row,
        }
    }
}

/// Writes `disturbed.csv` into a folder, which is made if absent, and returns the path of the file.
///
/// # Errors
/// [`TrialError::Unwritable`].
pub fn write_disturbed(folder: &Path, outcomes: &[DisturbedOutcome]) -> Result<PathBuf, TrialError> {
    write_csv(folder, "disturbed.csv", outcomes.iter().map(DisturbedRow::new))
}
