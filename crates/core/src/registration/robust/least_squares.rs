//! The similarity that fits given inliers best, by weighted least squares: the problem is linear in its parameters.

use super::observations::Observations;
use super::options::EstimatorOptions;
use crate::registration::similarity::Similarity;
use nalgebra::{Matrix2x4, Matrix4, Vector2, Vector4};

/// A weighted least-squares fit.
pub struct Solution {
    /// The model.
    pub model: Similarity,
    /// Point of b about which `cofactor` is stated, px.
    pub pivot_px: Vector2<f64>,
    /// Inverse of the normal matrix, in the order (x, y, c, s), x and y being where the pivot is taken.
    pub cofactor: Matrix4<f64>,
}

/// d(x, y) / d(t_x, t_y, c, s) of a similarity at a point.
pub fn design(p: Vector2<f64>) -> Matrix2x4<f64> {
    Matrix2x4::new(1.0, 0.0, p.x, -p.y, 0.0, 1.0, p.y, p.x)
}

/// Fits a similarity to the inliers. `None` with fewer than two inliers (with a prior: none at all), or where they do not
/// determine the similarity.
pub fn solve(observations: &impl Observations, inliers: &[usize], options: &EstimatorOptions) -> Option<Solution> {
    if inliers.len() < if options.prior.is_some() { 1 } else { 2 } {
        return None;
    }
    let centroid = || inliers.iter().map(|&i| observations.point(i)).sum::<Vector2<f64>>() / inliers.len() as f64;
    let pivot_px = options.pivot_px.unwrap_or_else(centroid);
    let mut normal = prior_information(observations, inliers, options);
    let mut right = Vector4::zeros();
    for &i in inliers {
        let j = design(observations.point(i) - pivot_px);
        let information = observations.information(i);
        normal += j.transpose() * information * j;
        right += j.transpose() * information * observations.observed(i);
    }
    let cofactor = normal.try_inverse()?;
    let p = cofactor * right;
    Some(Solution { model: Similarity::about(p[2], p[3], pivot_px, Vector2::new(p[0], p[1])), pivot_px, cofactor })
}

/// The prior's normal matrix: as if `c` and `s` had been observed once, with the prior's spread, by a match that is known to
/// a pixel.
fn prior_information(observations: &impl Observations, inliers: &[usize], options: &EstimatorOptions) -> Matrix4<f64> {
    let Some(prior) = options.prior else { return Matrix4::zeros() };
    let mean_information: f64 =
        inliers.iter().map(|&i| observations.information(i).trace() / 2.0).sum::<f64>() / inliers.len() as f64;
    let weight = |sigma: f64| mean_information * 0.25 / sigma.powi(2);
    Matrix4::from_diagonal(&Vector4::new(0.0, 0.0, weight(prior.sigma_c), weight(prior.sigma_s)))
}
