//! The similarity that most correspondences agree on, and how surely that is no accident.

use super::parallax::lower_surface;
use super::{Precision, Similarity};
use crate::registration::evidence::{Agreement, log10_false_alarms};
use crate::simd::dispatch;
use nalgebra::{Matrix2x4, Matrix4, Vector2, Vector4};
use std::f64::consts::PI;

/// A point of image a and the one of image b taken for the same ground.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// In a, px from the corner.
    pub a: Vector2<f64>,
    /// In b, px from the corner.
    pub b: Vector2<f64>,
    /// Turn from b to a by the keypoints' own orientations, radians.
    pub turn_rad: f64,
    /// Pixels of a per pixel of b by the scales that the keypoints were found on.
    pub scale: f64,
}

/// The frames, px.
#[derive(Debug, Clone, Copy)]
pub struct Frames {
    /// Width and height of a.
    pub size_of_a: Vector2<f64>,
    /// Where the covariance is stated.
    pub centre_of_b: Vector2<f64>,
}

/// What was agreed on.
#[derive(Debug, Clone)]
pub struct Consensus {
    /// Takes b to a.
    pub similarity: Similarity,
    /// How well that is known.
    pub precision: Precision,
    /// Pairs that agree.
    pub inliers: usize,
    /// Pairs that lie where, by this similarity, both frames see the same ground, without those of a surface above it.
    pub in_overlap: usize,
    /// log10 of how many such agreements accident would make.
    pub log10_false_alarms: f64,
}

/// A pair agrees within this distance, pixels of a.
const TOLERANCE_PX: f64 = 2.5;
/// A keypoint's own orientation agrees within this; by accident, one in 360 / 50 does.
const TURN_TOLERANCE_DEG: f64 = 25.0;
/// The scales that two keypoints were found on agree with that of the frames within this factor.
const SCALE_TOLERANCE: f64 = 1.7;
/// Pairs drawn at most; where one correspondence in forty is right, a right pair is missed with probability
/// (1 - 1/1600)^20000 = 4e-6.
const DRAWS: usize = 20_000;
/// Drawing ends where a larger consensus would have been met with all but this probability.
const MISSED: f64 = 1e-6;
/// Points nearer than this to each other say little of turn and scale.
const LEAST_BASE_PX: f64 = 12.0;
const ROUNDS: usize = 4;
/// What pulls one pair off (relief, the shape of the lens) pulls its neighbours too: one in this many counts.
const PAIRS_PER_INDEPENDENT: f64 = 4.0;
/// Keypoints nearer than this see the same corner: they count once.
const APART_PX: f64 = 8.0;
/// Keypoints are not spread evenly: an accidental neighbour is so many times as likely.
const UNEVENNESS: f64 = 3.0;

/// The similarity with the largest consensus, by least squares over the pairs that agree. The draws
/// are the same for the same input. `None` with fewer than two pairs, or where no drawn pair of them agrees on turn
/// and scale within bounds.
pub fn estimate(pairs: &[Pair], frames: &Frames, scale_bounds: (f64, f64)) -> Option<Consensus> {
    let columns = Columns::new(pairs);
    let mut best: Option<(usize, Similarity)> = None;
    let mut draw = Draw { state: 0x2545_f491, count: pairs.len() };
    let everything = pairs.len() * pairs.len().saturating_sub(1) / 2;
    let mut draws = DRAWS.min(everything);
    let mut k = 0;
    while k < draws {
        let (i, j) = if everything <= DRAWS { nth_pair(k, pairs.len()) } else { draw.two() };
        k += 1;
        let Some(s) = hypothesis(&pairs[i], &pairs[j], scale_bounds) else { continue };
        let count = columns.agreeing(&s);
        if best.as_ref().is_none_or(|(n, _)| count > *n) {
            best = Some((count, s));
            let share = count as f64 / pairs.len() as f64;
            if everything > DRAWS && share < 1.0 {
                draws = draws.min((MISSED.ln() / (-share * share).ln_1p()).ceil() as usize);
            }
        }
    }
    let (_, largest) = best?;
    let largest = settled(pairs, largest)?;
    let displacement = largest.similarity.apply(frames.centre_of_b) - frames.size_of_a / 2.0;
    let is_other = |i: &usize| largest.inliers.binary_search(i).is_err();
    let others: Vec<&Pair> = (0..pairs.len()).filter(is_other).map(|i| &pairs[i]).collect();
    let lower = lower_surface(&others, &largest.similarity, largest.inliers.len(), displacement);
    Some(match lower.and_then(|guess| settled(pairs, guess)) {
        Some(ground) => assessed(pairs, ground, &largest.inliers, frames),
        None => assessed(pairs, largest, &[], frames),
    })
}

