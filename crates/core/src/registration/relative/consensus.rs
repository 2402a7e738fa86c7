//! The similarity that most keypoint matches agree on, by RANSAC, and the number of false alarms (NFA) of such a consensus.

use super::keypoint_match::{KeypointMatch, TURN_TOLERANCE_DEG};
use super::keypoint_observations::KeypointObservations;
use super::parallax::lower_surface;
use crate::registration::a_contrario::{ConsensusCounts, log10_nfa};
use crate::registration::robust::{
    Ending, EstimatorOptions, HypothesisMethod, RobustFit, SearchReport, design, estimate, refine,
};
use crate::registration::similarity::{Precision, Similarity};
use nalgebra::{Matrix4, Vector2};
use std::f64::consts::PI;

/// The sizes of two frames, px.
#[derive(Debug, Clone, Copy)]
pub struct FrameSizes {
    /// Width and height of a.
    pub size_of_a: Vector2<f64>,
    /// Centre of b, where the covariance is stated.
    pub centre_of_b: Vector2<f64>,
}

/// The largest consensus of keypoint matches.
#[derive(Debug, Clone)]
pub struct KeypointConsensus {
    /// The similarity, fitted to the inliers.
    pub a_from_b: Similarity,
    /// Precision of the similarity.
    pub precision: Precision,
    /// Matches that agree with the similarity.
    pub inliers: usize,
    /// Matches in the overlap that the similarity implies, without those of a surface above the ground.
    pub in_overlap: usize,
    /// Matches of a surface above the ground, in order.
    pub above: Vec<usize>,
    /// log10 of the number of false alarms: how many consensuses as large are expected by chance.
    pub log10_false_alarms: f64,
    /// How the consensus was found.
    pub search: SearchReport,
}

/// Pairs drawn at most; where one match in forty is right, a right pair is missed with probability
/// (1 - 1/1600)^20000 = 4e-6.
const MAX_TRIALS: usize = 20_000;
/// A match agrees within this distance, pixels of a.
const TOLERANCE_PX: f64 = 2.5;
const OPTIONS: EstimatorOptions = EstimatorOptions {
    method: HypothesisMethod::Ransac { max_trials: MAX_TRIALS, miss_probability: 1e-6 },
    tolerance_px: TOLERANCE_PX,
    // Nearer points determine rotation and scale badly.
    min_base_px: 12.0,
    rounds: 4,
    min_kept: 0,
    ending: Ending::Fit,
    pivot_px: None,
    prior: None,
};
/// The seed of the draws: the same frames give the same answer.
const SEED: u32 = 0x2545_f491;
/// Neighbouring matches have common errors (relief, the shape of the lens): one in this many counts as independent.
const MATCHES_PER_INDEPENDENT: f64 = 4.0;
/// Keypoints nearer than this see the same corner: they count once.
const APART_PX: f64 = 8.0;
/// Keypoints are not spread evenly: a match by chance is so many times as likely.
const UNEVENNESS: f64 = 3.0;

/// Finds the similarity with the largest consensus, by least squares over the matches that agree; where a lower surface
/// stands out behind the largest consensus, that surface. The same input gives the same answer. `None` with fewer than two
/// matches, or where no pair of them agrees on rotation and on a scale within bounds.
pub fn find_consensus(
    matches: &[KeypointMatch],
    frames: &FrameSizes,
    scale_bounds: (f64, f64),
) -> Option<KeypointConsensus> {
    let observations = KeypointObservations::new(matches, scale_bounds);
    let (largest, search) = estimate(&observations, &OPTIONS, SEED)?;
    let displacement = largest.model.apply(frames.centre_of_b) - frames.size_of_a / 2.0;
    let is_other = |i: &usize| largest.inliers.binary_search(i).is_err();
    let others: Vec<&KeypointMatch> = (0..matches.len()).filter(is_other).map(|i| &matches[i]).collect();
    let lower = lower_surface(&others, &largest.model, largest.inliers.len(), displacement);
    Some(match lower.and_then(|guess| refine(&observations, &guess, &OPTIONS)) {
        Some(ground) => assess(matches, ground, &largest.inliers, frames, search),
        None => assess(matches, largest, &[], frames, search),
    })
}

