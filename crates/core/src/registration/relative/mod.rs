//! Relative registration: the motion between two frames.
//!
//! Keypoints find it, from any turn ([`consensus`]); the brightness of all that both frames see makes it exact, and
//! confirms it ([`alignment`]).

pub mod alignment;
mod answer;
mod binomial;
pub mod consensus;
mod parallax;
mod similarity;
mod sums;

pub use answer::{Motion, MotionAnswer, MotionPrior, NoMotionReason};
pub use similarity::{Precision, Similarity};

use crate::feature::keypoint::{FrameRecipe, Keypoints, describe_frame, match_mutual};
use crate::pixels::Gray;
use alignment::{Aligned, align};
use consensus::{Consensus, Frames, Pair, estimate};
use nalgebra::Vector2;

/// What is described first.
pub const QUICK: FrameRecipe = FrameRecipe { limit: 600, steps_per_octave: 1 };
/// What is described where that does not suffice: small overlaps, other scales, blur.
const THOROUGH: FrameRecipe = FrameRecipe { limit: 2400, steps_per_octave: 2 };
/// Nearest over second nearest descriptor: the consensus needs no stricter choice.
pub const RATIO: f32 = 0.95;
/// log10 of the accidental agreements to expect in a pair, at most. Chance alone never came below 1e-5 in thousands of
/// pairs; ground that repeats itself, or mirrors itself along a road, does, and this bound and the next two are for it.
const MOST_LOG10_FALSE_ALARMS: f64 = -16.0;
/// Of the correspondences in the overlap that the motion claims, this share agrees with it. Where frames do share the
/// ground it is above 0.23 even when blurred, noisy and of other scale; on ground that only looks alike below 0.15.
const LEAST_AGREEING_SHARE: f64 = 0.18;
/// Mean correlation of the aligned frames' blocks. Where frames do share the ground, above 0.65 in all but one in ten
/// of the same trials, and above 0.9 without blur and noise.
const LEAST_CORRELATION: f64 = 0.65;
/// So much evidence needs no correlation of brightness: trees and houses seen from two sides have little.
const EVIDENT_LOG10_FALSE_ALARMS: f64 = -60.0;
const EVIDENT_SHARE: f64 = 0.12;
/// Brightness that correlates less makes no evident motion more exact.
const USEFUL_CORRELATION: f64 = 0.45;
/// Scales outside are no consecutive frames.
pub const SCALE_BOUNDS: (f64, f64) = (0.4, 2.5);
/// How far the scale found may be from the stated one.
const SCALE_SLACK: f64 = 0.15;

/// Frames are compared at this edge (square root of the area) at most: beyond, only time and memory grow.
pub const MOST_EDGE_PX: f64 = 720.0;

/// Registers frame b against frame a. Frames of many megapixels are compared at a whole fraction of their size; the
/// answer is in their own pixels.
///
/// # References
/// Equations 32 to 36 of the paper, over many correspondences; the final alignment is Lucas and Kanade's (IJCAI 1981)
/// for a similarity with gain and offset.
pub fn register(a: &Gray, b: &Gray, prior: &MotionPrior) -> MotionAnswer {
    let edge_px = |g: &Gray| ((g.width_px() * g.height_px()) as f64).sqrt();
    let factor = (edge_px(a).max(edge_px(b)) / MOST_EDGE_PX).ceil() as usize;
    let found = if factor <= 1 {
        register_as_is(a, b, prior, middle(b))
    } else {
        register_as_is(&a.binned(factor), &b.binned(factor), prior, middle(b) / factor as f64)
    };
    match found {
        Ok(found) => MotionAnswer::Motion(found.motion(factor as f64, middle(a), middle(b))),
        Err(Refusal { reason, detail }) => MotionAnswer::NoMotion { reason, detail },
    }
}

/// The middle of a frame, pixels from its corner.
fn middle(frame: &Gray) -> Vector2<f64> {
    Vector2::new(frame.width_px() as f64 / 2.0, frame.height_px() as f64 / 2.0)
}

/// A motion that stood every test.
struct Found {
    similarity: Similarity,
    precision: Precision,
    inliers: usize,
    matches: usize,
    log10_false_alarms: f64,
}

/// Why a way did not lead to a motion.
struct Refusal {
    reason: NoMotionReason,
    detail: String,
}

/// Registers frames as they are; the centre is that of b before binning, which may have dropped a remainder.
fn register_as_is(a: &Gray, b: &Gray, prior: &MotionPrior, centre_of_b: Vector2<f64>) -> Result<Found, Refusal> {
    let found = attempt(a, b, &QUICK, centre_of_b).or_else(|_| attempt(a, b, &THOROUGH, centre_of_b))?;
    let scale = found.similarity.scale();
    match prior.scale.filter(|expected| (scale / expected).ln().abs() > SCALE_SLACK) {
        Some(expected) => {
            refused(NoMotionReason::OtherScale, format!("scale {scale:.3}, but {expected:.3} was stated"))
        }
        None => Ok(found),
    }
}

