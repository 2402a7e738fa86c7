//! The measurements of the navigation filter: sensor readings, visual odometry, fixes.

use nalgebra::Matrix2;
use overfly_core::geodesy::{EnuCovariance, Geodetic, Heading};

/// The readings of compass and altimeter at one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorReading {
    /// Heading by the compass, radians clockwise from true north.
    pub heading_rad: f64,
    /// Height by the altimeter, metres above ground.
    pub height_m: f64,
}

/// Error model of compass and altimeter: a constant offset and white noise each, one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorSigmas {
    /// Constant offset of the compass, radians.
    pub heading_offset_rad: f64,
    /// White noise of the compass at each image, radians; more than 0.
    pub heading_noise_rad: f64,
    /// Constant offset of the altimeter (and of the focal length), as a ratio of the height.
    pub height_offset_ratio: f64,
    /// White noise of the altimeter at each image, as a ratio of the height; more than 0.
    pub height_noise_ratio: f64,
}

/// A visual odometry increment: the displacement over ground between two images, in the axes of the first image and scaled
/// to a height of one metre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometryStep {
    /// Displacement to the right and ahead of the first image, metres per metre of height.
    pub per_height: [f64; 2],
    /// Covariance of [`OdometryStep::per_height`].
    pub covariance: Matrix2<f64>,
    /// Clockwise turn from the first image to the second, radians.
    pub turn_rad: f64,
    /// One standard deviation of the turn, radians.
    pub turn_sigma_rad: f64,
    /// Natural logarithm of the second height over the first.
    pub log_climb: f64,
    /// One standard deviation of [`OdometryStep::log_climb`].
    pub climb_sigma: f64,
}

/// What a fix measures, as the navigation filter takes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixMeasurement {
    /// The point straight below the camera.
    pub position: Geodetic,
    /// Covariance of the position.
    pub covariance: EnuCovariance,
    /// Heading.
    pub heading: Heading,
    /// One standard deviation of the heading, radians.
    pub heading_sigma_rad: f64,
    /// Natural logarithm of the height above ground in metres.
    pub log_height: f64,
    /// One standard deviation of [`FixMeasurement::log_height`].
    pub log_height_sigma: f64,
}
