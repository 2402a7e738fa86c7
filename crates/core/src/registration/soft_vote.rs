//! The soft vote: the similarity under which the whole correlation surfaces of all windows together are highest, and how often chance
//! makes them as high.
//!
//! A window's single peak says nothing where leaning houses, trees or another sun make another place a little higher. So each window keeps
//! its surface, and each value becomes minus the logarithm of its rank share among all displacements: under chance that is exponential
//! whatever the texture, and the sum over windows follows a Gamma law (Fisher's combined probability test).
//!
//! Windows that find the same wrong places have less weight ([`super::clutter`]).
//!
//! # References
//! Fisher, Statistical Methods for Research Workers, 1932, 21.1; for dependent windows Brown, Biometrics 31, 1975: the same law with
//! its variance measured.

use super::a_contrario::log10_gamma_tail;
use super::clutter::WindowWeights;
use super::rank_score::{MEAN_RANK_SCORE, RankScorer};
use super::similarity::Similarity;
use super::windows::WindowSurface;
use nalgebra::Vector2;

/// How far a similarity may go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftVoteOptions {
    /// Search radius of the windows, pixels.
    pub radius_px: usize,
    /// Largest shift of the windows' middle on each axis, pixels; at most `radius_px`.
    pub max_shift_px: usize,
    /// Largest change of scale, |c - 1|.
    pub max_growth: f64,
    /// Largest rotation, |s|, radians.
    pub max_turn_rad: f64,
}

/// The similarity that a soft vote elected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftVote {
    /// Takes a point of the view, px from the pivot, to the map, px from where the pivot was expected. The rotation is linearised: `s`
    /// is the angle in radians, `c` the scale.
    pub map_from_view: Similarity,
    /// Weighted sum over the windows of their rank scores where the similarity puts them, over its mean by chance.
    pub sum_ratio: f64,
    /// Independent windows whose sum would scatter as much by chance.
    pub independent_windows: f64,
    /// Shifts times growths times turns that were compared.
    pub compared: f64,
}

/// Fewer windows elect nothing.
const MIN_WINDOWS: usize = 6;
/// A step of growth or turn moves the outermost window by this much, pixels.
const STEP_PX: f64 = 2.0;
/// Most steps of growth or of turn to each side.
const MAX_STEPS: i64 = 5;
/// The polish of the similarity ends at this step, pixels at the outermost window.
const LAST_STEP_PX: f64 = 0.05;

impl SoftVote {
    /// log10 of the number of false alarms: of similarities with so high a sum by chance, where `places` views voted. All similarities count,
    /// though neighbours depend on each other: so it is rather too large.
    pub fn log10_nfa(&self, places: f64) -> f64 {
        let tests = self.compared.max(1.0).log10() + places.max(1.0).log10();
        log10_gamma_tail(self.independent_windows, self.sum_ratio * self.independent_windows) + tests
    }
}

/// Elects the similarity between a view and the map. The surfaces must cover every displacement of at most the radius on each axis, row by
/// row; `pivot_px` is the point where the shift is stated (the nadir), in the view's pixels. `None` with too few windows.
pub fn soft_vote(
    surfaces: &[WindowSurface],
    weights: &WindowWeights,
    pivot_px: [f64; 2],
    options: &SoftVoteOptions,
) -> Option<SoftVote> {
    if surfaces.len() < MIN_WINDOWS || weights.weights.len() != surfaces.len() {
        return None;
    }
    let ballot = Ballot::new(surfaces, &weights.weights, options);
    let (start, compared) = ballot.highest();
    let (elected, sum) = ballot.polished(start);
    let off_middle = Vector2::from(pivot_px) - ballot.middle_px;
    let t = elected.displacement(off_middle);
    Some(SoftVote {
        map_from_view: Similarity { c: 1.0 + elected.growth, s: elected.turn_rad, t },
        sum_ratio: sum / weights.mean().max(f64::MIN_POSITIVE),
        independent_windows: weights.independent_windows(),
        compared,
    })
}

