//! Clutter: what the windows of a view show together on ground that is not theirs, and the weights under which their sum stands out of it
//! best.
//!
//! Neighbouring windows hold parts of the same roads and rows of houses, and so they find the same wrong places. Their covariance is measured
//! over search squares beside the one searched. The weights w = (C + l I)^-1 1 give windows that err together less to say: the adaptive
//! matched filter of radar, whose samples of clutter are as few as these, hence the loading l of the diagonal.
//!
//! # References
//! Reed, Mallett, Brennan, Rapid convergence rate in adaptive arrays, IEEE Trans. AES 10, 1974; Carlson, Covariance matrix estimation
//! errors and diagonal loading, IEEE Trans. AES 24, 1988.

use super::ranked_windows::RankedWindows;
use super::windows::WindowSurface;

/// Added to the diagonal of the covariance, in units of the variance of one window (1). From 1.3 to 6 the evidence at right places
/// changes by less than a tenth.
const LOADING: f64 = 3.0;
/// The conjugate gradients end where the residual is this share of the right side, or after so many steps.
const LEAST_RESIDUAL: f64 = 1e-3;
const MOST_STEPS: usize = 60;
/// The variance is taken no lower than this. With this value alone, not measured per view, 4 of 876 negatives were accepted.
const LEAST_VARIANCE_FACTOR: f64 = 1.3;

/// The weights of the windows of one view, and the variance of their weighted sum by chance.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowWeights {
    /// Of each window, at least 0.
    pub weights: Vec<f32>,
    /// Variance of the weighted sum of rank scores by chance, over that of independent windows.
    pub variance_factor: f64,
}

impl WindowWeights {
    /// Equal weights, as of windows that are as independent as they ever are.
    pub fn equal(windows: usize) -> Self {
        Self { weights: vec![1.0; windows], variance_factor: LEAST_VARIANCE_FACTOR }
    }

    /// The weights that lift the windows out of their clutter, from an even number of search squares beside the one searched: the same
    /// windows over each, in the same order. The variance of each square's sums is measured under weights from the squares of the other
    /// parity of `sides`, and their median counts: the view's own place may reach into one of them.
    pub fn adapted(squares: &[(Parity, Vec<WindowSurface>)]) -> Self {
        let clutter: Vec<_> = squares.iter().map(|(parity, surfaces)| (*parity, Clutter::new(surfaces))).collect();
        let of = |wanted: Parity| clutter.iter().filter(move |(parity, _)| *parity == wanted).map(|(_, c)| c);
        let mut factors = Vec::new();
        for (learned, tested) in [(Parity::Corner, Parity::Edge), (Parity::Edge, Parity::Corner)] {
            let weights = adapted_weights(&of(learned).collect::<Vec<_>>());
            factors.extend(of(tested).map(|square| square.variance_factor(&weights)));
        }
        let weights = adapted_weights(&clutter.iter().map(|(_, square)| square).collect::<Vec<_>>());
        Self { weights, variance_factor: median(factors).max(LEAST_VARIANCE_FACTOR) }
    }

    /// Equal weights, with the variance that the squares show: the median of them.
    pub fn measured(squares: &[(Parity, Vec<WindowSurface>)]) -> Self {
        let windows = squares.first().map_or(0, |(_, surfaces)| surfaces.len());
        let weights = vec![1.0; windows];
        let factors = squares.iter().map(|(_, surfaces)| Clutter::new(surfaces).variance_factor(&weights)).collect();
        Self { variance_factor: median(factors).max(LEAST_VARIANCE_FACTOR), weights }
    }

    /// The mean of the weighted sum by chance.
    pub fn mean(&self) -> f64 {
        self.weights.iter().map(|&w| f64::from(w)).sum()
    }

    /// How many independent windows of equal weight have a sum that scatters, by chance, as much as this one against its mean.
    pub fn independent_windows(&self) -> f64 {
        let squares: f64 = self.weights.iter().map(|&w| f64::from(w).powi(2)).sum();
        self.mean().powi(2) / (self.variance_factor * squares).max(f64::MIN_POSITIVE)
    }
}

/// On which side of the square searched another lies. Squares of one kind do not touch those of the same kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parity {
    /// It shares an edge.
    Edge,
    /// It shares a corner.
    Corner,
}

/// The rank scores of all windows over one square, less their mean.
struct Clutter {
    windows: Vec<Vec<f32>>,
}

impl Clutter {
    fn new(surfaces: &[WindowSurface]) -> Self {
        Self { windows: RankedWindows::new(surfaces).scores }
    }

    fn places(&self) -> usize {
        self.windows.first().map_or(0, Vec::len)
    }

    /// The weighted sum of the windows at every place.
    fn sums(&self, weights: &[f32]) -> Vec<f32> {
        let mut sums = vec![0.0; self.places()];
        for (scores, &weight) in self.windows.iter().zip(weights) {
            sums.iter_mut().zip(scores).for_each(|(sum, score)| *sum += weight * score);
        }
        sums
    }

    /// The variance of the weighted sums, whose mean is known, over that of independent windows.
    fn variance_factor(&self, weights: &[f32]) -> f64 {
        let squares: f64 = weights.iter().map(|&w| f64::from(w).powi(2)).sum();
        let sums = self.sums(weights);
        let variance = sums.iter().map(|&sum| f64::from(sum).powi(2)).sum::<f64>() / sums.len().max(1) as f64;
        variance / squares.max(f64::MIN_POSITIVE)
    }
}

