//! `Curve`: a smooth line on the ground (road, track, river), and how far a point is from it.

use std::collections::HashMap;

const BIN_M: f64 = 40.0;
const REACH_M: f64 = 40.0;
const STEP_M: f64 = 4.0;

/// A polyline with points every few metres, indexed for short-range distance questions.
pub struct Curve {
    /// Metres east and south of the scene's north-western corner.
    pub points: Vec<[f64; 2]>,
    bins: HashMap<(i32, i32), Vec<u32>>,
}

/// The place of a point beside a curve.
#[derive(Clone, Copy)]
pub struct Beside {
    /// Distance, metres; positive on the right when going along.
    pub offset_m: f64,
    /// Length along the curve to the nearest point, metres (about).
    pub along_m: f64,
}

impl Curve {
    /// Through the given points, by Catmull-Rom splines.
    pub fn through(knots: &[[f64; 2]]) -> Self {
        let mut points = Vec::new();
        for k in 0..knots.len() - 1 {
            let p = |i: isize| knots[(k as isize + i).clamp(0, knots.len() as isize - 1) as usize];
            let (a, b, c, d) = (p(-1), p(0), p(1), p(2));
            let steps = ((c[0] - b[0]).hypot(c[1] - b[1]) / STEP_M).ceil().max(1.0);
            for i in 0..steps as usize {
                let t = i as f64 / steps;
                let at = |j: usize| {
                    0.5 * (2.0 * b[j]
                        + (c[j] - a[j]) * t
                        + (2.0 * a[j] - 5.0 * b[j] + 4.0 * c[j] - d[j]) * t * t
                        + (3.0 * b[j] - a[j] - 3.0 * c[j] + d[j]) * t * t * t)
                };
                points.push([at(0), at(1)]);
            }
        }
        points.push(*knots.last().expect("a curve has knots"));
        let mut bins: HashMap<(i32, i32), Vec<u32>> = HashMap::new();
        for (i, pair) in points.windows(2).enumerate() {
            let range = |j: usize| {
                let bin = |v: f64| (v / BIN_M).floor() as i32;
                bin(pair[0][j].min(pair[1][j]) - REACH_M)..=bin(pair[0][j].max(pair[1][j]) + REACH_M)
            };
            for by in range(1) {
                for bx in range(0) {
                    bins.entry((bx, by)).or_default().push(i as u32);
                }
            }
        }
        Self { points, bins }
    }

    /// Returns the place of (x, y) beside the curve; `None` farther than about 40 m.
    pub fn beside(&self, x: f64, y: f64) -> Option<Beside> {
        let near = self.bins.get(&((x / BIN_M).floor() as i32, (y / BIN_M).floor() as i32))?;
        let mut best: Option<Beside> = None;
        for &i in near {
            let (a, b) = (self.points[i as usize], self.points[i as usize + 1]);
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let length = dx.hypot(dy).max(1e-9);
            let t = (((x - a[0]) * dx + (y - a[1]) * dy) / (length * length)).clamp(0.0, 1.0);
            let (ex, ey) = (x - a[0] - dx * t, y - a[1] - dy * t);
            let offset_m = ex.hypot(ey) * (dx * ey - dy * ex).signum();
            if best.is_none_or(|b| offset_m.abs() < b.offset_m.abs()) {
                best = Some(Beside { offset_m, along_m: (f64::from(i) + t) * STEP_M });
            }
        }
        best
    }

    /// Points about every `spacing_m` along it, with the unit direction there.
    pub fn stations(&self, spacing_m: f64) -> Vec<([f64; 2], [f64; 2])> {
        let every = (spacing_m / STEP_M).round().max(1.0) as usize;
        (0..self.points.len() - 1)
            .step_by(every)
            .map(|i| {
                let (a, b) = (self.points[i], self.points[i + 1]);
                let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
                (a, [(b[0] - a[0]) / length, (b[1] - a[1]) / length])
            })
            .collect()
    }
}
