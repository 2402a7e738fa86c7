//! Registration of frame b against frame a: keypoints, consensus, alignment, and the tests that an answer has to pass.

use super::alignment::{Aligned, align};
use super::consensus::{FrameSizes, KeypointConsensus, find_consensus};
use super::keypoint_match::KeypointMatch;
use super::motion::{Motion, MotionAnswer, MotionPrior, NoMotionReason};
use super::repetition::{RivalComparison, is_of_a_still_part, strongest_rival};
use crate::feature::keypoint::{KeypointOptions, describe_frame, match_mutual};
use crate::pixels::Gray;
use crate::registration::similarity::{Precision, Similarity};
use nalgebra::Vector2;

/// The keypoints of the first attempt.
pub const QUICK: KeypointOptions = KeypointOptions { limit: 600, steps_per_octave: 1 };
/// The keypoints of the second attempt, for small overlaps, other scales and blur.
const THOROUGH: KeypointOptions = KeypointOptions { limit: 2400, steps_per_octave: 2 };
/// Nearest over second nearest descriptor distance: RANSAC needs no stricter choice.
pub const RATIO: f32 = 0.95;
/// Largest log10 of the number of false alarms of an accepted consensus. Chance alone never came below 1e-5 in thousands of
/// pairs. Ground that repeats itself, or mirrors itself along a road, does; this bound and the next two are for such ground.
const MOST_LOG10_FALSE_ALARMS: f64 = -16.0;
/// Least share of inliers among the matches in the overlap that the motion implies. Where frames share the ground the share
/// is above 0.23 even when they are blurred, noisy and of other scale; on ground that only looks alike it is below 0.15.
const LEAST_AGREEING_SHARE: f64 = 0.18;
/// Least mean correlation of the blocks of the aligned frames. Where frames share the ground the correlation is above 0.65
/// in nine of ten of the same trials, and above 0.9 without blur and noise.
const LEAST_CORRELATION: f64 = 0.65;
/// A consensus with at most this log10 of the number of false alarms is evident: it needs no correlation of brightness, of
/// which trees and houses seen from two sides have little.
const EVIDENT_LOG10_FALSE_ALARMS: f64 = -60.0;
/// Least share of inliers of an evident consensus.
const EVIDENT_SHARE: f64 = 0.12;
/// Where brightness correlates less than this, the alignment does not make an evident motion more exact.
const USEFUL_CORRELATION: f64 = 0.45;
/// Least and largest scale between consecutive frames.
pub const SCALE_BOUNDS: (f64, f64) = (0.4, 2.5);
/// How far the logarithm of the scale found may be from that of the stated scale.
const SCALE_SLACK: f64 = 0.15;

/// Matches that move by less than this, pixels,
const STANDING_PX: f64 = 1.0;
/// where the motion found moves them by more than this,
const MOVING_PX: f64 = 4.0;
/// show an overlay (or dust, or a wing) where they are so many.
const LEAST_STANDING: usize = 3;
/// Largest squared Mahalanobis distance of alignment and consensus where something stands still: 99 % of a Gaussian's.
const MOST_DISAGREEMENT: f64 = 9.21;

/// Frames are compared at this edge (square root of the area) at most, px: beyond, only time and memory grow.
pub const MOST_EDGE_PX: f64 = 720.0;

/// Registers frame b against frame a. Frames of many megapixels are compared at a whole fraction of their size; the answer
/// is in their own pixels.
///
/// # References
/// Equations 32 to 36 of the paper, over many matches; the final alignment is that of Lucas and Kanade (IJCAI 1981) for a
/// similarity with gain and offset.
pub fn register(a: &Gray, b: &Gray, prior: &MotionPrior) -> MotionAnswer {
    if a == b {
        let detail = "both images have the very same pixels".to_owned();
        return MotionAnswer::NoMotion { reason: NoMotionReason::IdenticalImages, detail };
    }
    let edge_px = |g: &Gray| ((g.width_px() * g.height_px()) as f64).sqrt();
    let factor = (edge_px(a).max(edge_px(b)) / MOST_EDGE_PX).ceil() as usize;
    let found = if factor <= 1 {
        register_as_is(a, b, prior, middle(b))
    } else {
        register_as_is(&a.binned(factor), &b.binned(factor), prior, middle(b) / factor as f64)
    };
    match found {
        Ok(found) => MotionAnswer::Motion(found.motion(factor as f64, middle(a), middle(b))),
        Err(MotionRejection { reason, detail }) => MotionAnswer::NoMotion { reason, detail },
    }
}

