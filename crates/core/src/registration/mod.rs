//! Robust registration of two views by a similarity, with its covariance.
//!
//! Coarse: [`coarse::CoarseMap`] correlates a whole view with a whole region by FFT. Fine: [`windows::match_windows`] finds
//! where small windows of the view lie, [`window_fit::fit_windows`] the similarity that most of them agree on, and
//! [`a_contrario`] the number of false alarms of such a consensus; [`soft_vote::soft_vote`] elects the similarity where no window is
//! found alone. [`relative`] registers two frames of a flight. Both fit
//! their similarity with [`robust::estimate`]. [`stationary`] finds what stands still in the images of a flight,
//! [`seam`] the line across a view on whose sides two places agree, [`smear`] whether a view is blurred along one direction.

pub mod a_contrario;
mod cell_dots;
mod cell_template;
pub mod clutter;
pub mod coarse;
mod fourier;
pub mod paired_comparison;
pub mod peak_z_score;
mod products;
mod rank_score;
pub mod ranked_windows;
pub mod relative;
pub mod resection;
pub mod robust;
pub mod seam;
pub mod self_similarity;
pub mod similarity;
pub mod smear;
pub mod soft_vote;
pub mod stationary;
pub mod view_statistic;
pub mod wide;
pub mod window_fit;
pub mod windows;

pub use similarity::{Precision, Similarity};
