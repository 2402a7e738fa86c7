//! The probability of a plane polygon under a two-dimensional normal distribution.

use super::polygon::{GAUSS_LEGENDRE, Vertex};

/// The number of standard deviations beyond which a distribution is cut off: 2.7e-7 of a plane normal lies outside.
pub(super) const REACH_SIGMA: f64 = 5.5;

/// A covariance in the plane, stored as its lower Cholesky factor, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlaneNormal {
    sigma_east_m: f64,
    slope_m: f64,
    rest_m: f64,
}

impl PlaneNormal {
    /// Makes the distribution of positive standard deviations and a correlation in (-1, 1).
    pub(super) fn new(sigma_east_m: f64, sigma_north_m: f64, correlation: f64) -> Self {
        // (1 - r)(1 + r) keeps the digits that 1 - r^2 loses.
        let rest_m = sigma_north_m * ((1.0 - correlation) * (1.0 + correlation)).sqrt();
        Self { sigma_east_m, slope_m: correlation * sigma_north_m, rest_m }
    }

    /// The offset (east, north) whose whitened coordinates are (u, v).
    pub(super) fn offset(self, u: f64, v: f64) -> Vertex {
        [self.sigma_east_m * u, self.slope_m * u + self.rest_m * v]
    }

    /// Whitened coordinates of an offset: independent, each of unit variance.
    pub(super) fn whitened(self, offset: Vertex) -> Vertex {
        let u = offset[0] / self.sigma_east_m;
        [u, (offset[1] - self.slope_m * u) / self.rest_m]
    }

    /// L^T n: the direction in the whitened plane whose support point has the outward normal `n` in this plane.
    pub(super) fn whitened_normal(self, n: Vertex) -> Vertex {
        [self.sigma_east_m * n[0] + self.slope_m * n[1], self.rest_m * n[1]]
    }

    /// Semi-minor axis of the one-sigma ellipse, metres.
    pub(super) fn minor_sigma_m(self) -> f64 {
        let trace = self.sigma_east_m.powi(2) + self.slope_m.powi(2) + self.rest_m.powi(2);
        let determinant = (self.sigma_east_m * self.rest_m).powi(2);
        // det / larger eigenvalue: the smaller one without cancellation.
        let larger = trace / 2.0 + (trace * trace / 4.0 - determinant).max(0.0).sqrt();
        (determinant / larger).sqrt()
    }

    /// Product of the semi-axes of the one-sigma ellipse, its area over pi, m^2.
    pub(super) fn axes_product_m2(self) -> f64 {
        self.sigma_east_m * self.rest_m
    }
}

/// The contribution of one directed straight edge of a whitened polygon: the sum over a counterclockwise ring is the
/// probability of its inside. Integrates Phi(u) phi(v) dv (Green's theorem), correct to about 1e-6.
pub(super) fn edge_probability(start: Vertex, end: Vertex) -> f64 {
    // Cuts at |u|, |v| = reach leave pieces on which Phi(u) is 0 or 1, phi(v) is 0, or both are smooth.
    let mut cuts = [0.0, 1.0, 1.0, 1.0, 1.0, 1.0];
    let mut count = 1;
    for axis in 0..2 {
        let (from, along) = (start[axis], end[axis] - start[axis]);
        for limit in [-REACH_SIGMA, REACH_SIGMA] {
            let t = (limit - from) / along;
            if t > 0.0 && t < 1.0 {
                cuts[count] = t;
                count += 1;
            }
        }
    }
    cuts[count] = 1.0;
    cuts[..count].sort_by(f64::total_cmp);
    let at = |t: f64| [start[0] + t * (end[0] - start[0]), start[1] + t * (end[1] - start[1])];
    (0..count).map(|i| piece_probability(at(cuts[i]), at(cuts[i + 1]))).sum()
}

fn piece_probability(start: Vertex, end: Vertex) -> f64 {
    let middle = [(start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0];
    if middle[1].abs() > REACH_SIGMA || middle[0] < -REACH_SIGMA {
        return 0.0;
    }
    if middle[0] > REACH_SIGMA {
        return cumulative(end[1]) - cumulative(start[1]);
    }
    let (du, dv) = (end[0] - start[0], end[1] - start[1]);
    let steps = (du.hypot(dv) / 1.0).ceil().max(1.0) as usize;
    let mut sum = 0.0;
    for step in 0..steps {
        for (s, w) in GAUSS_LEGENDRE {
            let t = (step as f64 + s) / steps as f64;
            sum += w * cumulative(start[0] + t * du) * density(start[1] + t * dv);
        }
    }
    sum * dv / steps as f64
}

fn density(v: f64) -> f64 {
    (-v * v / 2.0).exp() / (2.0 * std::f64::consts::PI).sqrt()
}

/// Phi with an absolute error below 7.5e-8 (Abramowitz and Stegun 26.2.17).
fn cumulative(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
    let series =
        t * (0.319_381_530 + t * (-0.356_563_782 + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
    let upper = density(x) * series;
    if x < 0.0 { upper } else { 1.0 - upper }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn polygon_probability(ring: &[Vertex]) -> f64 {
        (0..ring.len()).map(|i| edge_probability(ring[i], ring[(i + 1) % ring.len()])).sum()
    }

    #[test]
    fn agrees_with_the_table_of_the_normal_distribution() {
        // Abramowitz and Stegun, table 26.1.
        for (x, phi) in [(0.0, 0.5), (1.0, 0.841_344_746), (-1.0, 0.158_655_254), (2.5, 0.993_790_335)] {
            assert!((cumulative(x) - phi).abs() < 1e-7);
        }
    }

    #[test]
    fn a_square_is_the_product_of_its_intervals() {
        for half in [0.1, 1.0, 3.0, 40.0, 1e6] {
            let square = [[-half, -half], [half, -half], [half, half], [-half, half]];
            let expected = (cumulative(half) - cumulative(-half)).powi(2);
            assert!((polygon_probability(&square) - expected).abs() < 1e-6, "half {half}");
        }
    }

    proptest! {
        #[test]
        fn a_disc_holds_what_rayleigh_says(r in 0.05..5.0f64) {
            let ring: Vec<Vertex> = (0..720).map(|i| f64::from(i).to_radians() / 2.0).map(|t| [r * t.cos(), r * t.sin()]).collect();
            prop_assert!((polygon_probability(&ring) - (1.0 - (-r * r / 2.0f64).exp())).abs() < 1e-4);
        }

        #[test]
        fn whitening_comes_back(e in 0.1..1e4f64, n in 0.1..1e4f64, r in -0.999..0.999f64, u in -5.0..5.0f64, v in -5.0..5.0f64) {
            let normal = PlaneNormal::new(e, n, r);
            let back = normal.whitened(normal.offset(u, v));
            prop_assert!((back[0] - u).abs() < 1e-9 && (back[1] - v).abs() < 1e-6);
            prop_assert!(normal.minor_sigma_m() <= e.min(n) * (1.0 + 1e-9));
        }
    }
}
