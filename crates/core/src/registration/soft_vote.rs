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
use super::rank_score::MEAN_RANK_SCORE;
use super::ranked_windows::RankedWindows;
use super::similarity::Similarity;
use crate::simd::dispatch;
use nalgebra::{Matrix2, Vector2};

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

/// How windows move on the ground where the camera's pitch and roll are not what the view assumes. Beyond a similarity, that is the
/// keystone of an image: it grows with the square of the distance from the middle.
#[derive(Debug, Clone, PartialEq)]
pub struct TiltMotion {
    /// Of each window, pixels per radian: the columns are those of pitch and of roll, about the ground under the image's centre.
    pub px_per_rad: Vec<Matrix2<f64>>,
    /// Largest pitch and largest roll that are compared, radians.
    pub max_rad: f64,
}

/// The similarity that a soft vote elected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftVote {
    /// Takes a point of the view, px from the pivot, to the map, px from where the pivot was expected. The rotation is linearised: `s`
    /// is the angle in radians, `c` the scale.
    pub map_from_view: Similarity,
    /// The camera's pitch and roll less the assumed ones, radians; 0 where they were not compared.
    pub tilt_rad: [f64; 2],
    /// Weighted sum over the windows of their rank scores where the similarity puts them, over its mean by chance.
    pub sum_ratio: f64,
    /// Independent windows whose sum would scatter as much by chance.
    pub independent_windows: f64,
    /// Shifts times growths times turns times tilts that were compared.
    pub compared: f64,
}

/// Fewer windows elect nothing.
const MIN_WINDOWS: usize = 6;
/// A step of growth or turn moves the outermost window by this much, pixels.
const STEP_PX: f64 = 2.0;
/// Most steps of growth or of turn to each side, and of pitch or roll.
const MAX_STEPS: i64 = 5;
const MAX_TILT_STEPS: i64 = 2;
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

/// Elects the similarity between a view and the map, and the tilt where its motion is given. `pivot_px` is the point where the shift is
/// stated (the nadir), in the view's pixels. `None` with too few windows, and where weights or motion are not those of the windows.
pub fn soft_vote(
    windows: &RankedWindows,
    weights: &WindowWeights,
    tilt: Option<&TiltMotion>,
    pivot_px: [f64; 2],
    options: &SoftVoteOptions,
) -> Option<SoftVote> {
    let count = windows.scores.len();
    let still = TiltMotion { px_per_rad: vec![Matrix2::zeros(); count], max_rad: 0.0 };
    let tilt = tilt.unwrap_or(&still);
    if count < MIN_WINDOWS || weights.weights.len() != count || tilt.px_per_rad.len() != count {
        return None;
    }
    let ballot = Ballot::new(windows, &weights.weights, tilt, options);
    let (start, compared) = ballot.highest();
    let (elected, sum) = ballot.polished(start);
    let off_middle = Vector2::from(pivot_px) - ballot.middle_px;
    let t = elected.displacement(off_middle, &-ballot.tilt_middle_px_per_rad);
    Some(SoftVote {
        map_from_view: Similarity { c: 1.0 + elected.growth, s: elected.turn_rad, t },
        tilt_rad: elected.tilt_rad.into(),
        sum_ratio: sum / weights.mean().max(f64::MIN_POSITIVE),
        independent_windows: weights.independent_windows(),
        compared,
    })
}

/// A change of place, scale and heading about the windows' middle, and of tilt.
#[derive(Debug, Clone, Copy)]
struct Change {
    shift_px: Vector2<f64>,
    growth: f64,
    turn_rad: f64,
    tilt_rad: Vector2<f64>,
}

impl Change {
    const NONE: Self =
        Self { shift_px: Vector2::new(0.0, 0.0), growth: 0.0, turn_rad: 0.0, tilt_rad: Vector2::new(0.0, 0.0) };

    /// Displacement of a point, from the windows' middle, that a tilt moves by so much.
    fn displacement(&self, p: Vector2<f64>, px_per_rad: &Matrix2<f64>) -> Vector2<f64> {
        self.shift_px + self.without_shift(p, px_per_rad)
    }

