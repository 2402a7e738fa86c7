//! `Terrain`: heights of the bare ground at the knots of a square grid, bilinear between them.

use super::normal::normal;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Heights of the bare ground, metres. Scene coordinates: metres east and south of the north-western corner.
pub struct Terrain {
    /// Distance between knots, metres.
    pub spacing_m: f64,
    /// Knots from west to east.
    pub columns: usize,
    /// Knots from north to south.
    pub rows: usize,
    /// Row by row from the north.
    pub heights_m: Vec<f32>,
}

impl Terrain {
    /// The terrain of a scene of `size_m` (east, south) whose knots are what `height_m` says of them.
    pub fn new(size_m: [f64; 2], spacing_m: f64, height_m: impl Fn(f64, f64) -> f64 + Sync) -> Self {
        let [columns, rows] = size_m.map(|size| (size / spacing_m).ceil() as usize + 1);
        let at = |i: usize| height_m((i % columns) as f64 * spacing_m, (i / columns) as f64 * spacing_m) as f32;
        Self { spacing_m, columns, rows, heights_m: (0..columns * rows).into_par_iter().map(at).collect() }
    }

    /// Height, metres; beyond the edge that of the edge.
    pub fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        let clamp = |v: f64, n: usize| (v / self.spacing_m).clamp(0.0, (n - 1) as f64 - 1e-9);
        let (x, y) = (clamp(x_m, self.columns), clamp(y_m, self.rows));
        let (i, j) = (x as usize, y as usize);
        let (fx, fy) = (x - i as f64, y - j as f64);
        let at = |di: usize, dj: usize| f64::from(self.heights_m[(j + dj) * self.columns + i + di]);
        (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy) + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy
    }

    /// The terrain as a survey would give it: every `spacing_m`, with errors of a standard deviation `error_m` that neighbouring knots
    /// share by half.
    pub fn surveyed(&self, spacing_m: f64, error_m: f64, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let size_m = [self.columns, self.rows].map(|knots| (knots - 1) as f64 * self.spacing_m);
        let mut surveyed = Self::new(size_m, spacing_m, |x, y| self.height_m(x, y));
        let noise: Vec<f64> = surveyed.heights_m.iter().map(|_| normal(&mut rng)).collect();
        for (i, height) in surveyed.heights_m.iter_mut().enumerate() {
            let beside = [1, surveyed.columns].map(|step| noise[i.saturating_sub(step)]);
            // A sum of four draws, two of them shared with each neighbour.
            *height += (error_m * (noise[i] + (beside[0] + beside[1]) / 2.0) / 1.5f64.sqrt()) as f32;
        }
        surveyed
    }

    /// Rise per metre towards east and south, over a distance of two knots.
    pub fn slope(&self, x_m: f64, y_m: f64) -> [f64; 2] {
        let d = self.spacing_m;
        let along =
            |dx: f64, dy: f64| (self.height_m(x_m + dx, y_m + dy) - self.height_m(x_m - dx, y_m - dy)) / (2.0 * d);
        [along(d, 0.0), along(0.0, d)]
    }

    /// Lowest and highest knot within a distance of a point on each axis, metres.
    pub fn extremes_m(&self, centre: [f64; 2], reach_m: f64) -> [f64; 2] {
        let range = |c: f64, n: usize| {
            let knot = |v: f64| ((v / self.spacing_m).max(0.0) as usize).min(n - 1);
            knot(c - reach_m)..knot(c + reach_m) + 1
        };
        let mut out = [f64::MAX, f64::MIN];
        for row in range(centre[1], self.rows) {
            for column in range(centre[0], self.columns) {
                let height_m = f64::from(self.heights_m[row * self.columns + column]);
                out = [out[0].min(height_m), out[1].max(height_m)];
            }
        }
        out
    }
}
