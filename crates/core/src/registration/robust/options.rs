//! `EstimatorOptions`: how hypotheses are made, what an inlier is, and how the best hypothesis is refined.

use nalgebra::Vector2;

/// Options of the estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatorOptions {
    /// Source of the hypotheses.
    pub method: HypothesisMethod,
    /// A match is an inlier where its residual is at most this, px.
    pub tolerance_px: f64,
    /// Least distance in b between the two matches of a hypothesis, px.
    pub min_base_px: f64,
    /// Rounds of least squares and new selection of inliers, at most.
    pub rounds: usize,
    /// A round that leaves fewer inliers than this, and fewer than there were, is rejected and ends the refinement.
    pub min_kept: usize,
    /// Last step of the refinement.
    pub ending: Ending,
    /// Point of b about which the normal equations are stated, px; `None`: the centroid of the inliers.
    pub pivot_px: Option<Vector2<f64>>,
    /// Prior of the model; `None` where nothing is known before the matches.
    pub prior: Option<Prior>,
}

/// Source of the hypotheses; two matches determine a similarity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HypothesisMethod {
    /// Every pair of matches.
    AllPairs,
    /// Pairs drawn at random; every pair where there are no more than `max_trials`.
    ///
    /// # References
    /// Fischler and Bolles, Communications of the ACM 24, 1981.
    Ransac {
        /// Most pairs that are drawn.
        max_trials: usize,
        /// Drawing ends early once a larger consensus would have been missed with at most this probability.
        miss_probability: f64,
    },
}

/// Last step of the refinement. Where it converged, both endings give the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// A fit: the model is fitted to the inliers that are reported.
    Fit,
    /// A selection: the inliers reported agree with the model.
    Selection,
}

/// A normal prior of mean 0 for the model's `c` and `s`, which regularises a fit to few, close matches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// One standard deviation of `c`.
    pub sigma_c: f64,
    /// One standard deviation of `s`.
    pub sigma_s: f64,
}
