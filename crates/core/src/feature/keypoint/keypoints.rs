//! `Keypoints`: positions and descriptors.

/// Keypoints of one image, strongest first, with their descriptors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Keypoints {
    /// The keypoints.
    pub points: Vec<Keypoint>,
    /// 256 bits of each keypoint, in the order of `points`.
    pub descriptors: Vec<[u8; 32]>,
}

/// One keypoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// Column, pixels from the left edge (0.5 is the first pixel's centre).
    pub x_px: f32,
    /// Row, pixels from the upper edge.
    pub y_px: f32,
    /// Corner strength: the structure tensor's smaller eigenvalue, (gray levels per pixel)^2.
    pub response: f32,
    /// Direction of the intensity centroid, radians from x towards y.
    pub angle_rad: f32,
    /// Scale of the octave on which it was found, pixels of the image per pixel of the octave.
    pub scale: f32,
}
