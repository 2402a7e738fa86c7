//! A frame with the patterns of a scene drawn into it by the camera's true projection.

use super::look::PatternLook;
use super::scene::{GroundPatch, RepeatingScene, SceneEpoch};
use overfly_core::camera::{Camera, View};
use overfly_core::geodesy::{BodyFrame, BodyOffset, Enu, Geodetic, LocalFrame};
use overfly_core::pixels::Gray;

/// The true pose of a frame's camera.
#[derive(Debug, Clone)]
pub struct TruePose {
    /// The nadir.
    pub nadir: Geodetic,
    /// Heading, radians clockwise from north.
    pub heading_rad: f64,
    /// The true view.
    pub view: View,
}

/// From offsets in the aircraft's axes to the metres of a scene.
#[derive(Debug, Clone, Copy)]
pub struct SceneFromBody {
    nadir_m: [f64; 2],
    right: [f64; 2],
    ahead: [f64; 2],
}

impl SceneFromBody {
    /// The map from a pose's axes to a scene whose origin is that of `scene_frame`. Linear: over the few kilometres of a
    /// frame the earth's curvature adds millimetres.
    pub fn new(pose: &TruePose, scene_frame: &LocalFrame) -> Self {
        const ARM_M: f64 = 100.0;
        let own = LocalFrame::at(pose.nadir);
        let place = |enu: Enu| {
            let point = own.geodetic_from_enu(enu).unwrap_or(pose.nadir);
            let enu = scene_frame.enu_from_geodetic(point);
            [enu.east_m, enu.north_m]
        };
        let body = BodyFrame::from_heading_rad(pose.heading_rad);
        let nadir_m = place(Enu::default());
        let axis = |right_m: f64, ahead_m: f64| {
            let end = place(body.enu_from_body(BodyOffset { right_m, ahead_m }));
            std::array::from_fn(|k| (end[k] - nadir_m[k]) / ARM_M)
        };
        Self { nadir_m, right: axis(ARM_M, 0.0), ahead: axis(0.0, ARM_M) }
    }

    /// The scene's metres of an offset.
    pub fn scene_from_body(&self, offset: BodyOffset) -> [f64; 2] {
        std::array::from_fn(|k| self.nadir_m[k] + offset.right_m * self.right[k] + offset.ahead_m * self.ahead[k])
    }
}

/// Draws a scene into a frame. Pixels above the horizon stay.
pub fn repeated_frame(
    gray: &Gray,
    camera: &Camera,
    scene_from_body: &SceneFromBody,
    scene: &RepeatingScene,
    look: &PatternLook,
    epoch: SceneEpoch,
) -> Gray {
    let (width, height) = (gray.width_px(), gray.height_px());
    let ground = |x: f64, y: f64| Some(scene_from_body.scene_from_body(camera.body_from_frame([x, y])?));
    let mut out = gray.clone();
    for y in 0..height {
        for x in 0..width {
            let (u, v) = (x as f64 + 0.5, y as f64 + 0.5);
            let (Some(centre_m), Some(right), Some(below)) = (ground(u, v), ground(u + 1.0, v), ground(u, v + 1.0))
            else {
                continue;
            };
            let patch = GroundPatch {
                centre_m,
                across_m: std::array::from_fn(|k| right[k] - centre_m[k]),
                down_m: std::array::from_fn(|k| below[k] - centre_m[k]),
            };
            out.values_mut()[y * width + x] = scene.shade(gray.at(x, y), &patch, look, epoch, (x, y)).round();
        }
    }
    out
}
