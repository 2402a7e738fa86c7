//! `positions.csv`: a row per image, from which others can recompute the scores.

use super::FlyOutcome;
use crate::trial::TrialError;
use crate::trial::fix_table::{quoted, write_table};
use overfly_core::coupling::Mode;
use std::path::{Path, PathBuf};

const HEADER: &str = "image,time_s,mode,source,latitude_deg,longitude_deg,heading_deg,covariance_ee_m2,covariance_en_m2,\
covariance_nn_m2,fix_age_s,tiles_searched,nominal_count";

/// Writes `positions.csv` into a folder, made where absent, and returns its path: the rows of one mode after the other.
///
/// # Errors
/// Where it cannot be written.
pub fn write_positions(folder: &Path, flown: &[(Mode, Vec<FlyOutcome>)]) -> Result<PathBuf, TrialError> {
    let rows = flown.iter().flat_map(|(mode, outcomes)| outcomes.iter().map(|o| row(*mode, o)));
    let text: String = std::iter::once(format!("{HEADER}\n")).chain(rows).collect();
    write_table(folder, "positions.csv", &text)
}

fn row(mode: Mode, o: &FlyOutcome) -> String {
    let p = &o.position;
    let [[ee, en], [_, nn]] = p.covariance_m2;
    format!(
        "{},{:.3},{},{},{:.9},{:.9},{:.4},{ee:.6},{en:.6},{nn:.6},{},{},{:.3}\n",
        quoted(&o.image),
        p.time_s,
        mode.word(),
        p.source.word(),
        p.position.latitude_deg(),
        p.position.longitude_deg(),
        p.heading_rad.to_degrees(),
        p.fix_age_s.map_or(String::new(), |s| format!("{s:.3}")),
        p.tiles_searched,
        p.nominal_count,
    )
}