    fn without_shift(&self, p: Vector2<f64>, px_per_rad: &Matrix2<f64>) -> Vector2<f64> {
        let (g, r) = (self.growth, self.turn_rad);
        Vector2::new(g * p.x - r * p.y, g * p.y + r * p.x) + px_per_rad * self.tilt_rad
    }

    /// The change a step away on one axis: shift (0, 1), growth (2), turn (3), pitch (4), roll (5).
    fn moved(mut self, axis: usize, by: f64) -> Self {
        match axis {
            0 | 1 => self.shift_px[axis] += by,
            2 => self.growth += by,
            3 => self.turn_rad += by,
            _ => self.tilt_rad[axis - FIRST_TILT_AXIS] += by,
        }
        self
    }
}

/// A window's place in the view.
struct Seat {
    /// Pixels from the windows' middle.
    centre_px: Vector2<f64>,
    /// How a tilt moves it, pixels per radian, less the mean of all windows, which is a shift.
    px_per_rad: Matrix2<f64>,
}

/// Values compared on both sides of none, in steps.
#[derive(Debug, Clone, Copy)]
struct Steps {
    step: f64,
    to_each_side: i64,
}

impl Steps {
    fn values(self) -> impl Iterator<Item = f64> {
        (-self.to_each_side..=self.to_each_side).map(move |i| i as f64 * self.step)
    }

    fn count(self) -> f64 {
        (2 * self.to_each_side + 1) as f64
    }
}

dispatch! {
    /// Adds scores to sums.
    fn add(sums: &mut [f32], scores: &[f32]) {
        sums.iter_mut().zip(scores).for_each(|(sum, score)| *sum += score);
    }
}

fn pairs(a: Steps, b: Steps) -> impl Iterator<Item = [f64; 2]> {
    a.values().flat_map(move |a| b.values().map(move |b| [a, b]))
}

/// The weighted rank scores of all windows.
struct Ballot {
    /// Of each window, less their mean by chance: its square row by row, with zeros between the rows and at both ends, so that it can be
    /// added under any shift in one piece.
    scores: Vec<Vec<f32>>,
    /// Mean of the sum by chance, which displacements that were not searched add to.
    mean: f32,
    /// Of each window.
    seats: Vec<Seat>,
    middle_px: Vector2<f64>,
    /// How a tilt moves the windows on the mean, pixels per radian.
    tilt_middle_px_per_rad: Matrix2<f64>,
    radius_px: i64,
    /// Growth or turn that moves the outermost window by a pixel.
    per_px: f64,
    /// Pitch or roll that moves the window that it moves most by a pixel, radians; 0 where tilts are not compared.
    tilt_per_px: f64,
    max_tilt_rad: f64,
    options: SoftVoteOptions,
}

impl Ballot {
    /// Weights and motion are those of the windows.
    fn new(windows: &RankedWindows, weights: &[f32], tilt: &TiltMotion, options: &SoftVoteOptions) -> Self {
        let count = windows.scores.len() as f64;
        let middle_px = windows.centres_px.iter().sum::<Vector2<f64>>() / count;
        let tilt_middle_px_per_rad = tilt.px_per_rad.iter().sum::<Matrix2<f64>>() / count;
        let seat = |(centre, motion): (&Vector2<f64>, &Matrix2<f64>)| Seat {
            centre_px: centre - middle_px,
            px_per_rad: motion - tilt_middle_px_per_rad,
        };
        let seats: Vec<_> = windows.centres_px.iter().zip(&tilt.px_per_rad).map(seat).collect();
        let half_px = seats.iter().map(|seat| seat.centre_px.norm()).fold(1.0, f64::max);
        let columns = seats.iter().flat_map(|seat| [0, 1].map(|axis| seat.px_per_rad.column(axis).norm()));
        let most_px_per_rad = columns.fold(0.0, f64::max);
        let mut ballot = Self {
            scores: Vec::new(),
            mean: weights.iter().map(|weight| weight * MEAN_RANK_SCORE).sum(),
            seats,
            middle_px,
            tilt_middle_px_per_rad,
            radius_px: options.radius_px as i64,
            per_px: 1.0 / half_px,
            tilt_per_px: if most_px_per_rad > 0.0 { 1.0 / most_px_per_rad } else { 0.0 },
            max_tilt_rad: tilt.max_rad,
            options: *options,
        };
        let weighted = windows.scores.iter().zip(weights);
        ballot.scores = weighted.map(|(scores, &weight)| ballot.padded(scores, weight)).collect();
        ballot
    }

