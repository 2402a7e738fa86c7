//! Alignment by brightness: Gauss-Newton over the ground that both frames see, on a coarse grid first.
//!
//! # References
//! Lucas and Kanade, IJCAI 1981. The covariance is that of the jackknife over blocks (Efron, 1982; Bell and McCaffrey, Survey
//! Methodology 28, 2002). It holds also where the residuals of a block are correlated (relief, smoothing, moving things), and
//! where few blocks carry most of the weight.

use super::binomial::smoothed;
use super::block_sums::{Brightness, TUKEY, sum_blocks};
use super::normal_equations::{BlockSums, PARAMETERS};
use super::still_pixels::StillPixels;
use super::template::Template;
use crate::pixels::Gray;
use crate::registration::similarity::{Precision, Similarity};
use nalgebra::{Matrix4, SMatrix, SVector, Vector2};

/// The aligned similarity and its precision.
#[derive(Debug)]
pub struct Aligned {
    /// The similarity.
    pub a_from_b: Similarity,
    /// Precision of the similarity.
    pub precision: Precision,
    /// Mean over the overlap's blocks of the correlation of a and b, in [-1, 1].
    pub correlation: f64,
}

type Normal = SMatrix<f64, PARAMETERS, PARAMETERS>;
type ParameterVector = SVector<f64, PARAMETERS>;

/// The grid's step is chosen so that about this many pixels are compared,
const SAMPLES: f64 = 16_000.0;
/// and lies within these bounds.
const STEPS_PX: (f64, f64) = (1.0, 8.0);
/// Step of the coarse grid, in steps of the fine one.
const COARSE: usize = 2;
const COARSE_ROUNDS: usize = 8;
const FINE_ROUNDS: usize = 5;
/// Steps smaller than this at b's corners end the coarse and the fine rounds.
const COARSE_CONVERGED_PX: f64 = 0.05;
const FINE_CONVERGED_PX: f64 = 0.003;
/// The alignment may not leave what the keypoints found by more than this anywhere in the overlap, pixels of a.
const MAX_CORRECTION_PX: f64 = 4.0;
/// Fewer pixels than this give no alignment.
const LEAST_SAMPLES: f64 = 200.0;
/// Blocks that the covariance needs beyond the number of parameters.
const LEAST_FREEDOM: f64 = 3.0;
/// Error that no residual shows, one sigma per axis: interpolation and rounding shift all edges of a frame together.
const FLOOR_PX: f64 = 0.001;
/// Frames whose scales differ by more than this factor are compared at a common size.
const COMPARABLE: f64 = 1.45;

/// Aligns b on a from a start `a_from_b` within a pixel or two. `centre` is the centre of b, where the covariance is stated.
/// `has_overlay`: what stands still in the image is left out, in frames of equal sizes. `None` where the overlap is too small or flat,
/// or where the iteration diverges: then the start is the better answer.
pub fn align(a: &Gray, b: &Gray, start: &Similarity, centre: Vector2<f64>, has_overlay: bool) -> Option<Aligned> {
    let scale = start.scale();
    let halvings = |ratio: f64| if ratio > COMPARABLE { (ratio.log2().round() as u32).max(1) } else { 0 };
    let (of_a, of_b) = (1usize << halvings(scale), 1usize << halvings(1.0 / scale));
    let (wide_a, wide_b) = (of_a as f64, of_b as f64);
    let reduced = |gray: &Gray, factor: usize| if factor > 1 { smoothed(&gray.binned(factor)) } else { smoothed(gray) };
    let (small_a, small_b) = (reduced(a, of_a), reduced(b, of_b));
    let start = start.in_pixels(wide_a, wide_b);
    let still = StillPixels::between(&small_a, &small_b).filter(|_| has_overlay);
    let aligned = align_alike(&small_a, &small_b, &start, centre / wide_b, still)?;
    Some(Aligned {
        a_from_b: aligned.a_from_b.in_pixels(1.0 / wide_a, 1.0 / wide_b),
        precision: aligned.precision.in_pixels(1.0 / wide_a),
        correlation: aligned.correlation,
    })
}

