//! `evaluate motions`: relative registration on image pairs, scored against their true motion.

use super::{Pair, Pairs, Spread, TrialError};
use overfly_core::registration::relative::{MotionAnswer, MotionPrior, register};
use overfly_flight::frame::read_frame;
use rayon::prelude::*;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A motion is right within this distance at the image's centre, pixels of a.
pub const RIGHT_PX: f64 = 1.0;

/// What came of one pair.
#[derive(Debug, Clone)]
pub struct MotionOutcome {
    /// The pair.
    pub pair: Pair,
    /// The answer.
    pub answer: MotionAnswer,
    /// Between found and true place of b's centre, pixels of a; `None` without a motion.
    pub drift_px: Option<f64>,
    /// Whether that place lies in the answer's own 95 % ellipse; `None` without a motion.
    pub in_ellipse95: Option<bool>,
    /// From both decoded frames in memory to the answer, milliseconds.
    pub elapsed_ms: f64,
}

/// The summary of `evaluate motions`, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MotionScore {
    /// Pairs tried.
    pub pairs: usize,
    /// Registered and within a pixel.
    pub right: usize,
    /// Registered and not right.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Not registered.
    pub no_motion: usize,
    /// Share of the right motions whose own 95 % ellipse holds the truth.
    pub ellipse95_coverage: Option<f64>,
    /// The same by overlap, greatest first.
    pub by_overlap: Vec<OverlapScore>,
    /// Pairs registered at a time.
    pub threads: usize,
}

/// The score of all pairs of one overlap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OverlapScore {
    /// Share of the scene that both images show, per cent.
    pub overlap_percent: f64,
    /// Pairs tried.
    pub pairs: usize,
    /// Registered and within a pixel.
    pub right: usize,
    /// Of the right ones (a false one has no drift worth averaging), pixels.
    pub drift_px: Option<Spread>,
    /// From both decoded frames to the answer.
    pub elapsed_ms: Option<Spread>,
}

/// Registers every pair, `threads` at a time; `progress` is called after each.
///
/// # Errors
/// Where an image cannot be decoded. "No motion" is an outcome.
pub fn run_motions(
    pairs: &Pairs,
    threads: usize,
    progress: impl Fn() + Sync,
) -> Result<Vec<MotionOutcome>, TrialError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|_| TrialError::Option {
        name: "threads",
        value: threads as f64,
        expected: "a number of threads that this machine can start",
    })?;
    let one = |pair: &Pair| -> Result<MotionOutcome, TrialError> {
        let (a, b) = (read_frame(&pair.paths[0])?, read_frame(&pair.paths[1])?);
        let asked = Instant::now();
        let answer = register(&a, &b, &MotionPrior::default());
        let elapsed_ms = asked.elapsed().as_micros() as f64 / 1e3;
        let centre = [b.width_px() as f64 / 2.0, b.height_px() as f64 / 2.0];
        progress();
        Ok(MotionOutcome::of(pair.clone(), answer, centre, elapsed_ms))
    };
    pool.install(|| pairs.pairs.par_iter().map(one).collect())
}

/// Found minus true place of a point of b in a.
fn off_px(found: &[[f64; 3]; 2], truth: &[[f64; 3]; 2], at: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|row| {
        let place = |m: &[[f64; 3]; 2]| m[row][0] * at[0] + m[row][1] * at[1] + m[row][2];
        place(found) - place(truth)
    })
}

impl MotionOutcome {
    fn of(pair: Pair, answer: MotionAnswer, centre_of_b: [f64; 2], elapsed_ms: f64) -> Self {
        let scored = match &answer {
            MotionAnswer::Motion(m) => {
                let off = off_px(&m.a_from_b, &pair.a_from_b, centre_of_b);
                Some((off[0].hypot(off[1]), is_in_ellipse95(off, &m.covariance_px2)))
            }
            MotionAnswer::NoMotion { .. } => None,
        };
        Self { pair, answer, drift_px: scored.map(|s| s.0), in_ellipse95: scored.map(|s| s.1), elapsed_ms }
    }

    fn is_right(&self) -> bool {
        self.drift_px.is_some_and(|d| d <= RIGHT_PX)
    }
}

/// Whether an error of two dimensions lies in the 95 % ellipse of a covariance (chi-square of two degrees: 5.991).
pub fn is_in_ellipse95([x, y]: [f64; 2], [[xx, xy], [_, yy]]: &[[f64; 2]; 2]) -> bool {
    let determinant = xx * yy - xy * xy;
    *xx > 0.0 && determinant > 0.0 && (x * x * yy - 2.0 * x * y * xy + y * y * xx) / determinant <= 5.991
}

impl MotionScore {
    /// Scores outcomes.
    pub fn of(outcomes: &[MotionOutcome], threads: usize) -> Self {
        let mut overlaps: Vec<f64> = outcomes.iter().map(|o| o.pair.overlap_percent).collect();
        overlaps.sort_by(|a, b| b.total_cmp(a));
        overlaps.dedup();
        let count = |keep: fn(&MotionOutcome) -> bool| outcomes.iter().filter(|o| keep(o)).count();
        let (right, registered) = (count(MotionOutcome::is_right), count(|o| o.drift_px.is_some()));
        Self {
            pairs: outcomes.len(),
            right,
            wrong: registered - right,
            no_motion: outcomes.len() - registered,
            ellipse95_coverage: (right > 0)
                .then(|| count(|o| o.is_right() && o.in_ellipse95 == Some(true)) as f64 / right as f64),
            by_overlap: overlaps.into_iter().map(|overlap| OverlapScore::of(outcomes, overlap)).collect(),
            threads,
        }
    }
}