/// A change of place, scale and heading about the windows' middle.
#[derive(Debug, Clone, Copy)]
struct Change {
    shift_px: Vector2<f64>,
    growth: f64,
    turn_rad: f64,
}

impl Change {
    /// Displacement of a point, from the windows' middle.
    fn displacement(&self, p: Vector2<f64>) -> Vector2<f64> {
        self.shift_px + self.without_shift(p)
    }

    fn without_shift(&self, p: Vector2<f64>) -> Vector2<f64> {
        let (g, r) = (self.growth, self.turn_rad);
        Vector2::new(g * p.x - r * p.y, g * p.y + r * p.x)
    }
}

/// The weighted rank scores of all windows.
struct Ballot {
    /// Of each window, row by row, less their mean by chance.
    scores: Vec<Vec<f32>>,
    /// Mean of the sum by chance, which displacements that were not searched add to.
    mean: f32,
    /// Of each window, pixels from `middle_px`.
    centres_px: Vec<Vector2<f64>>,
    middle_px: Vector2<f64>,
    radius_px: i64,
    /// Growth or turn that moves the outermost window by a pixel.
    per_px: f64,
    options: SoftVoteOptions,
}

impl Ballot {
    fn new(surfaces: &[WindowSurface], weights: &[f32], options: &SoftVoteOptions) -> Self {
        let centres: Vec<_> = surfaces.iter().map(|s| Vector2::from(s.centre_px)).collect();
        let middle_px = centres.iter().sum::<Vector2<f64>>() / centres.len() as f64;
        let centres_px: Vec<_> = centres.iter().map(|c| c - middle_px).collect();
        let half_px = centres_px.iter().map(|c| c.norm()).fold(1.0, f64::max);
        let radius_px = options.radius_px as i64;
        let mut scorer = RankScorer::default();
        let weighted = |(surface, &weight): (&WindowSurface, &f32)| {
            let mut scores = scorer.scores(&surface.scores);
            scores.iter_mut().for_each(|score| *score = (*score - MEAN_RANK_SCORE) * weight);
            scores
        };
        let scores = surfaces.iter().zip(weights).map(weighted).collect();
        let mean = weights.iter().map(|weight| weight * MEAN_RANK_SCORE).sum();
        Self { scores, mean, centres_px, middle_px, radius_px, per_px: 1.0 / half_px, options: *options }
    }

    fn side(&self) -> usize {
        (2 * self.radius_px + 1) as usize
    }

    /// The highest sum over whole pixels of shift and steps of growth and turn, and how many were compared.
    fn highest(&self) -> (Change, f64) {
        let (side, step) = (self.side(), STEP_PX * self.per_px);
        let steps = |most: f64| ((most / step).ceil() as i64).clamp(1, MAX_STEPS);
        let (growths, turns) = (steps(self.options.max_growth), steps(self.options.max_turn_rad));
        let mut best = (f32::NEG_INFINITY, Change { shift_px: Vector2::zeros(), growth: 0.0, turn_rad: 0.0 });
        for growth in (-growths..=growths).map(|i| i as f64 * step) {
            for turn_rad in (-turns..=turns).map(|i| i as f64 * step) {
                let change = Change { shift_px: Vector2::zeros(), growth, turn_rad };
                for (i, &sum) in self.sums(&change).iter().enumerate() {
                    let shift_px = Vector2::new(i % side, i / side).map(|v| v as f64 - self.radius_px as f64);
                    if sum > best.0 && self.is_within(shift_px) {
                        best = (sum, Change { shift_px, ..change });
                    }
                }
            }
        }
        let shifts = (2 * self.options.max_shift_px + 1).pow(2);
        (best.1, shifts as f64 * ((2 * growths + 1) * (2 * turns + 1)) as f64)
    }

