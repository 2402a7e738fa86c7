//! `evaluate motions`: relative registration of image pairs, scored against their true motion.

use super::error::TrialError;
use super::pairs::{ImagePair, ImagePairs};
use super::quantiles::Quantiles;
use overfly_core::registration::relative::{MotionAnswer, MotionPrior, register};
use overfly_flight::frame::read_frame;
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

/// Greatest error of a right motion at the centre of the image, pixels of a.
pub const RIGHT_PX: f64 = 1.0;

/// The result of one pair.
#[derive(Debug, Clone)]
pub struct MotionOutcome {
    /// The pair.
    pub pair: ImagePair,
    /// The answer.
    pub answer: MotionAnswer,
    /// Distance between found and true place of b's centre, pixels of a; `None` without a motion.
    pub drift_px: Option<f64>,
    /// Whether the answer's own 95 % ellipse contains the true place; `None` without a motion.
    pub in_ellipse95: Option<bool>,
    /// Duration from both decoded frames in memory to the answer, milliseconds.
    pub elapsed_ms: f64,
}

/// The summary of `evaluate motions`, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MotionScore {
    /// Pairs tried.
    pub pairs: usize,
    /// Registered pairs with an error of at most a pixel.
    pub right: usize,
    /// Registered pairs with a greater error.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Pairs without a motion.
    pub no_motion: usize,
    /// Share of the right motions whose own 95 % ellipse contains the truth.
    pub ellipse95_coverage: Option<f64>,
    /// Results by overlap, greatest first.
    pub by_overlap: Vec<OverlapScore>,
    /// Pairs registered at the same time.
    pub threads: usize,
}

/// The score of the pairs of one overlap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OverlapScore {
    /// Share of the scene that both images show, per cent.
    pub overlap_percent: f64,
    /// Pairs tried.
    pub pairs: usize,
    /// Registered pairs with an error of at most a pixel.
    pub right: usize,
    /// Drifts of the right motions, pixels. False motions would distort the average.
    pub drift_px: Option<Quantiles>,
    /// Durations from both decoded frames to the answer, milliseconds.
    pub elapsed_ms: Option<Quantiles>,
}

/// Registers every pair, `threads` at the same time; calls `progress` after each.
///
/// # Errors
/// If an image cannot be decoded, or the threads cannot be started. "No motion" is an outcome.
pub fn run_motions(
    pairs: &ImagePairs,
    threads: usize,
    progress: impl Fn() + Sync,
) -> Result<Vec<MotionOutcome>, TrialError> {
    let pool = thread_pool(threads)?;
    let one = |pair: &ImagePair| -> Result<MotionOutcome, TrialError> {
        let (a, b) = (read_frame(&pair.paths[0])?, read_frame(&pair.paths[1])?);
        let asked = Instant::now();
        let answer = register(&a, &b, &MotionPrior::default());
        let elapsed_ms = asked.elapsed().as_micros() as f64 / 1e3;
        let centre = [b.width_px() as f64 / 2.0, b.height_px() as f64 / 2.0];
        progress();
        Ok(MotionOutcome::new(pair.clone(), answer, centre, elapsed_ms))
    };
    pool.install(|| pairs.pairs.par_iter().map(one).collect())
}

/// As many threads as a trial asks for.
///
/// # Errors
/// If they cannot be started.
pub fn thread_pool(threads: usize) -> Result<rayon::ThreadPool, TrialError> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|_| TrialError::Option {
        name: "threads",
        value: threads as f64,
        expected: "a number of threads that this machine can start",
    })
}

/// Found minus true place in a of a point of b.
fn off_px(found: &[[f64; 3]; 2], truth: &[[f64; 3]; 2], at: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|row| {
        let place = |m: &[[f64; 3]; 2]| m[row][0] * at[0] + m[row][1] * at[1] + m[row][2];
        place(found) - place(truth)
    })
}

impl MotionOutcome {
    fn new(pair: ImagePair, answer: MotionAnswer, centre_of_b: [f64; 2], elapsed_ms: f64) -> Self {
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

/// Whether the 95 % ellipse of a covariance contains a two-dimensional error (chi-square of two degrees of freedom:
/// 5.991).
pub fn is_in_ellipse95([x, y]: [f64; 2], [[xx, xy], [_, yy]]: &[[f64; 2]; 2]) -> bool {
    let determinant = xx * yy - xy * xy;
    *xx > 0.0 && determinant > 0.0 && (x * x * yy - 2.0 * x * y * xy + y * y * xx) / determinant <= 5.991
}

impl MotionScore {
    /// Scores outcomes.
    pub fn from_outcomes(outcomes: &[MotionOutcome], threads: usize) -> Self {
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
            by_overlap: overlaps.into_iter().map(|overlap| OverlapScore::from_outcomes(outcomes, overlap)).collect(),
            threads,
        }
    }
}

impl OverlapScore {
    fn from_outcomes(outcomes: &[MotionOutcome], overlap_percent: f64) -> Self {
        let these: Vec<_> = outcomes.iter().filter(|o| o.pair.overlap_percent == overlap_percent).collect();
        let right: Vec<_> = these.iter().filter(|o| o.is_right()).collect();
        Self {
            overlap_percent,
            pairs: these.len(),
            right: right.len(),
            drift_px: Quantiles::from_values(right.iter().filter_map(|o| o.drift_px).collect()),
            elapsed_ms: Quantiles::from_values(these.iter().map(|o| o.elapsed_ms).collect()),
        }
    }
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
        let pair = ImagePair {
            names: ["a".into(), "b".into()],
            paths: ["a".into(), "b".into()],
            overlap_percent,
            a_from_b: truth,
        };
        MotionOutcome::new(pair, answer, [256.0, 256.0], 5.0)
    }

    #[test]
    fn counts_right_within_a_pixel_by_overlap() {
        let score = MotionScore::from_outcomes(
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