/// The consensus with its precision and evidence; `above` are the matches of a surface above, which do not contradict.
fn assess(
    matches: &[KeypointMatch],
    fit: RobustFit,
    above: &[usize],
    frames: &FrameSizes,
    search: SearchReport,
) -> KeypointConsensus {
    let a_from_b = fit.model;
    let mut j = Matrix4::identity();
    j.fixed_rows_mut::<2>(0).copy_from(&design(frames.centre_of_b - fit.pivot_px));
    let covariance = j * fit.cofactor * j.transpose() * (fit.unit_variance * MATCHES_PER_INDEPENDENT);
    let is_shared =
        |i: &usize| is_inside(a_from_b.apply(matches[*i].b), frames.size_of_a) && above.binary_search(i).is_err();
    KeypointConsensus {
        a_from_b,
        precision: Precision::from_covariance(&a_from_b, &covariance),
        inliers: fit.inliers.len(),
        in_overlap: (0..matches.len()).filter(is_shared).count(),
        above: above.to_vec(),
        log10_false_alarms: log10_false_alarms(matches, &fit.inliers, frames.size_of_a.x * frames.size_of_a.y),
        search,
    }
}

fn is_inside(p: Vector2<f64>, size: Vector2<f64>) -> bool {
    p.x > 0.0 && p.y > 0.0 && p.x < size.x && p.y < size.y
}