/// As [`align`], for smoothed frames of about the same scale.
fn align_alike(
    a: &Gray,
    b: &Gray,
    start: &Similarity,
    centre: Vector2<f64>,
    still: Option<StillPixels<'_>>,
) -> Option<Aligned> {
    let step = step_px(a, b, start)?;
    let template = |step: usize| Template::new(b, centre, step, still).cut_to(a, start);
    let (coarse, fine) = (template(step * COARSE), template(step));
    let mut motion = *start;
    let mut last = None;
    let rejected_beyond = if still.is_some() { TUKEY } else { f64::INFINITY };
    for (template, rounds, converged_px) in
        [(&coarse, COARSE_ROUNDS, COARSE_CONVERGED_PX), (&fine, FINE_ROUNDS, FINE_CONVERGED_PX)]
    {
        let mut brightness = Brightness::unknown(template, rejected_beyond);
        for round in 0..rounds {
            let (sums, offsets) = sum_blocks(template, a, &motion, &brightness);
            let solved = GaussNewtonStep::solve(&sums)?;
            brightness = offsets;
            brightness.gain += solved.step[4];
            brightness.deviation = solved.deviation;
            motion = moved(&motion, &solved.step, template);
            let moved_px = solved.step.fixed_rows::<2>(0).norm() + solved.step.fixed_rows::<2>(2).norm();
            let is_done = moved_px < converged_px && round > 1;
            last = Some((sums, solved));
            if is_done {
                break;
            }
        }
    }
    let (sums, solved) = last?;
    let farthest = fine.middles_in(a, &motion).map(|p| (motion.apply(p) - start.apply(p)).norm()).fold(0.0, f64::max);
    if !(farthest <= MAX_CORRECTION_PX && motion.scale().is_finite()) {
        return None;
    }
    let mut covariance = solved.covariance(&sums)? + Matrix4::identity() * (FLOOR_PX * FLOOR_PX);
    covariance.fixed_rows_mut::<2>(2).scale_mut(1.0 / fine.radius_px);
    covariance.fixed_columns_mut::<2>(2).scale_mut(1.0 / fine.radius_px);
    let precision = Precision::from_covariance(&motion, &covariance);
    let correlation = sums.iter().map(|b| b.correlation).sum::<f64>() / sums.len() as f64;
    Some(Aligned { a_from_b: motion, precision, correlation })
}

/// The grid's step for this overlap, px; `None` where the overlap is too small.
fn step_px(a: &Gray, b: &Gray, motion: &Similarity) -> Option<usize> {
    const PROBE_PX: usize = 16;
    let (width, height) = (a.width_px() as f64, a.height_px() as f64);
    let places = (PROBE_PX / 2..b.height_px())
        .step_by(PROBE_PX)
        .flat_map(|y| (PROBE_PX / 2..b.width_px()).step_by(PROBE_PX).map(move |x| Vector2::new(x as f64, y as f64)));
    let shared = places.map(|p| motion.apply(p)).filter(|q| q.x > 0.0 && q.y > 0.0 && q.x < width && q.y < height);
    let area_px2 = (shared.count() * PROBE_PX * PROBE_PX) as f64;
    let step = (area_px2 / SAMPLES).sqrt().ceil().clamp(STEPS_PX.0, STEPS_PX.1);
    (area_px2 >= LEAST_SAMPLES).then_some(step as usize)
}

/// The motion after a Gauss-Newton step.
fn moved(motion: &Similarity, step: &ParameterVector, template: &Template) -> Similarity {
    let at_centre = motion.apply(template.centre) + Vector2::new(step[0], step[1]);
    let (c, s) = (motion.c + step[2] / template.radius_px, motion.s + step[3] / template.radius_px);
    Similarity::about(c, s, template.centre, at_centre)
}

/// One Gauss-Newton step.
struct GaussNewtonStep {
    step: ParameterVector,
    normal: Normal,
    right: ParameterVector,
    /// Robust standard deviation of the residuals, gray levels.
    deviation: f64,
}

impl GaussNewtonStep {
    /// Solves the normal equations; `None` with too few pixels, or where they do not determine the step.
    fn solve(blocks: &[BlockSums]) -> Option<Self> {
        let count: f64 = blocks.iter().map(|b| b.count).sum();
        if count < LEAST_SAMPLES {
            return None;
        }
        let normal: Normal = blocks.iter().map(|b| b.normal).sum();
        let right: ParameterVector = blocks.iter().map(|b| b.right).sum();
        let step = normal.try_inverse()? * right;
        // The mean absolute value of a Gaussian is sqrt(2 / pi) of its deviation.
        let deviation = blocks.iter().map(|b| b.absolute).sum::<f64>() / count * 1.2533;
        step.iter().all(|v| v.is_finite()).then_some(Self { step, normal, right, deviation })
    }

    /// Covariance of shift, growth and rotation: the jackknife, which leaves out one block after the other.
    fn covariance(&self, blocks: &[BlockSums]) -> Option<Matrix4<f64>> {
        let count = blocks.len() as f64;
        if count < PARAMETERS as f64 + LEAST_FREEDOM {
            return None;
        }
        let mut scatter = Matrix4::zeros();
        for block in blocks {
            let without = (self.normal - block.normal).try_inverse()? * (self.right - block.right);
            let off = (without - self.step).fixed_rows::<4>(0).into_owned();
            scatter += off * off.transpose();
        }
        Some(scatter * ((count - 1.0) / count))
    }
}
