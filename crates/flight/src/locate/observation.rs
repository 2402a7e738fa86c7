//! `Observation`: the frame seen through a pose, and the map under it.

use super::camera_pose::CameraPose;
use super::frame_pyramid::{FramePyramid, structure_of};
use super::map::Map;
use super::pixel_window::PixelWindow;
use overfly_core::camera::{GroundView, Relief};
use overfly_core::feature::Structure;
use overfly_core::registration::seam::Displacements;
use overfly_core::registration::windows::{
    WindowMatch, WindowOptions, WindowSurface, match_windows, square_surfaces, window_surfaces,
};
use overfly_core::tile::{Gsd, WorldPixel, gsd_at};
use overfly_store::StoreError;
use std::sync::Arc;

/// A ground view of the frame through a pose, and the map that it should lie on.
pub struct Observation {
    /// The ground view.
    pub view: GroundView,
    /// The relief that the view is laid on; `None` where it lies on a plane.
    pub relief: Option<Arc<Relief>>,
    /// The structural channels of the view.
    pub view_structure: Structure,
    /// The window of the map: the view and `margin_px` around.
    pub window: PixelWindow,
    /// The structural channels of the map there.
    pub map_structure: Structure,
    /// Pixels of map beyond the view on every side.
    pub margin_px: usize,
    /// Ground sample distance at the pose.
    pub gsd: Gsd,
    /// Edge of the windows that are matched, pixels.
    pub window_size_px: usize,
}

impl Observation {
    /// Renders the frame through a pose and reads the map there, `margin_px` around the view. `None` beyond the tile matrix and
    /// where the frame sees the horizon.
    ///
    /// # Errors
    /// Where a tile cannot be read.
    pub fn new(
        map: &Map<'_>,
        frame: &FramePyramid<'_>,
        pose: &CameraPose,
        margin_px: usize,
    ) -> Result<Option<Self>, StoreError> {
        let Ok(place) = pose.nadir.to_geodetic(pose.zoom) else { return Ok(None) };
        let gsd = gsd_at(place, pose.zoom);
        let WorldPixel { x_px, y_px } = pose.nadir;
        let fraction = [x_px - x_px.floor(), y_px - y_px.floor()];
        let laid = match map.ground() {
            Some(ground) => frame.view_on_relief(pose, gsd, fraction, ground)?,
            None => None,
        };
        let (view, relief) = match laid {
            Some((view, relief)) => (view, Some(Arc::new(relief))),
            None => match frame.view(pose, gsd, fraction) {
                Some(view) => (view, None),
                None => return Ok(None),
            },
        };
        let nadir_px = view.grid.nadir_px;
        // The view's nadir and the pose's differ by whole pixels.
        let window = PixelWindow {
            zoom: pose.zoom,
            left: (x_px - nadir_px[0]).round() as i64 - margin_px as i64,
            top: (y_px - nadir_px[1]).round() as i64 - margin_px as i64,
            width_px: view.grid.width_px + 2 * margin_px,
            height_px: view.grid.height_px + 2 * margin_px,
        };
        let map_structure = map.window(&window)?;
        let window_size_px = window_size_px(frame, gsd.mean_m_per_px() / pose.height_ratio);
        let view_structure = structure_of(&view);
        Ok(Some(Self { view, relief, view_structure, window, map_structure, margin_px, gsd, window_size_px }))
    }

    /// Matches local windows of the view with the map.
    pub fn match_windows(&self, options: &WindowOptions) -> Vec<WindowMatch> {
        match_windows(&self.view_structure, &self.map_structure, [self.margin_px as isize; 2], options)
    }

    fn window_options(&self, radius_px: usize) -> WindowOptions {
        Self::options(self.window_size_px, radius_px)
    }

    fn options(size_px: usize, radius_px: usize) -> WindowOptions {
        WindowOptions { size_px, stride_px: size_px, radius_px, step_px: 1 }
    }

    /// The correlation of each window of an edge of `size_px` with the map over its whole search square.
    pub fn square_surfaces(&self, size_px: usize, radius_px: usize) -> Vec<WindowSurface> {
        let options = Self::options(size_px, radius_px);
        square_surfaces(&self.view_structure, &self.map_structure, [self.margin_px as isize; 2], &options)
    }

    /// The correlation of each window of an edge of `size_px` with the map over every second place of a search square whose middle lies
    /// `offset_px` beside the window's place.
    pub fn surfaces_beside(&self, size_px: usize, radius_px: usize, offset_px: [isize; 2]) -> Vec<WindowSurface> {
        let options = Self::options(size_px, radius_px);
        let radius = radius_px as isize;
        let axis = || (-radius..=radius).step_by(2);
        let displacements: Vec<_> = axis().flat_map(|y| axis().map(move |x| [x, y])).collect();
        let middle_px = offset_px.map(|offset| self.margin_px as isize + offset);
        window_surfaces(&self.view_structure, &self.map_structure, middle_px, &options, &displacements)
    }

    /// The correlation of each window with the map at displacements from its place.
    pub fn window_surfaces(&self, displacements: &Displacements) -> Vec<WindowSurface> {
        let options = self.window_options(displacements.radius_px());
        let margin_px = [self.margin_px as isize; 2];
        window_surfaces(&self.view_structure, &self.map_structure, margin_px, &options, &displacements.all_px)
    }
}

/// A sixth of the frame's edge, a multiple of 8 from 16 to 48 pixels.
fn window_size_px(frame: &FramePyramid<'_>, gsd_m_per_px: f64) -> usize {
    let (w, h) = frame.camera().frame_size_px();
    let edge_px = (f64::from(w) * f64::from(h)).sqrt() * frame.camera().gsd_m_per_px() / gsd_m_per_px;
    ((edge_px / 6.0 / 8.0).round() as usize * 8).clamp(16, 48)
}