    /// The sum of all windows at every whole shift, row by row, under a growth and a turn.
    fn sums(&self, change: &Change) -> Vec<f32> {
        let side = self.side() as i64;
        let mut sums = vec![self.mean; (side * side) as usize];
        for (scores, &centre) in self.scores.iter().zip(&self.centres_px) {
            let moved = change.without_shift(centre);
            let (dx, dy) = (moved.x.round() as i64, moved.y.round() as i64);
            let (first, end) = ((-dx).clamp(0, side), (side - dx).clamp(0, side));
            if first >= end {
                continue;
            }
            for y in (-dy).clamp(0, side)..(side - dy).clamp(0, side) {
                let row = &mut sums[(y * side + first) as usize..(y * side + end) as usize];
                let from = (y + dy) * side + dx;
                let seen = &scores[(from + first) as usize..(from + end) as usize];
                row.iter_mut().zip(seen).for_each(|(sum, score)| *sum += score);
            }
        }
        sums
    }

    /// The sum under a change, between whole pixels.
    fn sum(&self, change: &Change) -> f64 {
        let at = |(scores, &centre): (&Vec<f32>, &Vector2<f64>)| self.between(scores, change.displacement(centre));
        f64::from(self.mean) + self.scores.iter().zip(&self.centres_px).map(at).sum::<f64>()
    }

    /// Whether a shift may be elected.
    fn is_within(&self, shift_px: Vector2<f64>) -> bool {
        shift_px.amax() <= self.options.max_shift_px as f64 + 0.5
    }

    /// A window's score at a displacement less its mean, bilinear.
    fn between(&self, scores: &[f32], displacement_px: Vector2<f64>) -> f64 {
        let at = displacement_px.add_scalar(self.radius_px as f64);
        let (left, top) = (at.x.floor(), at.y.floor());
        let (fx, fy) = (at.x - left, at.y - top);
        let side = self.side() as i64;
        let score = |x: i64, y: i64| {
            let is_searched = (0..side).contains(&x) && (0..side).contains(&y);
            f64::from(if is_searched { scores[(y * side + x) as usize] } else { 0.0 })
        };
        let (x, y) = (left as i64, top as i64);
        let row = |y: i64| score(x, y) * (1.0 - fx) + score(x + 1, y) * fx;
        row(y) * (1.0 - fy) + row(y + 1) * fy
    }

    /// Climbs from a change to the highest sum nearby, coordinate by coordinate, and returns it with its sum.
    fn polished(&self, start: Change) -> (Change, f64) {
        let (mut best, mut sum, mut step_px) = (start, self.sum(&start), 0.5);
        while step_px > LAST_STEP_PX {
            let mut is_moved = false;
            for candidate_of in NEIGHBOURS {
                let candidate = candidate_of(&best, step_px, 2.0 * step_px * self.per_px);
                let candidate_sum = self.sum(&candidate);
                if candidate_sum > sum && self.is_within(candidate.shift_px) {
                    (best, sum, is_moved) = (candidate, candidate_sum, true);
                }
            }
            if !is_moved {
                step_px /= 2.0;
            }
        }
        (best, sum)
    }
}

/// The changes beside one, a step of shift (pixels) or of growth and turn away.
const NEIGHBOURS: [fn(&Change, f64, f64) -> Change; 8] = [
    |c, px, _| Change { shift_px: c.shift_px - Vector2::new(px, 0.0), ..*c },
    |c, px, _| Change { shift_px: c.shift_px + Vector2::new(px, 0.0), ..*c },
    |c, px, _| Change { shift_px: c.shift_px - Vector2::new(0.0, px), ..*c },
    |c, px, _| Change { shift_px: c.shift_px + Vector2::new(0.0, px), ..*c },
    |c, _, by| Change { growth: c.growth - by, ..*c },
    |c, _, by| Change { growth: c.growth + by, ..*c },
    |c, _, by| Change { turn_rad: c.turn_rad - by, ..*c },
    |c, _, by| Change { turn_rad: c.turn_rad + by, ..*c },
];

#[cfg(test)]
mod tests {
    use super::super::robust::Xorshift;
    use super::*;

