//! Robust estimation of a similarity from point matches, most of which may be wrong.
//!
//! [`estimate`] tests hypotheses (all pairs of matches, or RANSAC), refines the one with the largest consensus by least
//! squares over its inliers, and reports the search. An implementation of [`Observations`] supplies the matches and what is
//! known of each beside its two points.

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
