//! `motions.csv`: a row per pair, from which others recompute the score.

use super::csv_file::{Decimals, Shortest, write_csv};
use super::error::TrialError;
use super::motions::MotionOutcome;
use overfly_core::registration::relative::MotionAnswer;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A row of `motions.csv`. `m00` to `m12` is the matrix that takes a point of b to a.
#[derive(Serialize, Default)]
struct MotionRow<'a> {
    image_a: &'a str,
    image_b: &'a str,
    overlap_percent: Shortest,
    status: &'static str,
    drift_px: Option<Decimals<6>>,
    elapsed_ms: Decimals<3>,
    covariance_xx_px2: Option<Decimals<9>>,
    covariance_xy_px2: Option<Decimals<9>>,
    covariance_yy_px2: Option<Decimals<9>>,
    m00: Option<Decimals<9>>,
    m01: Option<Decimals<9>>,
    m02: Option<Decimals<9>>,
    m10: Option<Decimals<9>>,
    m11: Option<Decimals<9>>,
    m12: Option<Decimals<9>>,
}

impl<'a> MotionRow<'a> {
    fn new(o: &'a MotionOutcome) -> Self {
        let row = Self {
            image_a: &o.pair.names[0],
            image_b: &o.pair.names[1],
            overlap_percent: Shortest(o.pair.overlap_percent),
            status: if o.drift_px.is_some() { "motion" } else { "no_motion" },
            drift_px: o.drift_px.map(Decimals),
            elapsed_ms: Decimals(o.elapsed_ms),
            ..Self::default()
        };
        let MotionAnswer::Motion(m) = &o.answer else { return row };
        let [[xx, xy], [_, yy]] = m.covariance_px2;
        let [[m00, m01, m02], [m10, m11, m12]] = m.a_from_b.map(|row| row.map(|v| Some(Decimals(v))));
        Self {
            covariance_xx_px2: Some(Decimals(xx)),
            covariance_xy_px2: Some(Decimals(xy)),
            covariance_yy_px2: Some(Decimals(yy)),
            m00,
            m01,
            m02,
            m10,
            m11,
            m12,
            ..row
        }
    }
}

/// Writes `motions.csv` into a folder, which is made if absent, and returns the path of the file.
///
/// # Errors
/// [`TrialError::Unwritable`].
pub fn write_motions(folder: &Path, outcomes: &[MotionOutcome]) -> Result<PathBuf, TrialError> {
    write_csv(folder, "motions.csv", outcomes.iter().map(MotionRow::new))
}
