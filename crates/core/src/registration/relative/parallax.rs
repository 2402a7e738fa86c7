//! Of several surfaces in the frames, the ground.
//!
//! A camera that looks down and moves sees every level surface turn and grow alike, but a roof, being nearer, moves
//! farther than the ground. Where roofs fill most of the frame, the largest consensus is theirs; the height above
//! ground and every map mean the lower surface.

use super::Similarity;
use super::consensus::Pair;
use nalgebra::Vector2;

/// A lower surface must bring this share of the witnesses of the largest, and so many.
const LEAST_SHARE: f64 = 0.35;
const LEAST_WITNESSES: usize = 15;
/// It moves at least this share of the larger motion: buildings reach half way up to the camera at most, and what
/// hardly moves is painted on the lens.
const LEAST_MOTION: f64 = 0.5;
/// Nearer surfaces are one surface, px.
const APART_PX: f64 = 6.0;
/// Length along the motion, and half the width across it, where a surface's pairs lie together, px.
const WINDOW_PX: (f64, f64) = (6.0, 4.0);

/// A first guess of the ground's motion from the pairs that do not agree with `top`, the motion of the largest
/// surface, seen by `witnesses`; `displacement` is that of b's centre. `None` where no lower surface stands out.
pub fn lower_surface(
    others: &[&Pair],
    top: &Similarity,
    witnesses: usize,
    displacement: Vector2<f64>,
) -> Option<Similarity> {
    let length = displacement.norm();
    let most_px = (1.0 - LEAST_MOTION) * length;
    if most_px < APART_PX {
        return None;
    }
    let direction = displacement / length;
    let behind = |pair: &&Pair| {
        let off = pair.a - top.apply(pair.b);
        let along = -off.dot(&direction);
        let is_near = off.perp(&direction).abs() <= WINDOW_PX.1 && (APART_PX..=most_px).contains(&along);
        (is_near && pair.agrees_in_kind(top)).then_some(along)
    };
    let mut behind: Vec<f64> = others.iter().filter_map(behind).collect();
    behind.sort_by(f64::total_cmp);
    let within = |first: usize| behind.partition_point(|v| *v <= behind[first] + WINDOW_PX.0) - first;
    let first = (0..behind.len()).max_by_key(|&i| (within(i), std::cmp::Reverse(i)))?;
    let count = within(first);
    if count < LEAST_WITNESSES || (count as f64) < LEAST_SHARE * witnesses as f64 {
        return None;
    }
    let middle = behind[first + count / 2];
    Some(Similarity { t: top.t - direction * middle, ..*top })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(motion: &Similarity, count: usize) -> Vec<Pair> {
        let b = |i: usize| Vector2::new((i * 37 % 400) as f64, (i * 91 % 300) as f64);
        (0..count).map(|i| Pair { a: motion.apply(b(i)), b: b(i), turn_rad: 0.0, scale: 1.0 }).collect()
    }

    #[test]
    fn the_ground_moves_less_than_the_roofs() {
        let moved = |x: f64| Similarity { c: 1.0, s: 0.0, t: Vector2::new(x, 0.0) };
        let (roofs, ground) = (moved(100.0), surface(&moved(75.0), 40));
        let others: Vec<&Pair> = ground.iter().collect();
        let guess = lower_surface(&others, &roofs, 60, roofs.t).unwrap();
        assert!((guess.t.x - 75.0).abs() < 1e-9);
        assert!(lower_surface(&others[..14], &roofs, 20, roofs.t).is_none(), "too few");
        assert!(lower_surface(&others, &roofs, 200, roofs.t).is_none(), "too small a share");
        let painted = surface(&moved(0.0), 40);
        let others: Vec<&Pair> = painted.iter().collect();
        assert!(lower_surface(&others, &roofs, 60, roofs.t).is_none(), "on the lens");
    }
}