    /// The square of a window, weighted and with its zeros.
    fn padded(&self, scores: &[f32], weight: f32) -> Vec<f32> {
        let side = self.side();
        let mut padded = vec![0.0; side * self.stride() + 2 * (side - 1)];
        for (y, row) in scores.chunks_exact(side).enumerate() {
            let first = self.place(0, y as i64);
            padded[first..first + side].iter_mut().zip(row).for_each(|(to, score)| *to = score * weight);
        }
        padded
    }

    fn side(&self) -> usize {
        (2 * self.radius_px + 1) as usize
    }

    /// From one row to the next: as many zeros as a shift may be long before nothing of the square overlaps.
    fn stride(&self) -> usize {
        2 * self.side() - 1
    }

    /// Where a displacement stands in the padded scores, counted from the corner of the square.
    fn place(&self, x: i64, y: i64) -> usize {
        (self.side() as i64 - 1 + y * self.stride() as i64 + x) as usize
    }

    fn steps(&self, most: f64) -> Steps {
        let step = STEP_PX * self.per_px;
        Steps { step, to_each_side: ((most / step).ceil() as i64).clamp(1, MAX_STEPS) }
    }

    /// Of pitch and of roll; none where the largest moves no window by half a step.
    fn tilt_steps(&self) -> Steps {
        let step = STEP_PX * self.tilt_per_px;
        let to_each_side = if step > 0.0 { (self.max_tilt_rad / step).round() as i64 } else { 0 };
        Steps { step, to_each_side: to_each_side.clamp(0, MAX_TILT_STEPS) }
    }

    /// The highest sum over whole pixels of shift and steps of growth, turn and tilt, and how many might have been compared: all growths and
    /// turns of the level camera, then all tilts, then growth and turn anew.
    fn highest(&self) -> (Change, f64) {
        let (growths, turns) = (self.steps(self.options.max_growth), self.steps(self.options.max_turn_rad));
        let tilts = self.tilt_steps();
        let level = pairs(growths, turns).map(|[growth, turn_rad]| Change { growth, turn_rad, ..Change::NONE });
        let mut best = self.best_of(level);
        if tilts.to_each_side > 0 {
            let tilted = pairs(tilts, tilts).map(|tilt_rad| Change { tilt_rad: tilt_rad.into(), ..best.1 });
            best = self.best_of(tilted);
            let [near_growths, near_turns] = [growths, turns].map(|steps| Steps { to_each_side: 1, ..steps });
            let anew = pairs(near_growths, near_turns).map(|[growth, turn_rad]| Change {
                growth: best.1.growth + growth,
                turn_rad: best.1.turn_rad + turn_rad,
                ..best.1
            });
            best = self.best_of(anew);
        }
        let shifts = (2 * self.options.max_shift_px + 1).pow(2) as f64;
        (best.1, shifts * growths.count() * turns.count() * tilts.count().powi(2))
    }

    /// The highest sum of some changes over all whole shifts that may be elected.
    fn best_of(&self, changes: impl Iterator<Item = Change>) -> (f32, Change) {
        let most = (self.options.max_shift_px as i64).min(self.radius_px);
        let mut best = (f32::NEG_INFINITY, Change::NONE);
        let mut sums = Vec::new();
        for change in changes {
            self.sum_shifts(&change, &mut sums);
            for y in -most..=most {
                let first = (y + self.radius_px) as usize * self.stride() + (self.radius_px - most) as usize;
                for (x, &sum) in (-most..=most).zip(&sums[first..]) {
                    if sum > best.0 {
                        best = (sum, Change { shift_px: Vector2::new(x as f64, y as f64), ..change });
                    }
                }
            }
        }
        best
    }

