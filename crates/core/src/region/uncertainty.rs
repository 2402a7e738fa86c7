//! `Uncertainty`: the position of an image as far as each coupling mode knows it, and `ImageOnGround`, its extent.

/// Extent of one image on the ground, and its direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageOnGround {
    /// a: extent across the heading, metres.
    pub across_m: f64,
    /// b: extent along the heading, metres.
    pub along_m: f64,
    /// Direction of b, radians clockwise from true north; in the combined mode at the start of the flight.
    pub heading_rad: f64,
}

/// Uncertainty of the position of the image's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Uncertainty {
    /// The sequential mode: a uniform distribution over the rectangle of equation 3.
    Sequential {
        /// I: full width of the last fix's error, metres.
        inaccuracy_m: f64,
        /// D_T: drift since that fix, one-sided, metres.
        drift_m: f64,
    },
    /// The parallel mode: the rectangle of the sequential mode with the drift of the relative registrations that run during
    /// an absolute registration, D_T = D_U t_exe / t0 (equation 17).
    Parallel {
        /// I: full width of the last fix's error, metres.
        inaccuracy_m: f64,
        /// D_U: drift of one relative registration, one-sided, metres.
        unit_drift_m: f64,
        /// t_exe: duration of the absolute registration, seconds.
        execution_s: f64,
        /// t0: time of one relative registration, seconds.
        relative_s: f64,
    },
    /// The combined mode: a uniform distribution over all ground that the image can show at the end of the flight. The
    /// region's centre is the position of the last fix, and the image's heading is that of the aircraft there. From there
    /// the aircraft flies for exactly `execution_s` at `speed_mps`, with a turn radius of at least `min_turn_radius_m` at
    /// every moment, and the image turns with the aircraft.
    Combined {
        /// I: full width of the last fix's error, metres.
        inaccuracy_m: f64,
        /// v: ground speed, metres per second.
        speed_mps: f64,
        /// t_exe: time since the image of the last fix, seconds.
        execution_s: f64,
        /// R_min: smallest turn radius, metres.
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
