//! `Pose`: a hypothesis of where the camera was, and the frame seen through it.

use overfly_core::camera::{Camera, GroundGrid, GroundView, render};
use overfly_core::feature::Structure;
use overfly_core::geodesy::Heading;
use overfly_core::pixels::Gray;
use overfly_core::registration::Similarity;
use overfly_core::tile::{Gsd, WorldPixel};
use std::collections::HashMap;

/// Where the camera was, as far as one hypothesis goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The nadir, pixels of the world at `zoom`.
    pub nadir: WorldPixel,
    /// The level that `nadir` counts in.
    pub zoom: u8,
    /// Radians clockwise from north.
    pub heading_rad: f64,
    /// True height over stated height.
    pub height_ratio: f64,
}

impl Pose {
    /// The same place in another level's pixels.
    pub fn at_zoom(self, zoom: u8) -> Self {
        let factor = 2f64.powi(i32::from(zoom) - i32::from(self.zoom));
        let nadir = WorldPixel { x_px: self.nadir.x_px * factor, y_px: self.nadir.y_px * factor };
        Self { nadir, zoom, ..self }
    }

    /// The pose after a measured correction about the nadir, which [`fit_windows`] gives.
    ///
    /// [`fit_windows`]: overfly_core::registration::window_fit::fit_windows
    pub fn corrected(self, map_from_view: &Similarity) -> Self {
        let Similarity { c, s, t } = *map_from_view;
        let nadir = WorldPixel { x_px: self.nadir.x_px + t.x, y_px: self.nadir.y_px + t.y };
        let heading_rad = Heading::from_radians(self.heading_rad + s).radians();
        Self { nadir, heading_rad, height_ratio: self.height_ratio * c, ..self }
    }
}

/// A frame with its camera, shrunk once for every level it is looked at.
pub struct Frame<'a> {
    gray: &'a Gray,
    camera: Camera,
    shrunk: HashMap<u8, (Gray, Camera)>,
}

impl<'a> Frame<'a> {
    /// A frame and the camera that took it.
    pub fn new(gray: &'a Gray, camera: Camera) -> Self {
        Self { gray, camera, shrunk: HashMap::new() }
    }

    /// The camera of the full frame.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Brings the frame near the sharpness of levels (with their ground sample distances), finest first, so that
    /// [`Frame::view`] need not average. Each is shrunk from the one before: a large frame is read once.
    pub fn prepare(&mut self, levels: impl Iterator<Item = (u8, Gsd)>) {
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

    /// The frame from above at a level prepared before, under a heading and a height ratio, its nadir
    /// `nadir_fraction_px` right of and below a pixel corner. `None` where it sees the horizon.
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

/// A view larger than this in either direction is of a frame that looks to the horizon.
const MAX_VIEW_PX: usize = 4096;

/// The structure of a view.
pub fn structure_of(view: &GroundView) -> Structure {
    Structure::new(&view.gray, &view.mask)
}