/// Solves (C + l I) w = 1 by conjugate gradients, with C the mean covariance of the windows over the squares, which is never written out;
/// negative weights become 0.
fn adapted_weights(squares: &[&Clutter]) -> Vec<f32> {
    let windows = squares.first().map_or(0, |square| square.windows.len());
    let places: usize = squares.iter().map(|square| square.places()).sum();
    let applied = |v: &[f32]| {
        let mut product = vec![0f32; windows];
        for square in squares {
            let sums = square.sums(v);
            for (value, scores) in product.iter_mut().zip(&square.windows) {
                *value += dot(scores, &sums);
            }
        }
        product.iter_mut().zip(v).for_each(|(value, v)| *value = *value / places.max(1) as f32 + LOADING as f32 * v);
        product
    };
    let mut weights = vec![0f32; windows];
    let mut residual = vec![1f32; windows];
    let mut direction = residual.clone();
    let mut square = f64::from(dot(&residual, &residual));
    let least = square * LEAST_RESIDUAL.powi(2);
    for _ in 0..MOST_STEPS {
        if square <= least {
            break;
        }
        let product = applied(&direction);
        let step = (square / f64::from(dot(&direction, &product)).max(f64::MIN_POSITIVE)) as f32;
        weights.iter_mut().zip(&direction).for_each(|(w, d)| *w += step * d);
        residual.iter_mut().zip(&product).for_each(|(r, p)| *r -= step * p);
        let next = f64::from(dot(&residual, &residual));
        let share = (next / square) as f32;
        direction.iter_mut().zip(&residual).for_each(|(d, r)| *d = r + share * *d);
        square = next;
    }
    weights.iter_mut().for_each(|w| *w = w.max(0.0));
    weights
}

/// In eight partial sums, which the compiler makes a vector, and always in the same order.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut lanes = [0f32; 8];
    let (a, a_rest) = a.as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    for (a, b) in a.iter().zip(b) {
        lanes.iter_mut().zip(a.iter().zip(b)).for_each(|(lane, (a, b))| *lane += a * b);
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    lanes.iter().sum::<f32>() + rest
}

/// The middle value, or the mean of the two in the middle; 1 where there is none.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    match values.len() {
        0 => 1.0,
        n if n % 2 == 1 => values[n / 2],
        n => (values[n / 2 - 1] + values[n / 2]) / 2.0,
    }
}

#[cfg(test)]
mod tests {
    use super::super::robust::Xorshift;
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Eight squares of windows of noise; the first `copies` windows of each are one.
    fn squares(windows: usize, copies: usize) -> Vec<(Parity, Vec<WindowSurface>)> {
        let mut draw = Xorshift::new(5);
        let mut surface = || (0..81).map(|_| draw.below(1_000_001) as f32 / 1e6 + 0.1).collect::<Vec<f32>>();
        let mut square = || {
            let first = surface();
            let scores = (0..windows).map(|i| if i < copies { first.clone() } else { surface() });
            scores.map(|scores| WindowSurface { centre_px: [0.0; 2], scores }).collect::<Vec<_>>()
        };
        (0..8).map(|i| (if i % 2 == 0 { Parity::Corner } else { Parity::Edge }, square())).collect()
    }

    #[test]
    fn independent_windows_are_weighted_alike() {
        let found = WindowWeights::adapted(&squares(30, 0));
        assert!((1.3..1.6).contains(&found.variance_factor), "{}", found.variance_factor);
        assert!(found.independent_windows() > 18.0, "{}", found.independent_windows());
    }

    #[test]
    fn windows_that_alias_together_have_less_to_say() {
        let found = WindowWeights::adapted(&squares(60, 30));
        let (alias, alone) = (found.weights[0], found.weights[59]);
        assert!(alias < 0.3 * alone, "{alias} {alone}");
        let equal = WindowWeights { variance_factor: found.variance_factor, ..WindowWeights::equal(60) };
        assert!(found.independent_windows() > 20.0, "{}", found.independent_windows());
        assert!(found.variance_factor < 5.0, "{}", found.variance_factor);
        // Under equal weights the 30 copies alone make it 30 * 30 / 60.
        let unweighted = Clutter::new(&squares(60, 30)[0].1).variance_factor(&equal.weights);
        assert!((10.0..22.0).contains(&unweighted), "{unweighted}");
    }

    #[test]
    fn conjugate_gradients_solve_what_a_factorisation_solves() {
        let squares = squares(24, 6);
        let clutter: Vec<_> = squares.iter().map(|(_, surfaces)| Clutter::new(surfaces)).collect();
        let found = adapted_weights(&clutter.iter().collect::<Vec<_>>());
        let mut covariance = DMatrix::<f64>::identity(24, 24) * LOADING;
        for square in &clutter {
            let scores = DMatrix::from_fn(24, 81, |i, j| f64::from(square.windows[i][j]));
            covariance += &scores * scores.transpose() / (8.0 * 81.0);
        }
        let direct = covariance.cholesky().unwrap().solve(&DVector::repeat(24, 1.0));
        for (found, direct) in found.iter().zip(direct.iter()) {
            assert!((f64::from(*found) - direct.max(0.0)).abs() < 1e-3, "{found} {direct}");
        }
    }

    #[test]
    fn no_windows_have_no_weights() {
        let found = WindowWeights::adapted(&[]);
        assert!(found.weights.is_empty() && found.independent_windows() == 0.0);
    }
}