/// The middle of a frame, pixels from its corner.
fn middle(frame: &Gray) -> Vector2<f64> {
    Vector2::new(frame.width_px() as f64 / 2.0, frame.height_px() as f64 / 2.0)
}

/// A motion that passed every test.
struct Accepted {
    a_from_b: Similarity,
    precision: Precision,
    inliers: usize,
    matches: usize,
    log10_false_alarms: f64,
}

/// Why an attempt did not lead to a motion.
struct MotionRejection {
    reason: NoMotionReason,
    detail: String,
}

/// Registers frames at their own size. `centre_of_b` is the centre of b before binning, which may have dropped a remainder.
fn register_as_is(
    a: &Gray,
    b: &Gray,
    prior: &MotionPrior,
    centre_of_b: Vector2<f64>,
) -> Result<Accepted, MotionRejection> {
    let found = attempt(a, b, &QUICK, centre_of_b).or_else(|quick| match quick.reason {
        // More keypoints don't make ground that repeats itself unique.
        NoMotionReason::Ambiguous => Err(quick),
        _ => attempt(a, b, &THOROUGH, centre_of_b),
    })?;
    let scale = found.a_from_b.scale();
    match prior.scale.filter(|expected| (scale / expected).ln().abs() > SCALE_SLACK) {
        Some(expected) => {
            rejected(NoMotionReason::OtherScale, format!("scale {scale:.3}, but {expected:.3} was stated"))
        }
        None => Ok(found),
    }
}

/// One attempt: keypoints, consensus, alignment, and the tests.
fn attempt(
    a: &Gray,
    b: &Gray,
    options: &KeypointOptions,
    centre_of_b: Vector2<f64>,
) -> Result<Accepted, MotionRejection> {
    use NoMotionReason::TooFewAgreeingMatches;
    let (of_a, of_b) = (describe_frame(a, options), describe_frame(b, options));
    let pairs = match_mutual(&of_a, &of_b, RATIO);
    let matches: Vec<_> = pairs.iter().map(|m| KeypointMatch::new(&of_a, m.a, &of_b, m.b)).collect();
    let frames = FrameSizes { size_of_a: 2.0 * middle(a), centre_of_b };
    let Some(consensus) = find_consensus(&matches, &frames, SCALE_BOUNDS) else {
        let detail = format!("no two of {} correspondences agree on a similarity", matches.len());
        return rejected(TooFewAgreeingMatches, detail);
    };
    let is_evident = verify_consensus(&consensus, matches.len())?;
    let has_overlay = stands_beside(&matches, &consensus.a_from_b) >= LEAST_STANDING;
    let aligned = align(a, b, &consensus.a_from_b, centre_of_b, has_overlay)
        .filter(|aligned| !has_overlay || agrees(aligned, &consensus, centre_of_b));
    let (a_from_b, precision) = choose(&consensus, aligned.as_ref(), is_evident)?;
    let KeypointConsensus { inliers, log10_false_alarms, above, .. } = consensus;
    if is_of_a_still_part(a, b, &a_from_b) {
        let detail = format!("{inliers} correspondences stand still, but most of the image moves");
        return rejected(NoMotionReason::Ambiguous, detail);
    }
    let rival = strongest_rival(a, b, &a_from_b, centre_of_b, &matches, &above);
    if let Some(RivalComparison { apart_px: [x, y], t }) = rival.filter(|rival| rival.is_ambiguous()) {
        let detail = format!(
            "{inliers} correspondences agree, but a motion {x:.0}, {y:.0} px away explains the images nearly as well ({t:.1} standard \
             errors apart)"
        );
        return rejected(NoMotionReason::Ambiguous, detail);
    }
    Ok(Accepted { a_from_b, precision, inliers, matches: matches.len(), log10_false_alarms })
}

/// The number of matches that stand still where the motion does not: those of an overlay, of dust, of a wing.
fn stands_beside(matches: &[KeypointMatch], a_from_b: &Similarity) -> usize {
    let stands =
        |m: &&KeypointMatch| (m.a - m.b).norm() < STANDING_PX && (a_from_b.apply(m.b) - m.b).norm() > MOVING_PX;
    matches.iter().filter(stands).count()
}

