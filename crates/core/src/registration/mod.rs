//! Registration of two views by a similarity, robustly, with its covariance.
//!
//! Coarse: [`coarse::CoarseMap`] correlates a whole view with a whole region by FFT. Fine: [`windows::match_windows`]
//! finds where small windows of the view lie, [`similarity::fit`] the similarity that most of them agree on, and
//! [`evidence`] how surely such agreement is no accident.

mod cell_dots;
mod cell_template;
pub mod coarse;
pub mod evidence;
mod fourier;
mod products;
pub mod relative;
pub mod similarity;
pub mod standing;
pub mod wide;
pub mod windows;