/// A similarity by least squares, and the pairs that agree with it.
struct Settled {
    similarity: Similarity,
    inliers: Vec<usize>,
}

/// Least squares over those that agree, until they stay the same.
fn settled(pairs: &[Pair], mut similarity: Similarity) -> Option<Settled> {
    for _ in 0..ROUNDS {
        let Some((next, ..)) = least_squares(pairs, &agreeing(pairs, &similarity)) else { break };
        similarity = next;
    }
    let inliers = agreeing(pairs, &similarity);
    Some(Settled { similarity: least_squares(pairs, &inliers)?.0, inliers })
}

/// What can be said of it; `above` are the pairs of a surface above, which do not contradict it.
fn assessed(pairs: &[Pair], found: Settled, above: &[usize], frames: &Frames) -> Consensus {
    let Settled { similarity, inliers } = found;
    let squares: f64 = inliers.iter().map(|&i| (pairs[i].a - similarity.apply(pairs[i].b)).norm_squared()).sum();
    let freedom = (2 * inliers.len()) as f64 - 4.0;
    let variance_px2 = if freedom > 0.0 { squares / freedom } else { f64::INFINITY };
    let precision = least_squares(pairs, &inliers).map_or(Precision::none(), |(_, inverse, middle)| {
        let mut j = Matrix4::identity();
        j.fixed_rows_mut::<2>(0).copy_from(&design(frames.centre_of_b - middle));
        let covariance = j * inverse * j.transpose() * (variance_px2 * PAIRS_PER_INDEPENDENT);
        Precision::of(&similarity, &covariance)
    });
    let is_shared =
        |i: &usize| is_inside(similarity.apply(pairs[*i].b), frames.size_of_a) && above.binary_search(i).is_err();
    Consensus {
        similarity,
        precision,
        inliers: inliers.len(),
        in_overlap: (0..pairs.len()).filter(is_shared).count(),
        log10_false_alarms: accidents(pairs, &inliers, frames.size_of_a.x * frames.size_of_a.y),
    }
}

/// The similarity through two pairs, where it agrees with their orientations and scales.
fn hypothesis(p: &Pair, q: &Pair, scale_bounds: (f64, f64)) -> Option<Similarity> {
    if (p.b - q.b).norm_squared() < LEAST_BASE_PX * LEAST_BASE_PX {
        return None;
    }
    let s = Similarity::through([p.b, q.b], [p.a, q.a])?;
    let scale = s.scale();
    let is_within = (scale_bounds.0..=scale_bounds.1).contains(&scale);
    (is_within && [p, q].iter().all(|pair| pair.agrees_in_kind(&s))).then_some(s)
}

impl Pair {
    /// Whether the keypoints' own orientations and scales are those of the similarity.
    pub fn agrees_in_kind(&self, s: &Similarity) -> bool {
        let scale = s.scale();
        let (sin, cos) = self.turn_rad.sin_cos();
        let ratio = scale / self.scale;
        s.c * cos + s.s * sin >= scale * TURN_TOLERANCE_DEG.to_radians().cos()
            && (1.0 / SCALE_TOLERANCE..=SCALE_TOLERANCE).contains(&ratio)
    }
}

fn is_inside(p: Vector2<f64>, size: Vector2<f64>) -> bool {
    p.x > 0.0 && p.y > 0.0 && p.x < size.x && p.y < size.y
}

fn agreeing(pairs: &[Pair], s: &Similarity) -> Vec<usize> {
    let agrees = |p: &Pair| (p.a - s.apply(p.b)).norm_squared() <= TOLERANCE_PX * TOLERANCE_PX && p.agrees_in_kind(s);
    (0..pairs.len()).filter(|&i| agrees(&pairs[i])).collect()
}

/// log10 of the expected number of accidental agreements as large: each pair agrees by accident where a's point falls
/// into the disc of the tolerance and its orientation within its own.
fn accidents(pairs: &[Pair], inliers: &[usize], area_px2: f64) -> f64 {
    let mut apart: Vec<&Pair> = Vec::new();
    let near = |p: Vector2<f64>, q: Vector2<f64>| (p - q).norm_squared() < APART_PX * APART_PX;
    for pair in inliers.iter().map(|&i| &pairs[i]) {
        if !apart.iter().any(|other| near(pair.a, other.a) || near(pair.b, other.b)) {
            apart.push(pair);
        }
    }
    let chance = UNEVENNESS * PI * TOLERANCE_PX * TOLERANCE_PX / area_px2 * (2.0 * TURN_TOLERANCE_DEG / 360.0);
    log10_false_alarms(&Agreement { windows: pairs.len(), agreeing: apart.len(), chance: chance.min(1.0), places: 1.0 })
}

/// The pairs' coordinates as columns, to count agreement quickly.
struct Columns {
    a: [Vec<f32>; 2],
    b: [Vec<f32>; 2],
}