    fn elected(surfaces: &[WindowSurface], pivot_px: [f64; 2]) -> SoftVote {
        soft_vote(surfaces, &WindowWeights::equal(surfaces.len()), pivot_px, &OPTIONS).unwrap()
    }

    const RADIUS_PX: usize = 8;
    const OPTIONS: SoftVoteOptions =
        SoftVoteOptions { radius_px: RADIUS_PX, max_shift_px: RADIUS_PX, max_growth: 0.1, max_turn_rad: 0.1 };

    /// Surfaces of noise, with a bump of the given height where a change puts each window.
    fn surfaces(seed: u32, change: &Change, bump: f64) -> Vec<WindowSurface> {
        let mut draw = Xorshift::new(seed);
        let side = 2 * RADIUS_PX + 1;
        let window = |i: usize| {
            let centre_px = [(i % 10) as f64 * 12.0 + 6.0, (i / 10) as f64 * 12.0 + 6.0];
            let at = change.displacement(Vector2::from(centre_px) - Vector2::new(60.0, 36.0)).add_scalar(8.0);
            let mut value = |p: usize| {
                let noise = draw.below(1_000_001) as f64 / 1e6;
                let square = (Vector2::new((p % side) as f64, (p / side) as f64) - at).norm_squared();
                (noise + bump * (-square / 3.0).exp()) as f32
            };
            WindowSurface { centre_px, scores: (0..side * side).map(&mut value).collect() }
        };
        (0..60).map(window).collect()
    }

    #[test]
    fn elects_the_similarity_that_no_window_shows_alone() {
        let change = Change { shift_px: Vector2::new(2.3, -1.6), growth: 0.03, turn_rad: -0.05 };
        let vote = elected(&surfaces(7, &change, 0.5), [60.0, 36.0]);
        assert!((vote.map_from_view.t - change.shift_px).norm() < 0.5, "{vote:?}");
        assert!((vote.map_from_view.c - 1.03).abs() < 0.01 && (vote.map_from_view.s + 0.05).abs() < 0.01, "{vote:?}");
        assert!(vote.log10_nfa(1.0) < -8.0, "{}", vote.log10_nfa(1.0));
        let elsewhere = elected(&surfaces(7, &change, 0.5), [0.0, 0.0]);
        let shift = change.displacement(Vector2::new(-60.0, -36.0));
        assert!((elsewhere.map_from_view.t - shift).norm() < 1.5, "the shift is stated at the pivot");
    }

    #[test]
    fn chance_is_never_surprising() {
        let none = Change { shift_px: Vector2::zeros(), growth: 0.0, turn_rad: 0.0 };
        let nfas = (1..=100).map(|seed| elected(&surfaces(seed, &none, 0.0), [0.0; 2]));
        let low = nfas.filter(|vote| vote.log10_nfa(1.0) < -1.0).count();
        assert!(low <= 2, "{low} of 100 below 0.1");
    }

    #[test]
    fn few_windows_elect_nothing() {
        let none = Change { shift_px: Vector2::zeros(), growth: 0.0, turn_rad: 0.0 };
        assert!(soft_vote(&surfaces(1, &none, 1.0)[..5], &WindowWeights::equal(5), [0.0; 2], &OPTIONS).is_none());
    }

    #[test]
    fn a_window_without_weight_says_nothing() {
        let change = Change { shift_px: Vector2::new(2.3, -1.6), growth: 0.03, turn_rad: -0.05 };
        let mut windows = surfaces(7, &change, 0.5);
        windows.extend(surfaces(8, &Change { shift_px: Vector2::new(-4.0, 4.0), ..change }, 5.0));
        let weights = (0..120).map(|i| if i < 60 { 1.0 } else { 0.0 }).collect();
        let weights = WindowWeights { weights, ..WindowWeights::equal(120) };
        let vote = soft_vote(&windows, &weights, [60.0, 36.0], &OPTIONS).unwrap();
        assert!((vote.map_from_view.t - change.shift_px).norm() < 0.5, "{vote:?}");
        assert!((vote.independent_windows - 60.0 / 1.3).abs() < 1e-9);
    }
}
