//! From a camera frame to a north-up view of the ground, and back.

use serde::Deserialize;

/// A pinhole camera with OpenCV's distortion model, as `camera.toml` spells it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Intrinsics {
    /// Columns of the sensor.
    pub width_px: u32,
    /// Rows of the sensor.
    pub height_px: u32,
    /// Focal length, pixels.
    pub focal_length_px: f64,
    /// Principal point from the image's corner, pixels.
    pub principal_point_px: [f64; 2],
    /// k1, k2, p1, p2, k3.
    #[serde(default)]
    pub distortion: [f64; 5],
}

/// What is known of how the camera looked when a frame was taken. Angles as in DESIGN: heading clockwise from true
/// north of the image's upper edge, positive pitch looks ahead, positive roll looks left.
#[derive(Debug, Clone, PartialEq)]
pub enum View {
    /// Straight down with square pixels: ground metres per pixel of the frame.
    Nadir {
        /// Ground sample distance, metres per pixel.
        gsd_m_per_px: f64,
    },
    /// A calibrated camera at a height.
    Posed {
        /// Intrinsics; a frame of another size with the same aspect is scaled.
        intrinsics: Intrinsics,
        /// Height above ground, metres.
        height_agl_m: f64,
        /// Pitch off nadir, radians.
        pitch_rad: f64,
        /// Roll off nadir, radians.
        roll_rad: f64,
    },
}