impl OverlapScore {
    fn of(outcomes: &[MotionOutcome], overlap_percent: f64) -> Self {
        let these: Vec<_> = outcomes.iter().filter(|o| o.pair.overlap_percent == overlap_percent).collect();
        let right: Vec<_> = these.iter().filter(|o| o.is_right()).collect();
        Self {
            overlap_percent,
            pairs: these.len(),
            right: right.len(),
            drift_px: Spread::of(right.iter().filter_map(|o| o.drift_px).collect()),
            elapsed_ms: Spread::of(these.iter().map(|o| o.elapsed_ms).collect()),
        }
    }
}

/// Writes `motions.csv` (a row per pair) into a folder, made where absent, and returns its path.
///
/// # Errors
/// Where the folder or file cannot be written.
pub fn write_motions(folder: &Path, outcomes: &[MotionOutcome]) -> Result<PathBuf, TrialError> {
    let path = folder.join("motions.csv");
    let write = || -> Result<(), csv::Error> {
        std::fs::create_dir_all(folder)?;
        let mut file = csv::Writer::from_path(&path)?;
        file.write_record([
            "image_a",
            "image_b",
            "overlap_percent",
            "status",
            "drift_px",
            "elapsed_ms",
            "covariance_xx_px2",
            "covariance_xy_px2",
            "covariance_yy_px2",
            "m00",
            "m01",
            "m02",
            "m10",
            "m11",
            "m12",
        ])?;
        for o in outcomes {
            let mut row = vec![o.pair.names[0].clone(), o.pair.names[1].clone(), o.pair.overlap_percent.to_string()];
            let status = if o.drift_px.is_some() { "motion" } else { "no_motion" };
            row.extend([
                status.into(),
                o.drift_px.map_or(String::new(), |d| format!("{d:.6}")),
                format!("{:.3}", o.elapsed_ms),
            ]);
            match &o.answer {
                MotionAnswer::Motion(m) => {
                    let [[xx, xy], [_, yy]] = m.covariance_px2;
                    row.extend([xx, xy, yy].map(|v| format!("{v:.9}")));
                    row.extend(m.a_from_b.iter().flatten().map(|v| format!("{v:.9}")));
                }
                MotionAnswer::NoMotion { .. } => row.extend(std::iter::repeat_n(String::new(), 9)),
            }
            file.write_record(&row)?;
        }
        file.into_inner().map_err(|e| csv::Error::from(e.into_error()))?.flush()?;
        Ok(())
    };
    write().map_err(|e| TrialError::Unwritable { path: path.clone(), cause: std::io::Error::other(e) })?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::registration::relative::{Motion, NoMotionReason};

    fn outcome(overlap_percent: f64, shift_px: Option<f64>) -> MotionOutcome {
        let truth = [[1.0, 0.0, 10.0], [0.0, 1.0, 0.0]];
        let found = shift_px.map(|s| [[1.0, 0.0, 10.0 + s], [0.0, 1.0, 0.0]]);
        let answer = match found {
            Some(a_from_b) => MotionAnswer::Motion(Motion {
                a_from_b,
                rotation_deg: 0.0,
                scale: 1.0,
                displacement_px: [10.0, 0.0],
                covariance_px2: [[0.01, 0.0], [0.0, 0.01]],
                rotation_sigma_deg: 0.05,
                scale_sigma_ratio: 0.001,
                inliers: 40,
                matches: 50,
                log10_false_alarms: -40.0,
            }),
            None => MotionAnswer::NoMotion { reason: NoMotionReason::TooFewAgreeingMatches, detail: "too few".into() },
        };
        let pair =
            Pair { names: ["a".into(), "b".into()], paths: ["a".into(), "b".into()], overlap_percent, a_from_b: truth };
        MotionOutcome::of(pair, answer, [256.0, 256.0], 5.0)
    }

    #[test]
    fn counts_right_within_a_pixel_by_overlap() {
        let score = MotionScore::of(
            &[outcome(50.0, Some(0.25)), outcome(95.0, Some(0.5)), outcome(50.0, Some(1.5)), outcome(50.0, None)],
            1,
        );
        assert_eq!((score.pairs, score.right, score.wrong, score.no_motion), (4, 2, 1, 1));
        assert_eq!(score.by_overlap[0].overlap_percent, 95.0);
        assert_eq!((score.by_overlap[1].pairs, score.by_overlap[1].right), (3, 1));
        assert!((score.by_overlap[1].drift_px.unwrap().median - 0.25).abs() < 1e-9);
        // sqrt(5.991) of one sigma of 0.1 px is 0.245 px: neither 0.25 nor 0.5 px lies within.
        assert_eq!(score.ellipse95_coverage, Some(0.0));
        assert_eq!(outcome(50.0, Some(0.24)).in_ellipse95, Some(true));
    }

    #[test]
    fn drift_is_measured_at_the_centre() {
        // A turn of 0.01 rad about the corner moves the centre (100, 0) by 1 px.
        let turned = [[0.01f64.cos(), -(0.01f64.sin()), 0.0], [0.01f64.sin(), 0.01f64.cos(), 0.0]];
        let still = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let [x, y] = off_px(&turned, &still, [100.0, 0.0]);
        assert!((x.hypot(y) - 1.0).abs() < 1e-4);
    }
}