/// log10 of the number of false alarms. By chance a match is an inlier where a's point falls into the disc of the tolerance
/// and the orientation within its own tolerance. Inliers on the same corner count once.
fn log10_false_alarms(matches: &[KeypointMatch], inliers: &[usize], area_px2: f64) -> f64 {
    let mut apart: Vec<&KeypointMatch> = Vec::new();
    let near = |p: Vector2<f64>, q: Vector2<f64>| (p - q).norm_squared() < APART_PX * APART_PX;
    for keypoint_match in inliers.iter().map(|&i| &matches[i]) {
        if !apart.iter().any(|other| near(keypoint_match.a, other.a) || near(keypoint_match.b, other.b)) {
            apart.push(keypoint_match);
        }
    }
    let chance = UNEVENNESS * PI * TOLERANCE_PX * TOLERANCE_PX / area_px2 * (2.0 * TURN_TOLERANCE_DEG / 360.0);
    log10_nfa(&ConsensusCounts { matches: matches.len(), inliers: apart.len(), chance: chance.min(1.0), places: 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::robust::Xorshift;

    fn frames() -> FrameSizes {
        FrameSizes { size_of_a: [512.0, 512.0].into(), centre_of_b: [256.0, 256.0].into() }
    }

    /// `right` matches of one similarity among `wrong` ones by chance.
    fn mixture(right: usize, wrong: usize) -> (Similarity, Vec<KeypointMatch>) {
        let truth = Similarity::about(0.9, 0.5, Vector2::new(256.0, 256.0), Vector2::new(200.0, 300.0));
        let mut draw = Xorshift::new(99);
        let mut point = || Vector2::new(draw.below(51_200) as f64 / 100.0, draw.below(51_200) as f64 / 100.0);
        let one = |i: usize| {
            let b = point();
            let (a, turn_rad) =
                if i < right { (truth.apply(b), truth.rotation_rad() + 0.1) } else { (point(), point().x) };
            KeypointMatch { a, b, turn_rad, scale: 1.0 }
        };
        (truth, (0..right + wrong).map(one).collect())
    }

    #[test]
    fn finds_one_right_match_in_twenty_at_a_low_nfa() {
        let (truth, matches) = mixture(15, 285);
        let found = find_consensus(&matches, &frames(), (0.4, 2.5)).unwrap();
        let off = found.a_from_b.apply([256.0, 256.0].into()) - truth.apply([256.0, 256.0].into());
        assert!(off.norm() < 0.5 && found.inliers >= 15 && found.log10_false_alarms < -12.0);
    }

    #[test]
    fn chance_alone_has_a_high_nfa() {
        let (_, matches) = mixture(0, 300);
        let found = find_consensus(&matches, &frames(), (0.4, 2.5));
        assert!(found.is_none_or(|f| f.log10_false_alarms > -3.0));
    }

    #[test]
    fn one_corner_seen_many_times_counts_once() {
        let (_, mut matches) = mixture(3, 0);
        matches.extend(vec![matches[0]; 40]);
        let found = find_consensus(&matches, &frames(), (0.4, 2.5)).unwrap();
        assert!(found.inliers == 43 && found.log10_false_alarms > -5.0, "{}", found.log10_false_alarms);
    }

    /// Matches of a surface and of a lower or higher one among wrong ones, with noise.
    fn two_surfaces(seed: u32) -> Vec<KeypointMatch> {
        let mut draw = Xorshift::new(seed);
        let mut unit = || draw.below(2_000_001) as f64 / 1e6 - 1.0;
        let centre = Vector2::new(256.0, 256.0);
        let (c, s) = (0.9 + 0.3 * unit(), 0.5 * unit());
        let shifted = centre + Vector2::new(90.0 * unit(), 90.0 * unit());
        let first = Similarity::about(c, s, centre, shifted);
        let second = Similarity { t: first.t + Vector2::new(30.0 * unit(), 30.0 * unit()), ..first };
        let count = (220.0 + 210.0 * unit()) as usize;
        let (share, noise) = (unit().abs(), 2.0 * unit().abs());
        let one = |_| {
            let b = centre + Vector2::new(256.0 * unit(), 256.0 * unit());
            let kind = unit().abs();
            let (a, turn_rad) = if kind < share {
                let surface = if kind < share * 0.6 { first } else { second };
                let a = surface.apply(b) + Vector2::new(noise * unit(), noise * unit());
                (a, first.rotation_rad() + 0.6 * unit())
            } else {
                (centre + Vector2::new(256.0 * unit(), 256.0 * unit()), 3.0 * unit())
            };
            KeypointMatch { a, b, turn_rad, scale: 1.0 + 0.3 * unit() }
        };
        (0..count).map(one).collect()
    }

    #[test]
    fn the_digits_stay_with_ransac_and_with_all_pairs() {
        let found = find_consensus(&two_surfaces(12_345), &frames(), (0.4, 2.5)).unwrap();
        let t = Vector2::new(19.649964057237526, 42.47885875233854);
        assert_eq!(found.a_from_b, Similarity { c: 0.8773044029766376, s: 0.1269142878878642, t });
        assert_eq!(found.precision.centre_px2[(0, 0)], 0.28089004381132);
        assert_eq!((found.inliers, found.in_overlap), (12, 330));
        assert!((found.log10_false_alarms + 18.719029568258915).abs() < 1e-9);
        assert_eq!((found.search.method, found.search.trials, found.search.seed), (OPTIONS.method, 6293, SEED));

        let found = find_consensus(&two_surfaces(67_890), &frames(), (0.4, 2.5)).unwrap();
        let t = Vector2::new(88.37821598225764, -32.89925538690858);
        assert_eq!(found.a_from_b, Similarity { c: 0.9844355030543426, s: 0.25959530074556797, t });
        assert_eq!(found.precision.turn_rad2, 3.577615353584332e-7);
        assert_eq!((found.inliers, found.in_overlap), (24, 77));
        assert!((found.log10_false_alarms + 69.4695976963435).abs() < 1e-9);
        assert_eq!((found.search.method, found.search.trials), (HypothesisMethod::AllPairs, 87 * 86 / 2));
    }
}
