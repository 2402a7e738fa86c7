//! `FramePyramid`: a frame at the resolution of several levels, and its ground view under a hypothesis.

use overfly_core::camera::{Camera, GroundGrid, GroundView, render};
use overfly_core::feature::Structure;
use overfly_core::pixels::Gray;
use overfly_core::tile::Gsd;
use std::collections::HashMap;

/// A view larger than this in either direction is taken for one that sees the horizon.
const MAX_VIEW_PX: usize = 4096;

/// A frame with its camera, shrunk once for every level on which it is compared.
pub struct FramePyramid<'a> {
    gray: &'a Gray,
    camera: Camera,
    shrunk: HashMap<u8, (Gray, Camera)>,
}

impl<'a> FramePyramid<'a> {
    /// Returns the pyramid of a frame and the camera that took it, without levels.
    pub fn new(gray: &'a Gray, camera: Camera) -> Self {
        Self { gray, camera, shrunk: HashMap::new() }
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
            let small = source.shrunk(side(self.gray.width_px()), side(self.gray.height_px()));
            let resized = self.camera.resized(small.width_px(), small.height_px());
            self.shrunk.insert(zoom, (small, resized));
            last = Some(zoom);
        }
    }

    /// The north-up ground view of the frame at a level of the pyramid, under a heading (radians) and a height ratio. The nadir lies
    /// `fraction_px` right of and below a pixel corner. `None` where the frame sees the horizon.
    pub fn view(
        &self,
        zoom: u8,
        gsd: Gsd,
        heading_rad: f64,
        height_ratio: f64,
        fraction_px: [f64; 2],
    ) -> Option<GroundView> {
        let (small, camera) = self.shrunk.get(&zoom)?;
        let camera = camera.at_height_ratio(height_ratio);
        let mut grid = GroundGrid::around(&camera, heading_rad, [gsd.east_m_per_px, gsd.north_m_per_px], 1.0)?;
        if grid.width_px.max(grid.height_px) > MAX_VIEW_PX {
            return None;
        }
        grid.nadir_px[0] += fraction_px[0];
        grid.nadir_px[1] += fraction_px[1];
        Some(render(small, &camera, heading_rad, &grid))
    }
}

/// The structural channels of a view.
pub fn structure_of(view: &GroundView) -> Structure {
    Structure::new(&view.gray, &view.mask)
}
