//! Relative registration: the motion between two frames.

use crate::pixels::Gray;
use serde::Serialize;

/// What two frames are known to share before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionPrior {
    /// Expected ratio of b's ground sample distance to a's; 1 when unknown.
    pub scale: Option<f64>,
}

/// The answer: how frame b lies on frame a, or why that cannot be said.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum MotionAnswer {
    /// Registered.
    Motion(Motion),
    /// Not registered.
    NoMotion {
        /// Why, for people and logs.
        reason: String,
    },
}

/// A similarity taking a point of image b to image a, pixels counted from the corner.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Motion {
    /// Row-major 2 x 3: a point (x, y, 1) of b to a.
    pub a_from_b: [[f64; 3]; 2],
    /// Rotation of b against a, radians, clockwise as seen in the image.
    pub rotation_rad: f64,
    /// Pixels of a per pixel of b.
    pub scale: f64,
    /// Where b's centre lies in a minus a's centre, pixels of a: the displacement.
    pub displacement_px: [f64; 2],
    /// Covariance of `displacement_px`, px^2.
    pub covariance_px2: [[f64; 2]; 2],
    /// Correspondences that agree.
    pub inliers: usize,
    /// Correspondences that were tried.
    pub matches: usize,
}

/// Registers frame b against frame a.
///
/// # References
/// Equations 32 to 36 of the paper, averaged robustly over many pairs.
pub fn register(_a: &Gray, _b: &Gray, _prior: &MotionPrior) -> MotionAnswer {
    MotionAnswer::NoMotion { reason: "not built".into() }
}
