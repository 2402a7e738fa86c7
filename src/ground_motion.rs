//! `GroundMotion`: a motion between two frames in metres, as the command line and the service answer it.

use overfly_core::geodesy::BodyOffset;
use overfly_core::registration::relative::Motion;
use serde::Serialize;

/// Where image b's centre lies seen from image a's centre, in image a's own axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct GroundMotion {
    /// Ground sample distance of image a, metres per pixel.
    pub gsd_m_per_px: f64,
    /// Towards image a's right edge, metres.
    pub right_m: f64,
    /// Towards image a's upper edge, metres.
    pub ahead_m: f64,
    /// Distance between the centres, metres.
    pub distance_m: f64,
}

impl GroundMotion {
    /// The displacement of a motion on the ground; `gsd_m_per_px` is that of image a.
    pub fn new(motion: &Motion, gsd_m_per_px: f64) -> Self {
        let moved = BodyOffset::from_image_px(motion.displacement_px, gsd_m_per_px);
        let BodyOffset { right_m, ahead_m } = moved;
        Self { gsd_m_per_px, right_m, ahead_m, distance_m: moved.length_m() }
    }
}
