//! `fixes.csv`: a row per frame, from which others recompute the score.

use super::csv_file::{Decimals, write_csv};
use super::error::TrialError;
use super::fixes::FixOutcome;
use overfly_flight::locate::{Answer, Reason};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A row of `fixes.csv`.
#[derive(Serialize, Default)]
struct FixRow<'a> {
    image: &'a str,
    status: &'static str,
    latitude_deg: Option<Decimals<9>>,
    longitude_deg: Option<Decimals<9>>,
    heading_deg: Option<Decimals<4>>,
    covariance_ee_m2: Option<Decimals<6>>,
    covariance_en_m2: Option<Decimals<6>>,
    covariance_nn_m2: Option<Decimals<6>>,
    elapsed_ms: Decimals<3>,
    reason: Option<Reason>,
    image_centre_latitude_deg: Option<Decimals<9>>,
    image_centre_longitude_deg: Option<Decimals<9>>,
    image_centre_covariance_ee_m2: Option<Decimals<6>>,
    image_centre_covariance_en_m2: Option<Decimals<6>>,
    image_centre_covariance_nn_m2: Option<Decimals<6>>,
    protection_level_m: Option<Decimals<3>>,
}

impl<'a> FixRow<'a> {
    fn new(o: &'a FixOutcome, integrity_risk: f64) -> Self {
        let row = Self { image: &o.image, elapsed_ms: Decimals(o.elapsed_ms), ..Self::default() };
        match &o.answer {
            Answer::Fix(f) => Self {
                status: "fix",
                latitude_deg: Some(Decimals(f.position.latitude_deg())),
                longitude_deg: Some(Decimals(f.position.longitude_deg())),
                heading_deg: Some(Decimals(f.heading.degrees())),
                covariance_ee_m2: Some(Decimals(f.covariance.ee_m2)),
                covariance_en_m2: Some(Decimals(f.covariance.en_m2)),
                covariance_nn_m2: Some(Decimals(f.covariance.nn_m2)),
                image_centre_latitude_deg: Some(Decimals(f.image_centre.latitude_deg())),
                image_centre_longitude_deg: Some(Decimals(f.image_centre.longitude_deg())),
                image_centre_covariance_ee_m2: Some(Decimals(f.image_centre_covariance.ee_m2)),
                image_centre_covariance_en_m2: Some(Decimals(f.image_centre_covariance.en_m2)),
                image_centre_covariance_nn_m2: Some(Decimals(f.image_centre_covariance.nn_m2)),
                protection_level_m: f.protection_level_m(integrity_risk).map(Decimals),
                ..row
            },
            Answer::NoFix(n) => Self { status: "no_fix", reason: Some(n.reason), ..row },
        }
    }
}

/// Writes `fixes.csv` into a folder, which is made if absent, and returns the path of the file. Protection levels are for
/// `integrity_risk`.
///
/// # Errors
/// [`TrialError::Unwritable`].
pub fn write_fixes(folder: &Path, outcomes: &[FixOutcome], integrity_risk: f64) -> Result<PathBuf, TrialError> {
    write_csv(folder, "fixes.csv", outcomes.iter().map(|outcome| FixRow::new(outcome, integrity_risk)))
}

#[cfg(test)]
mod tests {
    use super::super::csv_file::csv_text;
    use super::super::fix_score::tests::outcome;
    use super::*;

    #[test]
    fn writes_the_columns_others_read() {
        let covariance = [[1.5, 0.25], [0.25, 2.0]];
        let outcomes = [outcome(Some([0.0, 0.0]), covariance), outcome(None, covariance)];
        let csv = csv_text(outcomes.iter().map(|outcome| FixRow::new(outcome, 1e-3)));
        let lines: Vec<_> = csv.lines().collect();
        let header = "image,status,latitude_deg,longitude_deg,heading_deg,covariance_ee_m2,covariance_en_m2,covariance_nn_m2,elapsed_ms,reason,image_centre_latitude_deg,image_centre_longitude_deg,image_centre_covariance_ee_m2,image_centre_covariance_en_m2,image_centre_covariance_nn_m2,protection_level_m";
        assert_eq!(lines[0], header);
        assert_eq!(
            lines[1],
            "a.png,fix,48.000000000,15.000000000,12.0000,1.500000,0.250000,2.000000,10.000,,48.000000000,15.000000000,1.500000,0.250000,2.000000,6.002"
        );
        assert_eq!(lines[2], "a.png,no_fix,,,,,,,10.000,ambiguous,,,,,,");
    }
}