/// One way through: keypoints, consensus, alignment, and the tests.
fn attempt(a: &Gray, b: &Gray, recipe: &FrameRecipe, centre_of_b: Vector2<f64>) -> Result<Found, Refusal> {
    use NoMotionReason::TooFewAgreeingMatches;
    let (of_a, of_b) = (describe_frame(a, recipe), describe_frame(b, recipe));
    let pairs: Vec<_> = match_mutual(&of_a, &of_b, RATIO).iter().map(|m| pair(&of_a, m.a, &of_b, m.b)).collect();
    let matches = pairs.len();
    let frames = Frames { size_of_a: 2.0 * middle(a), centre_of_b };
    let Some(agreed) = estimate(&pairs, &frames, SCALE_BOUNDS) else {
        let detail = format!("no two of {matches} correspondences agree on a similarity");
        return refused(TooFewAgreeingMatches, detail);
    };
    let is_evident = stands(&agreed, matches)?;
    let aligned = align(a, b, &agreed.similarity, centre_of_b);
    let (similarity, precision) = placed(&agreed, aligned.as_ref(), is_evident)?;
    let Consensus { inliers, log10_false_alarms, .. } = agreed;
    Ok(Found { similarity, precision, inliers, matches, log10_false_alarms })
}

/// The similarity that a registration answers with, given what keypoints agree on and how brightness aligned it; `None`
/// where it refuses. What [`register`] does with one recipe, for those who time its steps.
pub fn accepted(agreed: &Consensus, aligned: Option<&Aligned>) -> Option<Similarity> {
    let is_evident = stands(agreed, agreed.inliers).ok()?;
    placed(agreed, aligned, is_evident).ok().map(|(similarity, _)| similarity)
}

/// Whether an agreement is so evident that it needs little of brightness; refused where accident or the other
/// correspondences speak against it.
fn stands(agreed: &Consensus, matches: usize) -> Result<bool, Refusal> {
    use NoMotionReason::{Contradicted, TooFewAgreeingMatches};
    let &Consensus { inliers, in_overlap, log10_false_alarms, .. } = agreed;
    if log10_false_alarms > MOST_LOG10_FALSE_ALARMS {
        let detail = format!(
            "{inliers} of {matches} correspondences agree; accident makes 10^{log10_false_alarms:.1} such agreements"
        );
        return refused(TooFewAgreeingMatches, detail);
    }
    let share = inliers as f64 / in_overlap as f64;
    let is_evident = log10_false_alarms <= EVIDENT_LOG10_FALSE_ALARMS && share >= EVIDENT_SHARE;
    if share < LEAST_AGREEING_SHARE && !is_evident {
        let detail = format!("{inliers} correspondences agree, but {in_overlap} lie in the overlap so found");
        return refused(Contradicted, detail);
    }
    Ok(is_evident)
}

/// The similarity to answer with, and how well it is known; refused where brightness contradicts.
fn placed(agreed: &Consensus, aligned: Option<&Aligned>, is_evident: bool) -> Result<(Similarity, Precision), Refusal> {
    let correlation = aligned.map_or(0.0, |aligned| aligned.correlation);
    let needed = if is_evident { USEFUL_CORRELATION } else { LEAST_CORRELATION };
    match aligned {
        Some(aligned) if correlation >= needed => Ok((aligned.similarity, aligned.precision)),
        _ if is_evident => Ok((agreed.similarity, agreed.precision)),
        _ => {
            let inliers = agreed.inliers;
            let detail = format!("{inliers} correspondences agree, but brightness correlates by {correlation:.2}");
            refused(NoMotionReason::Contradicted, detail)
        }
    }
}

impl Found {
    /// The answer in pixels `factor` times as small, for frames of these centres.
    fn motion(&self, factor: f64, centre_of_a: Vector2<f64>, centre_of_b: Vector2<f64>) -> Motion {
        let similarity = self.similarity.in_pixels(1.0 / factor, 1.0 / factor);
        let displacement = similarity.apply(centre_of_b) - centre_of_a;
        let Similarity { c, s, t } = similarity;
        let Precision { centre_px2, turn_rad2, log_scale2 } = self.precision.in_pixels(1.0 / factor);
        Motion {
            a_from_b: [[c, -s, t.x], [s, c, t.y]],
            rotation_deg: similarity.rotation_rad().to_degrees(),
            scale: similarity.scale(),
            displacement_px: [displacement.x, displacement.y],
            covariance_px2: [[centre_px2[(0, 0)], centre_px2[(0, 1)]], [centre_px2[(1, 0)], centre_px2[(1, 1)]]],
            rotation_sigma_deg: turn_rad2.sqrt().to_degrees(),
            scale_sigma_ratio: log_scale2.sqrt(),
            inliers: self.inliers,
            matches: self.matches,
            log10_false_alarms: self.log10_false_alarms,
        }
    }
}

/// A correspondence as the consensus takes it: point `i` of a and `j` of b, positions in their own pixels.
pub fn pair(of_a: &Keypoints, i: usize, of_b: &Keypoints, j: usize) -> Pair {
    let (p, q) = (&of_a.points[i], &of_b.points[j]);
    let place = |x_px: f32, y_px: f32| Vector2::new(f64::from(x_px), f64::from(y_px));
    Pair {
        a: place(p.x_px, p.y_px),
        b: place(q.x_px, q.y_px),
        turn_rad: f64::from(p.angle_rad - q.angle_rad),
        scale: f64::from(p.scale / q.scale),
    }
}

fn refused<T>(reason: NoMotionReason, detail: String) -> Result<T, Refusal> {
    Err(Refusal { reason, detail })
}

#[cfg(test)]
mod tests;
