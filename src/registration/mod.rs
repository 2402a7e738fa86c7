//! Registration of two views by a similarity, robustly, with its covariance.

pub mod relative;