impl Columns {
    fn new(pairs: &[Pair]) -> Self {
        let column = |value: fn(&Pair) -> f64| pairs.iter().map(|p| value(p) as f32).collect();
        Self { a: [column(|p| p.a.x), column(|p| p.a.y)], b: [column(|p| p.b.x), column(|p| p.b.y)] }
    }

    /// How many lie within the tolerance.
    fn agreeing(&self, s: &Similarity) -> usize {
        count_agreeing(self, s)
    }

    #[inline(always)]
    fn agreeing_of(&self, s: &Similarity) -> usize {
        const SQUARE: f32 = (TOLERANCE_PX * TOLERANCE_PX) as f32;
        let [c, sine, tx, ty] = [s.c, s.s, s.t.x, s.t.y].map(|v| v as f32);
        let count = self.a[0].len();
        let [ax, ay, bx, by] = [&self.a[0], &self.a[1], &self.b[0], &self.b[1]].map(|column| &column[..count]);
        let mut agreeing = 0u32;
        for i in 0..count {
            let x = c * bx[i] - sine * by[i] + tx - ax[i];
            let y = sine * bx[i] + c * by[i] + ty - ay[i];
            agreeing += u32::from(x * x + y * y <= SQUARE);
        }
        agreeing as usize
    }
}

dispatch! {
    fn count_agreeing(columns: &Columns, s: &Similarity) -> usize {
        columns.agreeing_of(s)
    }
}

/// Least squares around the middle of b's points; `None` with fewer than two.
fn least_squares(pairs: &[Pair], inliers: &[usize]) -> Option<(Similarity, Matrix4<f64>, Vector2<f64>)> {
    if inliers.len() < 2 {
        return None;
    }
    let middle = inliers.iter().map(|&i| pairs[i].b).sum::<Vector2<f64>>() / inliers.len() as f64;
    let mut normal = Matrix4::zeros();
    let mut right = Vector4::zeros();
    for &i in inliers {
        let j = design(pairs[i].b - middle);
        normal += j.transpose() * j;
        right += j.transpose() * pairs[i].a;
    }
    let inverse = normal.try_inverse()?;
    let p = inverse * right;
    Some((Similarity::about(p[2], p[3], middle, Vector2::new(p[0], p[1])), inverse, middle))
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

#[cfg(test)]
mod tests {
    use super::*;

    fn frames() -> Frames {
        Frames { size_of_a: [512.0, 512.0].into(), centre_of_b: [256.0, 256.0].into() }
    }

    /// `right` pairs of one motion among `wrong` ones of chance.
    fn mixture(right: usize, wrong: usize) -> (Similarity, Vec<Pair>) {
        let truth = Similarity::about(0.9, 0.5, Vector2::new(256.0, 256.0), Vector2::new(200.0, 300.0));
        let mut draw = Draw { state: 99, count: 51_200 };
        let mut point = || Vector2::new(draw.one() as f64 / 100.0, draw.one() as f64 / 100.0);
        let pair = |i: usize| {
            let b = point();
            let (a, turn_rad) =
                if i < right { (truth.apply(b), truth.rotation_rad() + 0.1) } else { (point(), point().x) };
            Pair { a, b, turn_rad, scale: 1.0 }
        };
        (truth, (0..right + wrong).map(pair).collect())
    }

    #[test]
    fn finds_one_right_pair_in_twenty_and_says_it_is_no_accident() {
        let (truth, pairs) = mixture(15, 285);
        let found = estimate(&pairs, &frames(), (0.4, 2.5)).unwrap();
        let off = found.similarity.apply([256.0, 256.0].into()) - truth.apply([256.0, 256.0].into());
        assert!(off.norm() < 0.5 && found.inliers >= 15 && found.log10_false_alarms < -12.0);
    }

    #[test]
    fn chance_alone_stays_an_accident() {
        let (_, pairs) = mixture(0, 300);
        let found = estimate(&pairs, &frames(), (0.4, 2.5));
        assert!(found.is_none_or(|f| f.log10_false_alarms > -3.0));
    }

    #[test]
    fn one_corner_seen_many_times_is_one_witness() {
        let (_, mut pairs) = mixture(3, 0);
        pairs.extend(vec![pairs[0]; 40]);
        let found = estimate(&pairs, &frames(), (0.4, 2.5)).unwrap();
        assert!(found.inliers == 43 && found.log10_false_alarms > -5.0, "{}", found.log10_false_alarms);
    }

    #[test]
    fn both_twins_count_alike() {
        let (truth, pairs) = mixture(37, 100);
        let columns = Columns::new(&pairs);
        assert_eq!(columns.agreeing(&truth), columns.agreeing_of(&truth));
        assert!(columns.agreeing(&truth) >= 37);
    }
}
