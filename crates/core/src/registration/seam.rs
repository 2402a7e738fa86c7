//! `find_seam`: a line across a view, beyond which the view fits better elsewhere.
//!
//! Two sources of a map that meet under a frame may be shifted against each other, and so may two parts of a frame whose file was
//! damaged. Windows of the smaller part are then taken for wrong ones, or, where the shift is small, both parts for one that
//! scatters; either way a covariance from residuals is far too small, for it takes the windows to be independent. So the windows
//! beyond every line are correlated together: where no window alone is found, many together may be.

use super::windows::WindowSurface;
use nalgebra::Vector2;

/// The displacements at which the windows of a view are correlated, pixels.
#[derive(Debug, Clone)]
pub struct Displacements {
    /// All, the zero displacement among them.
    pub all_px: Vec<[isize; 2]>,
    zero: usize,
    radius_px: isize,
}

/// A seam, and where the parts of the view on its sides lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seam {
    /// The place of each part less the place of the whole view, pixels right and down, to a pixel or two.
    pub offsets_px: [Vector2<f64>; 2],
    /// How much better the parts fit there, in standard deviations of their correlation elsewhere.
    pub z_score: f64,
    /// Windows of each part.
    pub windows: [usize; 2],
}

/// Displacements as large as two sources of a map usually have against each other, pixels.
const RADIUS_PX: isize = 14;
/// Up to this displacement on each axis every pixel is tried, beyond it every second.
const FINE_RADIUS_PX: isize = 4;
/// Directions of the lines that are tried, over half a turn.
const DIRECTIONS: usize = 8;
/// Fewer windows make no part.
const MIN_WINDOWS: usize = 3;
/// Relief, shadows and other crops move the parts of a view by a pixel.
const LEAST_OFFSET_PX: f64 = 1.9;
/// Both parts together. Of 96 undisturbed frames over maps of another year none has such parts, on ground that half repeats itself 3 of
/// 40. Of 699 accepted frames with a seam of 2 to 10 pixels 26 then have the truth outside their own 99.9 % ellipse.
const MIN_Z_SCORE: f64 = 1.0;
/// Correlations nearer than this to the two places compared do not count as those elsewhere, pixels.
const PEAK_RADIUS_PX: isize = 4;

impl Default for Displacements {
    fn default() -> Self {
        let axis = || -RADIUS_PX..=RADIUS_PX;
        let is_tried = |[x, y]: &[isize; 2]| {
            x.abs().max(y.abs()) <= FINE_RADIUS_PX || x.rem_euclid(2) == 0 && y.rem_euclid(2) == 0
        };
        let all_px: Vec<_> = axis().flat_map(|y| axis().map(move |x| [x, y])).filter(is_tried).collect();
        let zero = all_px.iter().position(|d| *d == [0, 0]).expect("zero is tried");
        Self { all_px, zero, radius_px: RADIUS_PX }
    }
}

impl Displacements {
    /// The largest displacement on one axis, pixels.
    pub fn radius_px(&self) -> usize {
        self.radius_px as usize
    }

    /// The best displacement of a part that is correlated at all of them, and how much better it is than none. `None` on the rim,
    /// where the best may lie beyond.
    fn best(&self, scores: &[f32]) -> Option<(f64, Vector2<f64>)> {
        let best = (0..scores.len()).reduce(|a, b| if scores[b] > scores[a] { b } else { a })?;
        let found = self.all_px[best];
        let is_far = |[x, y]: [isize; 2]| x * x + y * y >= PEAK_RADIUS_PX * PEAK_RADIUS_PX;
        let is_inside = found.iter().all(|v| v.abs() < self.radius_px);
        if !is_inside {
            return None;
        }
        let is_elsewhere = |d: &[isize; 2]| is_far(*d) && is_far([d[0] - found[0], d[1] - found[1]]);
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for (_, score) in self.all_px.iter().zip(scores).filter(|(d, _)| is_elsewhere(d)) {
            let score = f64::from(*score);
            (sum, squares, count) = (sum + score, squares + score * score, count + 1.0);
        }
        let deviation = (squares / count - (sum / count).powi(2)).max(0.0).sqrt();
        let z_score = f64::from(scores[best] - scores[self.zero]) / deviation;
        z_score.is_finite().then(|| (z_score, Vector2::new(found[0] as f64, found[1] as f64)))
    }
}