/// Whether alignment and consensus agree at the centre of b. What is left of an overlay's edges can draw an alignment aside.
fn agrees(aligned: &Aligned, consensus: &KeypointConsensus, centre_of_b: Vector2<f64>) -> bool {
    let off = aligned.a_from_b.apply(centre_of_b) - consensus.a_from_b.apply(centre_of_b);
    let covariance = aligned.precision.centre_px2 + consensus.precision.centre_px2;
    covariance.try_inverse().is_some_and(|inverse| off.dot(&(inverse * off)) <= MOST_DISAGREEMENT)
}

/// The similarity `a_from_b` that a registration answers with, given the consensus of keypoints and the alignment by
/// brightness; `None` where the registration is refused. This is the decision of [`register`], for callers that time the
/// steps.
pub fn accepted(consensus: &KeypointConsensus, aligned: Option<&Aligned>) -> Option<Similarity> {
    let is_evident = verify_consensus(consensus, consensus.inliers).ok()?;
    choose(consensus, aligned, is_evident).ok().map(|(a_from_b, _)| a_from_b)
}

/// Whether a consensus is so evident that brightness need hardly confirm it. Refuses a consensus that chance explains, or
/// that the other matches contradict.
fn verify_consensus(consensus: &KeypointConsensus, matches: usize) -> Result<bool, MotionRejection> {
    use NoMotionReason::{Contradicted, TooFewAgreeingMatches};
    let &KeypointConsensus { inliers, in_overlap, log10_false_alarms, .. } = consensus;
    if log10_false_alarms > MOST_LOG10_FALSE_ALARMS {
        let by_chance = match log10_false_alarms.is_finite() {
            true => format!("10^{log10_false_alarms:.1} such agreements are expected by chance"),
            false => "so few show no motion".to_owned(),
        };
        let detail = format!("{inliers} of {matches} correspondences agree; {by_chance}");
        return rejected(TooFewAgreeingMatches, detail);
    }
    let share = inliers as f64 / in_overlap as f64;
    let is_evident = log10_false_alarms <= EVIDENT_LOG10_FALSE_ALARMS && share >= EVIDENT_SHARE;
    if share < LEAST_AGREEING_SHARE && !is_evident {
        let detail = format!("{inliers} correspondences agree, but {in_overlap} lie in the overlap that they imply");
        return rejected(Contradicted, detail);
    }
    Ok(is_evident)
}

/// The similarity to answer with, and its precision: that of the alignment where brightness correlates, else that of an
/// evident consensus. Refuses where brightness contradicts.
fn choose(
    consensus: &KeypointConsensus,
    aligned: Option<&Aligned>,
    is_evident: bool,
) -> Result<(Similarity, Precision), MotionRejection> {
    let correlation = aligned.map_or(0.0, |aligned| aligned.correlation);
    let needed = if is_evident { USEFUL_CORRELATION } else { LEAST_CORRELATION };
    match aligned {
        Some(aligned) if correlation >= needed => Ok((aligned.a_from_b, aligned.precision)),
        _ if is_evident => Ok((consensus.a_from_b, consensus.precision)),
        _ => {
            let inliers = consensus.inliers;
            let detail = format!("{inliers} correspondences agree, but brightness correlates by {correlation:.2}");
            rejected(NoMotionReason::Contradicted, detail)
        }
    }
}

impl Accepted {
    /// The motion in pixels `factor` times as small, for frames of these centres.
    fn motion(&self, factor: f64, centre_of_a: Vector2<f64>, centre_of_b: Vector2<f64>) -> Motion {
        let a_from_b = self.a_from_b.in_pixels(1.0 / factor, 1.0 / factor);
        let displacement = a_from_b.apply(centre_of_b) - centre_of_a;
        let Similarity { c, s, t } = a_from_b;
        let Precision { centre_px2, turn_rad2, log_scale2 } = self.precision.in_pixels(1.0 / factor);
        Motion {
            a_from_b: [[c, -s, t.x], [s, c, t.y]],
            rotation_deg: a_from_b.rotation_rad().to_degrees(),
            scale: a_from_b.scale(),
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

fn rejected<T>(reason: NoMotionReason, detail: String) -> Result<T, MotionRejection> {
    Err(MotionRejection { reason, detail })
}
