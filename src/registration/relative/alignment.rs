//! Alignment by brightness: Gauss-Newton over all pixels that both frames see.

use super::Similarity;
use crate::pixels::Gray;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

/// The aligned similarity and how well it places b's centre.
pub struct Aligned {
    /// Takes b to a.
    pub similarity: Similarity,
    /// Of b's centre in a, px^2.
    pub covariance: Matrix2<f64>,
}

type Normal = SMatrix<f64, 6, 6>;
type Gradient = SVector<f64, 6>;

/// Pixels of b are visited on a grid of this step.
const STEP_PX: usize = 2;
const ROUNDS: usize = 12;
/// Steps smaller than this at b's corners end the iteration.
const CONVERGED_PX: f64 = 0.002;
/// The alignment may not leave what the keypoints found by more than this, pixels at b's centre or corners.
const MAX_CORRECTION_PX: f64 = 3.0;
/// Huber's bound, in robust standard deviations.
const HUBER: f64 = 1.345;
/// Neighbouring residuals are not independent (smoothing, relief): one in this many counts.
const SAMPLES_PER_INDEPENDENT: f64 = 12.0;
const LEAST_SAMPLES: usize = 400;

/// Aligns b on a from a start within a pixel or two. `None` where the overlap is too small or flat, or where the
/// iteration runs away: then the start is the better answer.
pub fn align(a: &Gray, b: &Gray, start: &Similarity) -> Option<Aligned> {
    let (a, b) = (smoothed(a), smoothed(b));
    let centre = Vector2::new(b.width_px() as f64 / 2.0, b.height_px() as f64 / 2.0);
    let radius = centre.norm();
    let mut state = State { similarity: *start, gain: 1.0, offset: 0.0, deviation: f64::INFINITY };
    state.match_brightness(&a, &b)?;
    for round in 0..ROUNDS {
        let sums = state.sums(&a, &b, centre)?;
        let step = sums.normal.try_inverse()? * sums.gradient;
        state.apply(&step, centre);
        state.deviation = sums.deviation;
        let moved = Vector2::new(step[0], step[1]).norm() + radius * step[2].hypot(step[3]);
        if moved < CONVERGED_PX && round > 1 {
            break;
        }
    }
    let sums = state.sums(&a, &b, centre)?;
    let shift = (state.similarity.apply(centre) - start.apply(centre)).norm();
    let bend = radius * (state.similarity.c - start.c).hypot(state.similarity.s - start.s);
    if !(shift <= MAX_CORRECTION_PX && bend <= 2.0 * MAX_CORRECTION_PX) {
        return None;
    }
    let inverse = sums.normal.try_inverse()?;
    let covariance = inverse.fixed_view::<2, 2>(0, 0) * (sums.deviation * sums.deviation * SAMPLES_PER_INDEPENDENT);
    Some(Aligned { similarity: state.similarity, covariance })
}

struct State {
    similarity: Similarity,
    gain: f64,
    offset: f64,
    /// Robust standard deviation of the residuals, gray levels.
    deviation: f64,
}

struct Sums {
    normal: Normal,
    gradient: Gradient,
    deviation: f64,
}

impl State {
    /// Gain and offset from the means and spreads of the overlap.
    fn match_brightness(&mut self, a: &Gray, b: &Gray) -> Option<()> {
        let mut pairs = Vec::new();
        self.visit(a, b, |_, value_a, _, value_b| pairs.push((value_a, value_b)));
        if pairs.len() < LEAST_SAMPLES {
            return None;
        }
        let n = pairs.len() as f64;
        let mean = |f: fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>() / n;
        let (mean_a, mean_b) = (mean(|p| p.0), mean(|p| p.1));
        let spread =
            |m: f64, f: fn(&(f64, f64)) -> f64| (pairs.iter().map(|p| (f(p) - m).powi(2)).sum::<f64>() / n).sqrt();
        let (spread_a, spread_b) = (spread(mean_a, |p| p.0), spread(mean_b, |p| p.1));
        if spread_a < 1e-3 {
            return None;
        }
        self.gain = spread_b / spread_a;
        self.offset = mean_b - self.gain * mean_a;
        Some(())
    }

