//! The prior and the answer of a relative registration.

use serde::Serialize;

/// What is known of two frames before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionPrior {
    /// Expected ratio of b's ground sample distance to a's; `None` when unknown.
    pub scale: Option<f64>,
}

/// The answer: how frame b lies on frame a, or why there is no answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum MotionAnswer {
    /// Registered.
    Motion(Motion),
    /// Not registered.
    NoMotion {
        /// Reason, as a stable word.
        reason: NoMotionReason,
        /// Reason in detail, for people and logs.
        detail: String,
    },
}

/// Why two frames could not be registered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoMotionReason {
    /// Too few correspondences agree on one motion: another place, too little overlap, or too little texture.
    TooFewAgreeingMatches,
    /// Some correspondences agree, but most others in the overlap that they imply, or its brightness, contradict: ground
    /// that looks alike.
    Contradicted,
    /// The correspondences agree on a scale that the prior excludes.
    OtherScale,
    /// Another motion explains the pair nearly as well: ground that repeats itself, or an overlay that stands still.
    Ambiguous,
    /// Both images have the very same pixels: a copy, which no sensor takes twice.
    IdenticalImages,
}

/// A similarity that takes a point of image b to image a, pixels counted from the corner.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Motion {
    /// Row-major 2 x 3: a point (x, y, 1) of b to a.
    pub a_from_b: [[f64; 3]; 2],
    /// Rotation of b against a, degrees in (-180, 180], clockwise as seen in the image.
    pub rotation_deg: f64,
    /// Pixels of a per pixel of b.
    pub scale: f64,
    /// Displacement: the place of b's centre in a less a's centre, pixels of a.
    pub displacement_px: [f64; 2],
    /// Covariance of `displacement_px`, px^2.
    pub covariance_px2: [[f64; 2]; 2],
    /// One standard deviation of `rotation_deg`.
    pub rotation_sigma_deg: f64,
    /// One standard deviation of `scale`, as a ratio of the scale.
    pub scale_sigma_ratio: f64,
    /// Correspondences that agree.
    pub inliers: usize,
    /// Correspondences that were tried.
    pub matches: usize,
    /// log10 of the number of false alarms: how many agreements as large are expected by chance in a pair of frames.
    pub log10_false_alarms: f64,
}
