//! Keypoints with 256-bit binary descriptors.

use crate::pixels::{Gray, Mask};

/// The version of everything below that changes a descriptor's bits. Stored in every store.
pub const CONTRACT: &str = "overfly-keypoint-1";

/// Keypoints of one image, strongest first, with their descriptors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Keypoints {
    /// Position in pixels from the corner, and what else is known of each.
    pub points: Vec<Keypoint>,
    /// 256 bits each, same order as `points`.
    pub descriptors: Vec<[u8; 32]>,
}

/// One keypoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// Column, pixels from the left edge (0.5 is the first pixel's centre).
    pub x_px: f32,
    /// Row, pixels from the upper edge.
    pub y_px: f32,
    /// Corner strength, arbitrary but comparable within a contract.
    pub response: f32,
    /// Direction of the intensity centroid, radians from x towards y.
    pub angle_rad: f32,
    /// Scale of the level it was found on, pixels of the image per pixel of the level.
    pub scale: f32,
}

/// Detects and describes at most `limit` keypoints where `mask` is valid (none near its edge).
pub fn describe(_gray: &Gray, _mask: &Mask, _limit: usize) -> Keypoints {
    Keypoints::default()
}

/// How unlike its keypoints are from each other, in [0, 1]: the mean over keypoints of (distance to the nearest
/// other descriptor) / 128, clipped. 0 without keypoints.
pub fn distinctiveness(_keypoints: &Keypoints) -> f64 {
    0.0
}

/// The blob kept for a tile; layout in migrations/README.md.
pub fn to_blob(_keypoints: &Keypoints) -> Vec<u8> {
    Vec::new()
}

/// Reads [`to_blob`]'s bytes; `None` where they are not such a blob.
pub fn from_blob(_blob: &[u8]) -> Option<Keypoints> {
    None
}