    /// Calls `f(p in b, a's value there, a's gradient there, b's value)` for every grid point that both see.
    fn visit(&self, a: &Gray, b: &Gray, mut f: impl FnMut(Vector2<f64>, f64, Vector2<f64>, f64)) {
        const MARGIN_PX: f64 = 4.0;
        let (limit_x, limit_y) = (a.width_px() as f64 - MARGIN_PX, a.height_px() as f64 - MARGIN_PX);
        let margin = MARGIN_PX as usize;
        for y in (margin..b.height_px().saturating_sub(margin)).step_by(STEP_PX) {
            for x in (margin..b.width_px().saturating_sub(margin)).step_by(STEP_PX) {
                let p = Vector2::new(x as f64 + 0.5, y as f64 + 0.5);
                let q = self.similarity.apply(p);
                if q.x > MARGIN_PX && q.y > MARGIN_PX && q.x < limit_x && q.y < limit_y {
                    let (value, gradient) = cubic(a, q);
                    f(p, value, gradient, f64::from(b.at(x, y)));
                }
            }
        }
    }

    fn sums(&self, a: &Gray, b: &Gray, centre: Vector2<f64>) -> Option<Sums> {
        let mut normal = Normal::zeros();
        let mut gradient = Gradient::zeros();
        let (mut count, mut absolute) = (0usize, 0.0);
        let bound = if self.deviation.is_finite() { HUBER * self.deviation.max(0.2) } else { f64::INFINITY };
        self.visit(a, b, |p, value, slope, seen| {
            let r = seen - (self.gain * value + self.offset);
            let (d, g) = (p - centre, slope * self.gain);
            let j = Gradient::from([g.x, g.y, g.x * d.x + g.y * d.y, g.y * d.x - g.x * d.y, value, 1.0]);
            let weight = if r.abs() <= bound { 1.0 } else { bound / r.abs() };
            for row in 0..6 {
                let w = weight * j[row];
                gradient[row] += w * r;
                for column in row..6 {
                    normal[(row, column)] += w * j[column];
                }
            }
            count += 1;
            absolute += r.abs();
        });
        if count < LEAST_SAMPLES {
            return None;
        }
        normal.fill_lower_triangle_with_upper_triangle();
        // The mean absolute value of a Gaussian is sqrt(2 / pi) of its deviation.
        Some(Sums { normal, gradient, deviation: absolute / count as f64 * 1.2533 })
    }

    /// Parameters: shift of b's centre, growth and turn in units of a's pixels per pixel of b, gain, offset.
    fn apply(&mut self, step: &Gradient, centre: Vector2<f64>) {
        let at_centre = self.similarity.apply(centre) + Vector2::new(step[0], step[1]);
        self.similarity.c += step[2];
        self.similarity.s += step[3];
        let Similarity { c, s, .. } = self.similarity;
        self.similarity.t = at_centre - Vector2::new(c * centre.x - s * centre.y, s * centre.x + c * centre.y);
        self.gain += step[4];
        self.offset += step[5];
    }
}

/// Value and gradient by Catmull-Rom interpolation at a position at least 2 px from the edge.
fn cubic(gray: &Gray, q: Vector2<f64>) -> (f64, Vector2<f64>) {
    let (x, y) = (q.x - 0.5, q.y - 0.5);
    let (x0, y0) = (x as usize, y as usize);
    let (wx, dx) = weights(x - x0 as f64);
    let (wy, dy) = weights(y - y0 as f64);
    let (mut value, mut gx, mut gy) = (0.0, 0.0, 0.0);
    for j in 0..4 {
        let row = &gray.row(y0 + j - 1)[x0 - 1..x0 + 3];
        let (mut along, mut slope) = (0.0, 0.0);
        for i in 0..4 {
            along += wx[i] * f64::from(row[i]);
            slope += dx[i] * f64::from(row[i]);
        }
        value += wy[j] * along;
        gx += wy[j] * slope;
        gy += dy[j] * along;
    }
    (value, Vector2::new(gx, gy))
}

fn weights(t: f64) -> ([f64; 4], [f64; 4]) {
    let (t2, t3) = (t * t, t * t * t);
    (
        [
            0.5 * (-t3 + 2.0 * t2 - t),
            0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
            0.5 * (-3.0 * t3 + 4.0 * t2 + t),
            0.5 * (t3 - t2),
        ],
        [
            0.5 * (-3.0 * t2 + 4.0 * t - 1.0),
            0.5 * (9.0 * t2 - 10.0 * t),
            0.5 * (-9.0 * t2 + 8.0 * t + 1.0),
            0.5 * (3.0 * t2 - 2.0 * t),
        ],
    )
}

/// Binomial smoothing (1 4 6 4 1 / 16) in both directions: less noise and aliasing. The rim is left as it is.
fn smoothed(gray: &Gray) -> Gray {
    gray.filtered_5(|[a, b, c, d, e]| (a + e + 4.0 * (b + d) + 6.0 * c) / 16.0)
}
