//! The drift or uncertainty region of a search as geometry on the ground, and the probability that the image's centre
//! lies in a tile: the rectangle of the sequential and the parallel mode (equations 3, 17), the reachable ground of the
//! combined mode (in place of 27), a covariance's ellipse.
//!
//! Lengths are true metres in the plane tangent at the region's centre; tiles are rectangles of the Web Mercator
//! plane. The edge is carried over point by point, so headings hold at every latitude. No I/O.

mod bearings;
mod error;
mod ground;
mod normal;
mod outline;
mod polygon;
mod reachable;
mod simplify;
mod turns;

pub use error::RegionError;
pub use ground::{MAX_REACH_M, Region, SIGMAS};

/// What one image covers of the ground, and how it is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageOnGround {
    /// a: extent across the heading, metres.
    pub across_m: f64,
    /// b: extent along the heading, metres.
    pub along_m: f64,
    /// Direction of b, radians clockwise from true north; in the combined mode at the start of the flight.
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
    /// The parallel mode: the sequential rectangle with the drift of the relative registrations that run beside an
    /// absolute one, D_T = D_U t_exe / t0 (equation 17).
    Parallel {
        /// I: full width of the last fix's error, metres.
        inaccuracy_m: f64,
        /// D_U: drift of one relative registration, one-sided, metres.
        unit_drift_m: f64,
        /// t_exe: how long the absolute registration ran, seconds.
        execution_s: f64,
        /// t0: time of one relative registration, seconds.
        relative_s: f64,
    },
    /// The combined mode: uniform over all ground that the image can show at the end of the flight. The region's centre
    /// is where the last fix was, the image's heading that of the aircraft there; from there it flies for exactly
    /// `execution_s` at `speed_mps`, with a turn radius of at least `min_turn_radius_m` at every moment, and the image
    /// turns with it.
    Combined {
        /// I: full width of the last fix's error, metres.
        inaccuracy_m: f64,
        /// v: ground speed, metres per second.
        speed_mps: f64,
        /// t_exe: time since the last fix's image, seconds.
        execution_s: f64,
        /// R_min: least turn radius, metres.
        min_turn_radius_m: f64,
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
