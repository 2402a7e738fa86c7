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

#[cfg(test)]
mod tests {
    use super::super::pattern::RepeatingPattern;
    use super::super::pattern_kind::PatternKind;
    use super::super::scene::PatternBlock;
    use super::super::world::drawn_map;
    use super::super::world::tests::noisy_map;
    use super::*;
    use overfly_core::camera::Height;
    use overfly_core::camera::{Attitude, GroundGrid, Intrinsics, render};
    use overfly_core::tile::{WorldPixel, gsd_at};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// The correlation of a frame's ground view with the map below it.
    fn agreement(frame: &Gray, camera: &Camera, pose: &TruePose, map: &Gray, corner_px: [u64; 2], zoom: u8) -> f64 {
        let gsd = gsd_at(pose.nadir, zoom);
        let grid = GroundGrid::around(camera, pose.heading_rad, [gsd.east_m_per_px, gsd.north_m_per_px], 0.0).unwrap();
        let view = render(frame, camera, pose.heading_rad, &grid);
        let local = LocalFrame::at(pose.nadir);
        let (mut pairs, width) = (Vec::new(), view.gray.width_px());
        for i in (0..width * view.gray.height_px()).filter(|i| view.mask.at(i % width, i / width)) {
            let enu = grid.enu_from_grid([(i % width) as f64 + 0.5, (i / width) as f64 + 0.5]);
            let at = WorldPixel::from_geodetic(local.geodetic_from_enu(enu).unwrap(), zoom).unwrap();
            let (x, y) = (at.x_px - corner_px[0] as f64, at.y_px - corner_px[1] as f64);
            pairs.push([f64::from(view.gray.values()[i]), f64::from(map.sample(x, y))]);
        }
        assert!(pairs.len() > 5000);
        let n = pairs.len() as f64;
        let mean: [f64; 2] = std::array::from_fn(|k| pairs.iter().map(|p| p[k]).sum::<f64>() / n);
        let product = |j: usize, k: usize| pairs.iter().map(|p| (p[j] - mean[j]) * (p[k] - mean[k])).sum::<f64>();
        product(0, 1) / (product(0, 0) * product(1, 1)).sqrt()
    }

    #[test]
    fn a_pattern_in_the_frame_lies_on_the_pattern_in_the_map() {
        let map = noisy_map();
        let scene_frame = map.frame().unwrap();
        let gsd_m = gsd_at(scene_frame.origin(), map.zoom).mean_m_per_px();
        for (seed, kind) in PatternKind::ALL.into_iter().enumerate() {
            let mut rng = ChaCha8Rng::seed_from_u64(seed as u64);
            let pattern = RepeatingPattern { changed: 0.0, ..RepeatingPattern::random(kind, 16.0 * gsd_m, &mut rng) };
            let scene =
                RepeatingScene { blocks: vec![PatternBlock { pattern, outline: None }], hole: None, real_share: 0.0 };
            let (on_map, in_frame) = (PatternLook::plain(1), PatternLook::plain(2));
            let image = drawn_map(&map, &scene_frame, &scene, &on_map, gsd_m);
            let values = image.pixels().map(|p| f32::from(p.0[0])).collect();
            let drawn = Gray::from_values(map.gray.width_px(), map.gray.height_px(), values).unwrap();
            // Off the middle of the map, tilted, turned.
            let nadir = scene_frame.geodetic_from_enu(Enu { east_m: 50.0, north_m: -30.0 }).unwrap();
            let view = View::Posed {
                intrinsics: Intrinsics::centred(160, 120, 150.0),
                height: Height::AboveGround(150.0 * gsd_m),
                attitude: Attitude::exact(0.05, -0.08),
            };
            let pose = TruePose { nadir, heading_rad: 0.5 + seed as f64, view };
            let camera = Camera::new(&pose.view, 160, 120).unwrap();
            let to_scene = SceneFromBody::new(&pose, &scene_frame);
            let blank = Gray::filled(160, 120, 0.0);
            let frame = repeated_frame(&blank, &camera, &to_scene, &scene, &in_frame, SceneEpoch::Frame(9));
            let found = agreement(&frame, &camera, &pose, &drawn, map.corner_px, map.zoom);
            assert!(found > 0.9, "{kind:?} {found}");
        }
    }
}
