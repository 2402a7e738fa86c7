//! Parallax: finds the ground where the largest consensus is that of a higher surface.
//!
//! A moving camera that looks down sees the same rotation and scale of every level surface, but a roof is nearer and moves
//! farther than the ground. Where roofs fill most of the frame, the largest consensus is that of the roofs; the height
//! above ground and every map mean the lower surface.

use super::keypoint_match::KeypointMatch;
use crate::registration::similarity::Similarity;
use nalgebra::Vector2;

/// A lower surface needs this share of the inliers of the largest surface,
const LEAST_SHARE: f64 = 0.35;
/// and at least this many.
const LEAST_MATCHES: usize = 15;
/// A lower surface moves at least this share of the larger motion: buildings reach half way up to the camera at most, and
/// what hardly moves is dirt on the lens.
const LEAST_MOTION: f64 = 0.5;
/// Surfaces whose motions differ by less than this are one surface, px.
const APART_PX: f64 = 6.0;
/// Length along the motion, and half the width across the motion, of the window in which the residuals of one surface lie,
/// px.
const WINDOW_PX: (f64, f64) = (6.0, 4.0);

/// A first guess of the similarity of the ground, from the matches that are no inliers of `top`: the similarity `a_from_b` of
/// the largest surface, which has `inliers` inliers. `displacement` is that of b's centre, px of a. `None` where no lower
/// surface stands out.
pub fn lower_surface(
    others: &[&KeypointMatch],
    top: &Similarity,
    inliers: usize,
    displacement: Vector2<f64>,
) -> Option<Similarity> {
    let length = displacement.norm();
    let most_px = (1.0 - LEAST_MOTION) * length;
    if most_px < APART_PX {
        return None;
    }
    let direction = displacement / length;
    let behind = |other: &&KeypointMatch| {
        let off = other.a - top.apply(other.b);
        let along = -off.dot(&direction);
        let is_near = off.perp(&direction).abs() <= WINDOW_PX.1 && (APART_PX..=most_px).contains(&along);
        (is_near && other.agrees_in_kind(top)).then_some(along)
    };
    let mut behind: Vec<f64> = others.iter().filter_map(behind).collect();
    behind.sort_by(f64::total_cmp);
    let within = |first: usize| behind.partition_point(|v| *v <= behind[first] + WINDOW_PX.0) - first;
    let first = (0..behind.len()).max_by_key(|&i| (within(i), std::cmp::Reverse(i)))?;
    let count = within(first);
    if count < LEAST_MATCHES || (count as f64) < LEAST_SHARE * inliers as f64 {
        return None;
    }
    let middle = behind[first + count / 2];
    Some(Similarity { t: top.t - direction * middle, ..*top })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(motion: &Similarity, count: usize) -> Vec<KeypointMatch> {
        let b = |i: usize| Vector2::new((i * 37 % 400) as f64, (i * 91 % 300) as f64);
        (0..count).map(|i| KeypointMatch { a: motion.apply(b(i)), b: b(i), turn_rad: 0.0, scale: 1.0 }).collect()
    }

    #[test]
    fn the_ground_moves_less_than_the_roofs() {
        let moved = |x: f64| Similarity { c: 1.0, s: 0.0, t: Vector2::new(x, 0.0) };
        let (roofs, ground) = (moved(100.0), surface(&moved(75.0), 40));
        let others: Vec<&KeypointMatch> = ground.iter().collect();
        let guess = lower_surface(&others, &roofs, 60, roofs.t).unwrap();
        assert!((guess.t.x - 75.0).abs() < 1e-9);
        assert!(lower_surface(&others[..14], &roofs, 20, roofs.t).is_none(), "too few");
        assert!(lower_surface(&others, &roofs, 200, roofs.t).is_none(), "too small a share");
        let painted = surface(&moved(0.0), 40);
        let others: Vec<&KeypointMatch> = painted.iter().collect();
        assert!(lower_surface(&others, &roofs, 60, roofs.t).is_none(), "on the lens");
    }
}