    /// The sum of all windows at every whole shift under a growth, a turn and a tilt: row by row, with what is no shift between the rows.
    fn sum_shifts(&self, change: &Change, sums: &mut Vec<f32>) {
        let (side, stride) = (self.side() as i64, self.stride());
        sums.clear();
        sums.resize(self.side() * stride, self.mean);
        for (scores, seat) in self.scores.iter().zip(&self.seats) {
            let moved = change.without_shift(seat.centre_px, &seat.px_per_rad);
            let (dx, dy) = (moved.x.round() as i64, moved.y.round() as i64);
            if dx.abs() >= side || dy.abs() >= side {
                continue;
            }
            let rows = (-dy).max(0)..(side - dy).min(side);
            let sums = &mut sums[rows.start as usize * stride..rows.end as usize * stride];
            let first = self.place(dx, rows.start + dy);
            add(sums, &scores[first..first + sums.len()]);
        }
    }

    /// The sum under a change, between whole pixels.
    fn sum(&self, change: &Change) -> f64 {
        let at = |(scores, seat): (&Vec<f32>, &Seat)| {
            self.between(scores, change.displacement(seat.centre_px, &seat.px_per_rad))
        };
        f64::from(self.mean) + self.scores.iter().zip(&self.seats).map(at).sum::<f64>()
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
            f64::from(if is_searched { scores[self.place(x, y)] } else { 0.0 })
        };
        let (x, y) = (left as i64, top as i64);
        let row = |y: i64| score(x, y) * (1.0 - fx) + score(x + 1, y) * fx;
        row(y) * (1.0 - fy) + row(y + 1) * fy
    }

    /// Climbs from a change to the highest sum nearby, coordinate by coordinate, and returns it with its sum.
    fn polished(&self, start: Change) -> (Change, f64) {
        let (mut best, mut sum, mut step_px) = (start, self.sum(&start), 0.5);
        let tilts = self.tilt_steps().to_each_side > 0;
        while step_px > LAST_STEP_PX {
            let mut is_moved = false;
            let (change_by, tilt_by) = (2.0 * step_px * self.per_px, 2.0 * step_px * self.tilt_per_px);
            for (axis, by) in [(0, step_px), (1, step_px), (2, change_by), (3, change_by), (4, tilt_by), (5, tilt_by)] {
                if axis >= FIRST_TILT_AXIS && !tilts {
                    continue;
                }
                for by in [-by, by] {
                    let candidate = best.moved(axis, by);
                    let candidate_sum = self.sum(&candidate);
                    if candidate_sum > sum && self.is_within(candidate.shift_px) {
                        (best, sum, is_moved) = (candidate, candidate_sum, true);
                    }
                }
            }
            if !is_moved {
                step_px /= 2.0;
            }
        }
        (best, sum)
    }
}

/// The first of the axes of a change that belong to the tilt.
const FIRST_TILT_AXIS: usize = 4;

#[cfg(test)]
mod tests {
    use super::super::robust::Xorshift;
    use super::super::windows::WindowSurface;
    use super::*;

    /// About the middle of the windows, under a camera 60 px above the ground.
    fn px_per_rad(p: Vector2<f64>) -> Matrix2<f64> {
        Matrix2::new(p.x * p.y, p.x * p.x, p.y * p.y, p.x * p.y) / 60.0
    }

    fn displacement_of(change: &Change, centre_px: Vector2<f64>) -> Vector2<f64> {
        let from_middle = centre_px - Vector2::new(60.0, 36.0);
        change.displacement(from_middle, &px_per_rad(from_middle))
    }

    fn tilt_motion(surfaces: &[WindowSurface]) -> TiltMotion {
        let of = |s: &WindowSurface| px_per_rad(Vector2::from(s.centre_px) - Vector2::new(60.0, 36.0));
        TiltMotion { px_per_rad: surfaces.iter().map(of).collect(), max_rad: 0.14 }
    }

    fn elected(surfaces: &[WindowSurface], pivot_px: [f64; 2]) -> SoftVote {
        soft_vote(&RankedWindows::new(surfaces), &WindowWeights::equal(surfaces.len()), None, pivot_px, &OPTIONS)
            .unwrap()
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
            let at = displacement_of(change, Vector2::from(centre_px)).add_scalar(8.0);
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
        let change = Change { shift_px: Vector2::new(2.3, -1.6), growth: 0.03, turn_rad: -0.05, ..Change::NONE };
        let vote = elected(&surfaces(7, &change, 0.5), [60.0, 36.0]);
        assert!((vote.map_from_view.t - change.shift_px).norm() < 0.5, "{vote:?}");
        assert!((vote.map_from_view.c - 1.03).abs() < 0.01 && (vote.map_from_view.s + 0.05).abs() < 0.01, "{vote:?}");
        assert!(vote.log10_nfa(1.0) < -8.0, "{}", vote.log10_nfa(1.0));
        let elsewhere = elected(&surfaces(7, &change, 0.5), [0.0, 0.0]);
        let shift = change.displacement(Vector2::new(-60.0, -36.0), &Matrix2::zeros());
        assert!((elsewhere.map_from_view.t - shift).norm() < 1.5, "the shift is stated at the pivot");
    }