impl Seam {
    /// The seam between two parts; `None` where both lie at one place. A part that lies nowhere may lie with the whole.
    fn between(sides: [Option<(f64, Vector2<f64>)>; 2], windows: [usize; 2]) -> Option<Self> {
        let [(low, a), (high, b)] = sides.map(Option::unwrap_or_default);
        let z_score = low + high;
        let is_seam = (a - b).norm() >= LEAST_OFFSET_PX && z_score >= MIN_Z_SCORE;
        is_seam.then_some(Self { offsets_px: [a, b], z_score, windows })
    }
}

/// Finds the seam that shows most clearly, by the surfaces of a view's windows over `displacements`. `None` where every part of the
/// view fits best with the whole.
pub fn find_seam(surfaces: &[WindowSurface], displacements: &Displacements) -> Option<Seam> {
    let mut total = vec![0.0; displacements.all_px.len()];
    surfaces.iter().for_each(|surface| add(&mut total, &surface.scores));
    let mut best: Option<Seam> = None;
    for order in orders(surfaces) {
        let mut part = vec![0.0; total.len()];
        for (before, &index) in order.iter().enumerate() {
            let after = order.len() - before;
            if before.min(after) >= MIN_WINDOWS {
                let rest: Vec<f32> = total.iter().zip(&part).map(|(all, part)| all - part).collect();
                let sides = [displacements.best(&part), displacements.best(&rest)];
                let seam = Seam::between(sides, [before, after]);
                best = [best, seam].into_iter().flatten().reduce(|a, b| if b.z_score > a.z_score { b } else { a });
            }
            add(&mut part, &surfaces[index].scores);
        }
    }
    best
}

fn add(sum: &mut [f32], scores: &[f32]) {
    sum.iter_mut().zip(scores).for_each(|(sum, score)| *sum += score);
}

/// The windows in the order in which a line passes over them, for each direction of the line.
fn orders(surfaces: &[WindowSurface]) -> impl Iterator<Item = Vec<usize>> {
    (0..DIRECTIONS).map(|direction| {
        let (sin, cos) = (direction as f64 * std::f64::consts::PI / DIRECTIONS as f64).sin_cos();
        let along = |i: usize| surfaces[i].centre_px[0] * cos + surfaces[i].centre_px[1] * sin;
        let mut order: Vec<usize> = (0..surfaces.len()).collect();
        order.sort_by(|&a, &b| along(a).total_cmp(&along(b)));
        order
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// 6 x 5 windows with a peak of 0.3 to 0.6 each among 60 of at most 0.2; those right of a column lie `shift_px` farther right.
    fn surfaces(seed: u64, column: usize, shift_px: f64) -> Vec<WindowSurface> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let one = |i: usize| {
            let at = if i % 6 >= column { shift_px } else { 0.0 };
            let mut draw = |low: f64, high: f64| rng.random_range(low..high);
            let mut peaks = vec![([at, 0.0], draw(0.3, 0.6))];
            peaks.extend((0..60).map(|_| ([draw(-18.0, 18.0), draw(-18.0, 18.0)], draw(-0.2, 0.2))));
            let score = |[x, y]: &[isize; 2]| {
                let height = |([px, py], peak): &([f64; 2], f64)| {
                    peak * (-((*x as f64 - px).powi(2) + (*y as f64 - py).powi(2)) / 8.0).exp()
                };
                peaks.iter().map(height).sum::<f64>() as f32
            };
            let scores = Displacements::default().all_px.iter().map(score).collect();
            WindowSurface { centre_px: [48.0 * (i % 6) as f64, 48.0 * (i / 6) as f64], scores }
        };
        (0..30).map(one).collect()
    }

    fn found(seed: u64, column: usize, shift_px: f64) -> Option<Seam> {
        find_seam(&surfaces(seed, column, shift_px), &Displacements::default())
    }

    #[test]
    fn one_place_has_no_seam() {
        let seams = (0..200).filter(|&seed| found(seed, 0, 0.0).is_some()).count();
        assert!(seams <= 10, "{seams} of 200");
    }

    #[test]
    fn two_places_are_found_however_far_apart() {
        for (column, shift_px) in [(3, 3.0), (3, 5.0), (3, 9.0), (4, 9.0), (5, 6.0)] {
            let right = |seed: &u64| {
                found(*seed, column, shift_px).is_some_and(|seam| {
                    let apart = seam.offsets_px[1] - seam.offsets_px[0];
                    (apart.norm() - shift_px).abs() < 2.0
                })
            };
            let right = (0..100).filter(right).count();
            assert!(right >= 95, "{column} {shift_px}: {right} of 100");
        }
    }

    #[test]
    fn few_windows_have_no_seam() {
        assert_eq!(find_seam(&[], &Displacements::default()), None);
        assert_eq!(find_seam(&surfaces(1, 3, 9.0)[..5], &Displacements::default()), None);
    }
}
