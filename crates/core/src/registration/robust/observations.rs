//! `Observations`: what the estimator asks of matches between two images.

use crate::registration::similarity::Similarity;
use nalgebra::{Matrix2, Vector2};

/// Matches between image b and image a. The model predicts for a point of b what is observed of it in a.
pub trait Observations {
    /// Number of matches; the other methods take an index below it.
    fn count(&self) -> usize;

    /// The point in b, px.
    fn point(&self, index: usize) -> Vector2<f64>;

    /// What is observed of the point in a, px.
    fn observed(&self, index: usize) -> Vector2<f64>;

    /// Inverse covariance of the observation up to a common factor, per px^2.
    fn information(&self, index: usize) -> Matrix2<f64>;

    /// Observed minus predicted, px.
    fn residual(&self, index: usize, model: &Similarity) -> Vector2<f64>;

    /// The model that two matches determine; `None` where they do not determine one.
    fn hypothesis(&self, pair: [usize; 2]) -> Option<Similarity> {
        Similarity::through(pair.map(|i| self.point(i)), pair.map(|i| self.observed(i)))
    }

    /// Whether the match, its residual aside, may be an inlier of the model.
    fn is_admissible(&self, index: usize, model: &Similarity) -> bool;

    /// Whether the model lies within the bounds of what is searched for.
    fn is_plausible(&self, model: &Similarity) -> bool;

    /// How many matches have a residual of at most `tolerance_px`. Called once for every hypothesis.
    fn score(&self, model: &Similarity, tolerance_px: f64) -> Score;
}

/// How good a hypothesis is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Matches within the tolerance.
    pub inliers: usize,
    /// Decides between hypotheses with as many inliers: the lower is better. For example the sum of residuals, px.
    pub cost: f64,
}

impl Score {
    /// Whether this hypothesis is better than another; of equals the first one stays.
    pub fn is_better_than(&self, other: &Self) -> bool {
        self.inliers > other.inliers || (self.inliers == other.inliers && self.cost < other.cost)
    }
}
