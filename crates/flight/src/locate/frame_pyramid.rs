//! `FramePyramid`: a frame at the resolution of several levels, and its ground view under a hypothesis.

use super::camera_pose::CameraPose;
use super::ground_heights::{GroundHeights, LaidGrid};
use super::view_size::is_drawable;
use overfly_core::camera::{Camera, GroundGrid, GroundView, Relief, render, render_on_relief};
use overfly_core::feature::Structure;
use overfly_core::pixels::Gray;
use overfly_core::tile::Gsd;
use overfly_store::StoreError;
use std::collections::HashMap;

/// A frame with its camera, shrunk once for every level on which it is compared.
pub struct FramePyramid<'a> {
    gray: &'a Gray,
    camera: Camera,
    gain: f32,
    shrunk: HashMap<u8, (Gray, Camera)>,
}

impl<'a> FramePyramid<'a> {
    /// Returns the pyramid of a frame and the camera that took it, without levels.
    pub fn new(gray: &'a Gray, camera: Camera) -> Self {
        Self { gray, camera, gain: gain(gray), shrunk: HashMap::new() }
    }

    /// The camera of the full frame.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Shrinks the frame to the resolution of levels (zoom and ground sample distance), finest first, so that
    /// [`FramePyramid::view`] need not average. Each level is shrunk from the one before, so a large frame is read once.
    pub fn add_levels(&mut self, levels: impl Iterator<Item = (u8, Gsd)>) {
        let mut last: Option<u8> = None;
        for (zoom, gsd) in levels {
            let ratio = (self.camera.gsd_m_per_px() / gsd.mean_m_per_px()).min(1.0);
            let side = |n: usize| ((n as f64 * ratio).round() as usize).clamp(1, n);
            let source = last.and_then(|zoom| self.shrunk.get(&zoom)).map_or(self.gray, |(gray, _)| gray);
            let mut small = source.shrunk(side(self.gray.width_px()), side(self.gray.height_px()));
            if last.is_none() && self.gain != 1.0 {
                small.values_mut().iter_mut().for_each(|value| *value *= self.gain);
            }
            let resized = self.camera.resized(small.width_px(), small.height_px());
            self.shrunk.insert(zoom, (small, resized));
            last = Some(zoom);
        }
    }

    /// The north-up ground view of the frame at the pose's level, which must be one of the pyramid's. The pose's nadir lies `fraction_px`
    /// right of and below a pixel corner. `None` where the frame sees the horizon.
    pub fn view(&self, pose: &CameraPose, gsd: Gsd, fraction_px: [f64; 2]) -> Option<GroundView> {
        let (small, camera) = self.shrunk.get(&pose.zoom)?;
        let camera = pose.camera(camera)?;
        let mut grid = GroundGrid::around(&camera, pose.heading_rad, [gsd.east_m_per_px, gsd.north_m_per_px], 1.0)?;
        grid.nadir_px[0] += fraction_px[0];
        grid.nadir_px[1] += fraction_px[1];
        is_drawable(&grid).then(|| render(small, &camera, pose.heading_rad, &grid))
    }

    /// As [`FramePyramid::view`], laid on the ground's relief, with that relief; `None` as well where the terrain does not cover the view.
    ///
    /// # Errors
    /// Where a tile of the terrain cannot be read.
    pub fn view_on_relief(
        &self,
        pose: &CameraPose,
        gsd: Gsd,
        fraction_px: [f64; 2],
        ground: &GroundHeights<'_>,
    ) -> Result<Option<(GroundView, Relief)>, StoreError> {
        let Some((small, camera)) = self.shrunk.get(&pose.zoom) else { return Ok(None) };
        let Some(camera) = pose.camera(camera) else { return Ok(None) };
        let Some(LaidGrid { grid, relief }) = ground.laid(&camera, pose, gsd, fraction_px)? else { return Ok(None) };
        let view = render_on_relief(small, &camera, pose.heading_rad, &grid, &relief);
        Ok(Some((view, relief)))
    }
}

/// A frame whose gray levels span less than this is amplified to it: over water and in infrared a whole frame may lie within ten levels,
/// and edges below the floor of `feature::Structure` do not count.
const LEAST_SPAN: f32 = 64.0;
/// Noise of the sensor and steps of a gray level must not become the picture.
const MAX_GAIN: f32 = 25.0;
/// Share of the pixels beyond the span on each side.
const BEYOND_SPAN: f64 = 0.005;
/// Pixels that the span is taken from, at least.
const SPAN_PIXELS: usize = 20_000;

/// The amplification of a frame.
fn gain(frame: &Gray) -> f32 {
    let step = (frame.values().len() / SPAN_PIXELS).max(1);
    let mut sample: Vec<f32> = frame.values().iter().step_by(step).copied().collect();
    sample.sort_unstable_by(f32::total_cmp);
    let beyond = (sample.len() as f64 * BEYOND_SPAN) as usize;
    let (Some(low), Some(high)) = (sample.get(beyond), sample.iter().rev().nth(beyond)) else { return 1.0 };
    let span = high - low;
    if span > 0.0 { (LEAST_SPAN / span).clamp(1.0, MAX_GAIN) } else { 1.0 }
}

/// The structural channels of a view.
pub fn structure_of(view: &GroundView) -> Structure {
    Structure::new(&view.gray, &view.mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_faint_frames_are_amplified_and_never_without_bound() {
        let ramp = |span: f32| {
            let values = (0..200 * 100).map(|i| 30.0 + span * (i % 200) as f32 / 199.0).collect();
            gain(&Gray::from_values(200, 100, values).unwrap())
        };
        assert_eq!([ramp(200.0), ramp(70.0), ramp(0.0)], [1.0; 3]);
        assert!((ramp(8.0) - 8.0).abs() < 0.2 && ramp(0.5) == MAX_GAIN);
        assert_eq!(gain(&Gray::filled(3, 1, 7.0)), 1.0);
    }
}
