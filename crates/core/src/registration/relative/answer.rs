//! What a relative registration is asked and answers.

use serde::Serialize;
use utoipa::ToSchema;

/// What two frames are known to share before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionPrior {
    /// Expected ratio of b's ground sample distance to a's; `None` when unknown.
    pub scale: Option<f64>,
}

/// The answer: how frame b lies on frame a, or why that cannot be said.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum MotionAnswer {
    /// Registered.
    Motion(Motion),
    /// Not registered.
    NoMotion {
        /// Why, as a stable word.
        reason: NoMotionReason,
        /// Why, for people and logs.
        detail: String,
    },
}

/// Why two frames could not be registered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoMotionReason {
    /// Too few correspondences agree on one motion: another place, too little overlap, or too little texture.
    TooFewAgreeingMatches,
    /// Correspondences agree, but most others in the overlap so found, or its brightness, contradict: ground that
    /// looks alike.
    Contradicted,
    /// They agree on a scale that the prior excludes.
    OtherScale,
}

/// A similarity taking a point of image b to image a, pixels counted from the corner.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Motion {
    /// Row-major 2 x 3: a point (x, y, 1) of b to a.
    pub a_from_b: [[f64; 3]; 2],
    /// Rotation of b against a, degrees in (-180, 180], clockwise as seen in the image.
    pub rotation_deg: f64,
    /// Pixels of a per pixel of b.
    pub scale: f64,
    /// Where b's centre lies in a minus a's centre, pixels of a: the displacement.
    pub displacement_px: [f64; 2],
    /// Covariance of `displacement_px`, px^2.
    pub covariance_px2: [[f64; 2]; 2],
    /// One standard deviation of `rotation_deg`.
    pub rotation_sigma_deg: f64,
    /// One standard deviation of `scale`, as a ratio of it.
    pub scale_sigma_ratio: f64,
    /// Correspondences that agree.
    pub inliers: usize,
    /// Correspondences that were tried.
    pub matches: usize,
    /// log10 of the number of agreements as large that accident makes in a pair of frames.
    pub log10_false_alarms: f64,
}
