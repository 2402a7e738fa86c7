//! Robust estimation of a similarity from point matches, most of which may be wrong.
//!
//! [`estimate`] tests hypotheses (all pairs of matches, or RANSAC), refines the one with the largest consensus by least
//! squares over its inliers, and reports how. What a match is, and what else it knows beside its two points, is told by an
//! implementation of [`Observations`].

mod estimate;
mod least_squares;
mod observations;
mod options;
mod sampling;

pub use estimate::{RobustFit, SearchReport, estimate, refine};
pub use least_squares::design;
pub use observations::{Observations, Score};
pub use options::{Ending, EstimatorOptions, HypothesisMethod, Prior};
pub use sampling::Xorshift;
