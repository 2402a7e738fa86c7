//! The drift or uncertainty region of a search as geometry on the ground, and the probability that the image's centre
//! lies in a tile. This regions: the sequential mode's rectangle (equation 3) and a covariance's ellipse.
//!
//! Lengths are true metres in the plane tangent at the region's centre; tiles are rectangles of the Web Mercator
//! plane. The edge is carried over point by point, so headings hold at every latitude. No I/O.

mod ground;
mod normal;
mod outline;
mod polygon;

pub use ground::{MAX_REACH_M, Region, RegionError, SIGMAS};

/// What one image covers of the ground, and how it is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageOnGround {
    /// a: extent across the heading, metres.
    pub across_m: f64,
    /// b: extent along the heading, metres.
    pub along_m: f64,
    /// Direction of b, radians clockwise from true north.
    pub heading_rad: f64,
}

/// What is known of the image centre's position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Uncertainty {
    /// The sequential mode: uniform over the rectangle of equation 3.
    Sequential {
        /// I: full width of the last fix's error, metres.
        inaccuracy_m: f64,
        /// D_T: drift since, one-sided, metres.
        drift_m: f64,
    },
    /// A normal distribution.
    Covariance {
        /// One standard deviation towards east, metres.
        sigma_east_m: f64,
        /// One standard deviation towards north, metres.
        sigma_north_m: f64,
        /// Correlation of both, in (-1, 1).
        correlation: f64,
    },
}
