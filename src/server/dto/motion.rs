//! `MotionReply`: how one frame lies on another; `MotionParameters`: what is known before.

use super::intrinsics::IntrinsicsJson;
use super::stable_word::stable_word;
use crate::ground_motion::GroundMotion;
use overfly_core::camera::Intrinsics;
use overfly_core::registration::relative::{Motion, MotionAnswer, NoMotionReason};
use overfly_flight::locate::ViewParameters;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What is known of two frames besides their pixels. Unknown keys are refused; none is required.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct MotionParameters {
    /// Ground metres per pixel of image a; then the answer is also in metres. Or `height_m` and `camera`.
    #[schema(exclusive_minimum = 0.0)]
    pub gsd_m_per_px: Option<f64>,
    /// Height above ground of image a, metres; needs `camera`.
    pub height_m: Option<f64>,
    /// The camera of both images.
    #[schema(nullable = false)]
    pub camera: Option<IntrinsicsJson>,
}

/// How image b lies on image a, or no motion with the reason. `status` is "motion" or "no_motion".
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(discriminator(property_name = "status", mapping(
    ("motion" = "#/components/schemas/Motion"), ("no_motion" = "#/components/schemas/NoMotion"),
)))]
#[serde(untagged)]
pub(crate) enum MotionReply {
    Motion(MotionJson),
    NoMotion(NoMotionJson),
}

/// The `status` of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum MotionStatus {
    Motion,
}

/// The `status` of an answer without a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum NoMotionStatus {
    NoMotion,
}

/// No motion.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = NoMotion)]
pub(crate) struct NoMotionJson {
    /// "no_motion".
    status: NoMotionStatus,
    /// The reason, as a stable word.
    reason: NoMotionReasonJson,
    /// The reason, for people and logs.
    detail: String,
    /// Time from the decoded frames to this answer, milliseconds.
    elapsed_ms: f64,
}

/// Why two frames could not be registered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[schema(as = NoMotionReason)]
#[serde(rename_all = "snake_case")]
pub(crate) enum NoMotionReasonJson {
    /// Too few correspondences agree on one motion: another place, too little overlap, or too little texture.
    TooFewAgreeingMatches,
    /// Correspondences agree on a motion, but most others in that overlap, or its brightness, contradict it: the ground only looks
    /// alike.
    Contradicted,
    /// Correspondences agree on a scale that the prior excludes.
    OtherScale,
    /// Another motion explains the pair nearly as well: ground that repeats itself, or an overlay that stands still.
    Ambiguous,
    /// Both images have the very same pixels: a copy, which no sensor takes twice.
    IdenticalImages,
}

/// A similarity that takes a point of image b to image a, pixels counted from the corner.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Motion)]
pub(crate) struct MotionJson {
    /// "motion".
    status: MotionStatus,
    /// Row-major 2 x 3 matrix: takes a point (x, y, 1) of b to a.
    #[schema(min_items = 2, max_items = 2)]
    a_from_b: [[f64; 3]; 2],
    /// Rotation of b against a, degrees in (-180, 180], clockwise as seen in the image.
    rotation_deg: f64,
    /// Pixels of a per pixel of b.
    scale: f64,
    /// The displacement: where b's centre lies in a minus a's centre, pixels of a.
    #[schema(min_items = 2, max_items = 2)]
    displacement_px: [f64; 2],
    /// Covariance of `displacement_px`, px^2.
    #[schema(min_items = 2, max_items = 2)]
    covariance_px2: [[f64; 2]; 2],
    /// One standard deviation of `rotation_deg`.
    rotation_sigma_deg: f64,
    /// One standard deviation of `scale`, as a ratio of it.
    scale_sigma_ratio: f64,
    /// Number of correspondences that agree.
    inliers: usize,
    /// Number of correspondences that were tried.
    matches: usize,
    /// log10 of the number of equally large agreements expected by chance in a pair of frames (a contrario).
    log10_false_alarms: f64,
    /// Ground sample distance of image a, metres per pixel; this and the next three only if the scale of image a was stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    gsd_m_per_px: Option<f64>,
    /// Where image b's centre lies seen from image a's, towards image a's right edge, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    right_m: Option<f64>,
    /// Towards image a's upper edge, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    ahead_m: Option<f64>,
    /// Distance between the centres, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    distance_m: Option<f64>,
    /// Time from the decoded frames to this answer, milliseconds.
    elapsed_ms: f64,
}

impl MotionParameters {
    /// How image a was taken; the library checks the values.
    pub fn view(&self) -> ViewParameters {
        let camera = self.camera.as_ref().map(Intrinsics::from);
        let Self { gsd_m_per_px, height_m, .. } = *self;
        ViewParameters { gsd_m_per_px, height_m, camera, ..ViewParameters::default() }
    }
}

impl MotionReply {
    /// The reply to a registration that took `elapsed_ms`; in metres as well if image a's scale is known.
    pub fn new(answer: MotionAnswer, gsd_m_per_px: Option<f64>, elapsed_ms: f64) -> Self {
        match answer {
            MotionAnswer::Motion(motion) => {
                let ground = gsd_m_per_px.map(|gsd_m_per_px| GroundMotion::new(&motion, gsd_m_per_px));
                Self::Motion(MotionJson::new(motion, ground, elapsed_ms))
            }
            MotionAnswer::NoMotion { reason, detail } => {
                let status = NoMotionStatus::NoMotion;
                Self::NoMotion(NoMotionJson { status, reason: reason.into(), detail, elapsed_ms })
            }
        }
    }
}

impl MotionReply {
    /// Why there is no motion, as a stable word; `None` for a motion.
    pub fn no_motion_reason(&self) -> Option<String> {
        match self {
            Self::Motion(_) => None,
            Self::NoMotion(no_motion) => Some(stable_word(&no_motion.reason)),
        }
    }

    /// Time from the decoded frames to this answer, seconds.
    pub fn elapsed_s(&self) -> f64 {
        let (Self::Motion(MotionJson { elapsed_ms, .. }) | Self::NoMotion(NoMotionJson { elapsed_ms, .. })) = self;
        elapsed_ms / 1e3
    }
}

impl MotionJson {
    fn new(motion: Motion, ground: Option<GroundMotion>, elapsed_ms: f64) -> Self {
        Self {
            status: MotionStatus::Motion,
            a_from_b: motion.a_from_b,
            rotation_deg: motion.rotation_deg,
            scale: motion.scale,
            displacement_px: motion.displacement_px,
            covariance_px2: motion.covariance_px2,
            rotation_sigma_deg: motion.rotation_sigma_deg,
            scale_sigma_ratio: motion.scale_sigma_ratio,
            inliers: motion.inliers,
            matches: motion.matches,
            log10_false_alarms: motion.log10_false_alarms,
            gsd_m_per_px: ground.map(|g| g.gsd_m_per_px),
            right_m: ground.map(|g| g.right_m),
            ahead_m: ground.map(|g| g.ahead_m),
            distance_m: ground.map(|g| g.distance_m),
            elapsed_ms,
        }
    }
}

impl From<NoMotionReason> for NoMotionReasonJson {
    fn from(reason: NoMotionReason) -> Self {
        match reason {
            NoMotionReason::TooFewAgreeingMatches => Self::TooFewAgreeingMatches,
            NoMotionReason::Contradicted => Self::Contradicted,
            NoMotionReason::OtherScale => Self::OtherScale,
            NoMotionReason::Ambiguous => Self::Ambiguous,
            NoMotionReason::IdenticalImages => Self::IdenticalImages,
        }
    }
}