    #[test]
    fn chance_is_never_surprising() {
        let none = Change::NONE;
        let nfas = (1..=100).map(|seed| elected(&surfaces(seed, &none, 0.0), [0.0; 2]));
        let low = nfas.filter(|vote| vote.log10_nfa(1.0) < -1.0).count();
        assert!(low <= 2, "{low} of 100 below 0.1");
    }

    #[test]
    fn a_tilt_is_elected_with_the_place_and_its_search_is_charged() {
        let tilt_rad = Vector2::new(0.09, -0.06);
        let change = Change { shift_px: Vector2::new(2.3, -1.6), tilt_rad, ..Change::NONE };
        let windows = surfaces(7, &change, 0.5);
        let (weights, pivot_px) = (WindowWeights::equal(60), [60.0, 36.0]);
        let level = soft_vote(&RankedWindows::new(&windows), &weights, None, pivot_px, &OPTIONS).unwrap();
        let tilted =
            soft_vote(&RankedWindows::new(&windows), &weights, Some(&tilt_motion(&windows)), pivot_px, &OPTIONS)
                .unwrap();
        // Less than a step, which moves the outermost window by 2 px.
        assert!((Vector2::from(tilted.tilt_rad) - tilt_rad).norm() < 0.03, "{tilted:?}");
        assert!((tilted.map_from_view.t - change.shift_px).norm() < 0.5, "the shift at the middle: {tilted:?}");
        assert!(tilted.log10_nfa(1.0) < level.log10_nfa(1.0) - 2.0, "{tilted:?} {level:?}");
        assert_eq!(tilted.compared, 25.0 * level.compared);
        let others = TiltMotion { px_per_rad: Vec::new(), max_rad: 0.14 };
        assert!(soft_vote(&RankedWindows::new(&windows), &weights, Some(&others), pivot_px, &OPTIONS).is_none());
    }

    #[test]
    fn chance_is_never_surprising_under_any_tilt() {
        let nfa = |seed| {
            let windows = surfaces(seed, &Change::NONE, 0.0);
            let tilt = tilt_motion(&windows);
            soft_vote(&RankedWindows::new(&windows), &WindowWeights::equal(60), Some(&tilt), [0.0; 2], &OPTIONS)
                .unwrap()
                .log10_nfa(1.0)
        };
        let low = (1..=100).map(nfa).filter(|&nfa| nfa < -1.0).count();
        assert!(low <= 2, "{low} of 100 below 0.1");
    }

    #[test]
    fn few_windows_elect_nothing() {
        let none = Change::NONE;
        assert!(
            soft_vote(
                &RankedWindows::new(&surfaces(1, &none, 1.0)[..5]),
                &WindowWeights::equal(5),
                None,
                [0.0; 2],
                &OPTIONS
            )
            .is_none()
        );
    }

    #[test]
    fn a_window_without_weight_says_nothing() {
        let change = Change { shift_px: Vector2::new(2.3, -1.6), growth: 0.03, turn_rad: -0.05, ..Change::NONE };
        let mut windows = surfaces(7, &change, 0.5);
        windows.extend(surfaces(8, &Change { shift_px: Vector2::new(-4.0, 4.0), ..change }, 5.0));
        let weights = (0..120).map(|i| if i < 60 { 1.0 } else { 0.0 }).collect();
        let weights = WindowWeights { weights, ..WindowWeights::equal(120) };
        let vote = soft_vote(&RankedWindows::new(&windows), &weights, None, [60.0, 36.0], &OPTIONS).unwrap();
        assert!((vote.map_from_view.t - change.shift_px).norm() < 0.5, "{vote:?}");
        assert!((vote.independent_windows - 60.0 / 1.3).abs() < 1e-9);
    }
}
