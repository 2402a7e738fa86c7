//! The similarity that most correspondences agree on.

use super::Similarity;
use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2, Vector4};

/// A point of image a and the one of image b taken for the same ground.
pub type Pair = (Vector2<f64>, Vector2<f64>);

/// What was agreed on.
pub struct Consensus {
    /// Takes b to a.
    pub similarity: Similarity,
    /// Pairs that agree.
    pub inliers: usize,
    normal_inverse: Matrix4<f64>,
    variance_px2: f64,
    middle: Vector2<f64>,
}

impl Consensus {
    /// Covariance of where a point of b lies in a, px^2.
    pub fn covariance_at(&self, p: Vector2<f64>) -> Matrix2<f64> {
        let j = design(p - self.middle);
        j * self.normal_inverse * j.transpose() * self.variance_px2
    }
}

/// Pairs drawn at most; with a third of the correspondences right, a right pair is missed with probability
/// (1 - 1/9)^400 = 4e-21.
const DRAWS: usize = 400;
const ROUNDS: usize = 4;

/// The similarity with the largest consensus within `tolerance_px`, by least squares over those that agree. The draws
/// are the same for the same input. `None` with fewer than two pairs or where no drawn pair has a scale within bounds.
pub fn estimate(pairs: &[Pair], tolerance_px: f64, scale_bounds: (f64, f64)) -> Option<Consensus> {
    let mut best: Option<(usize, Similarity)> = None;
    let mut draw = Draw { state: 0x2545_f491, count: pairs.len() };
    let everything = pairs.len() * pairs.len().saturating_sub(1) / 2;
    for k in 0..DRAWS.min(everything) {
        let (i, j) = if everything <= DRAWS { nth_pair(k, pairs.len()) } else { draw.two() };
        let Some(s) = Similarity::through([pairs[i].1, pairs[j].1], [pairs[i].0, pairs[j].0]) else { continue };
        if !(scale_bounds.0..=scale_bounds.1).contains(&s.scale()) {
            continue;
        }
        let count = agreeing(pairs, &s, tolerance_px).count();
        if best.as_ref().is_none_or(|(n, _)| count > *n) {
            best = Some((count, s));
        }
    }
    let (_, mut similarity) = best?;
    let mut inliers: Vec<usize> = agreeing(pairs, &similarity, tolerance_px).collect();
    for _ in 0..ROUNDS {
        let Some((next, ..)) = least_squares(pairs, &inliers) else { break };
        similarity = next;
        inliers = agreeing(pairs, &similarity, tolerance_px).collect();
    }
    let (similarity, normal_inverse, middle) = least_squares(pairs, &inliers)?;
    let squares: f64 = inliers.iter().map(|&i| (pairs[i].0 - similarity.apply(pairs[i].1)).norm_squared()).sum();
    let freedom = (2 * inliers.len()) as f64 - 4.0;
    let variance_px2 = if freedom > 0.0 { squares / freedom } else { f64::INFINITY };
    Some(Consensus { similarity, inliers: inliers.len(), normal_inverse, variance_px2, middle })
}

fn agreeing(pairs: &[Pair], s: &Similarity, tolerance_px: f64) -> impl Iterator<Item = usize> {
    let square = tolerance_px * tolerance_px;
    (0..pairs.len()).filter(move |&i| (pairs[i].0 - s.apply(pairs[i].1)).norm_squared() <= square)
}

/// Least squares around the middle of b's points; `None` with fewer than two.
fn least_squares(pairs: &[Pair], inliers: &[usize]) -> Option<(Similarity, Matrix4<f64>, Vector2<f64>)> {
    if inliers.len() < 2 {
        return None;
    }
    let middle = inliers.iter().map(|&i| pairs[i].1).sum::<Vector2<f64>>() / inliers.len() as f64;
    let mut normal = Matrix4::zeros();
    let mut right = Vector4::zeros();
    for &i in inliers {
        let j = design(pairs[i].1 - middle);
        normal += j.transpose() * j;
        right += j.transpose() * pairs[i].0;
    }
    let inverse = normal.try_inverse()?;
    let p = inverse * right;
    let (c, s) = (p[2], p[3]);
    let t = Vector2::new(p[0] - c * middle.x + s * middle.y, p[1] - s * middle.x - c * middle.y);
    Some((Similarity { c, s, t }, inverse, middle))
}

/// d(a) / d(t_x, t_y, c, s) at a point of b.
fn design(p: Vector2<f64>) -> Matrix2x4<f64> {
    Matrix2x4::new(1.0, 0.0, p.x, -p.y, 0.0, 1.0, p.y, p.x)
}

fn nth_pair(mut k: usize, count: usize) -> (usize, usize) {
    for i in 0..count {
        let row = count - 1 - i;
        if k < row {
            return (i, i + 1 + k);
        }
        k -= row;
    }
    (0, 0)
}

/// A small fixed-seed generator (xorshift, Marsaglia 2003).
struct Draw {
    state: u32,
    count: usize,
}

impl Draw {
    fn one(&mut self) -> usize {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 17;
        self.state ^= self.state << 5;
        self.state as usize % self.count
    }

    fn two(&mut self) -> (usize, usize) {
        let i = self.one();
        loop {
            let j = self.one();
            if j != i {
                return (i, j);
            }
        }
    }
}
