//! `positions.csv`: a row per image, from which others can recompute the scores.

use super::outcome::FlyOutcome;
use crate::trial::csv_file::{Decimals, write_csv};
use crate::trial::error::TrialError;
use overfly_core::coupling::Mode;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A row of `positions.csv`.
#[derive(Serialize, Default)]
struct PositionRow<'a> {
    image: &'a str,
    time_s: Decimals<3>,
    mode: &'static str,
    source: &'static str,
    latitude_deg: Decimals<9>,
    longitude_deg: Decimals<9>,
    heading_deg: Decimals<4>,
    covariance_ee_m2: Decimals<6>,
    covariance_en_m2: Decimals<6>,
    covariance_nn_m2: Decimals<6>,
    fix_age_s: Option<Decimals<3>>,
    tiles_searched: usize,
    nominal_count: Decimals<3>,
    protection_level_m: Option<Decimals<3>>,
}

impl<'a> PositionRow<'a> {
    fn new(mode: Mode, o: &'a FlyOutcome, integrity_risk: f64) -> Self {
        let p = &o.position;
        Self {
            image: &o.image,
            time_s: Decimals(p.time_s),
            mode: mode.word(),
            source: p.source.word(),
            latitude_deg: Decimals(p.position.latitude_deg()),
            longitude_deg: Decimals(p.position.longitude_deg()),
            heading_deg: Decimals(p.heading_rad.to_degrees()),
            covariance_ee_m2: Decimals(p.covariance.ee_m2),
            covariance_en_m2: Decimals(p.covariance.en_m2),
            covariance_nn_m2: Decimals(p.covariance.nn_m2),
            fix_age_s: p.fix_age_s.map(Decimals),
            tiles_searched: p.tiles_searched,
            nominal_count: Decimals(p.nominal_count),
            protection_level_m: p.protection_level_m(integrity_risk).map(Decimals),
        }
    }
}

/// Writes `positions.csv` into a folder, which is made if absent, and returns the path of the file. The rows of one mode follow
/// those of the other. Protection levels are for `integrity_risk`.
///
/// # Errors
/// [`TrialError::Unwritable`].
pub fn write_positions(
    folder: &Path,
    flown: &[(Mode, Vec<FlyOutcome>)],
    integrity_risk: f64,
) -> Result<PathBuf, TrialError> {
    let rows = flown
        .iter()
        .flat_map(|(mode, outcomes)| outcomes.iter().map(move |o| PositionRow::new(*mode, o, integrity_risk)));
    write_csv(folder, "positions.csv", rows)
}
