//! `GroundHeights`: the heights of a store's terrain, and the relief under a view.

use super::camera_pose::CameraPose;
use super::view_size::is_drawable;
use overfly_core::camera::{Camera, GroundGrid, Relief};
use overfly_core::geodesy::{BodyFrame, VerticalDatum};
use overfly_core::tile::{Gsd, HeightGrid, WorldPixel};
use overfly_store::{Layer, Reader, StoreError, Terrain};

/// Beyond a flat view on every side, as a share of its size, heights are read: relief moves what a frame shows.
const BEYOND_SHARE: f64 = 0.2;
/// Ground that rises to more than this share of the camera's height cannot be laid under a view.
const MOST_RISE: f64 = 0.8;
/// Pixels of terrain read beyond what is asked for: heights are interpolated.
const RIM_PX: f64 = 2.0;

/// The terrain of a store.
#[derive(Clone, Copy)]
pub struct GroundHeights<'a> {
    store: &'a Reader,
    layer: &'a Layer,
    terrain: &'a Terrain,
}

/// A view's grid on the relief of the ground.
pub struct LaidGrid {
    /// The grid.
    pub grid: GroundGrid,
    /// The relief under it.
    pub relief: Relief,
}

impl<'a> GroundHeights<'a> {
    /// The terrain of a store; `None` where it has none.
    pub fn from_store(store: &'a Reader) -> Option<Self> {
        store.terrain().map(|(layer, terrain)| Self { store, layer, terrain })
    }

    /// The surface that the heights are above.
    pub fn vertical_datum(&self) -> VerticalDatum {
        self.terrain.vertical_datum
    }

    /// The zoom at which it is stored.
    pub fn zoom(&self) -> u8 {
        self.layer.base_zoom
    }

    /// One standard deviation of the heights, metres.
    pub fn error_m(&self) -> f64 {
        self.terrain.error_m()
    }

    /// The height of the ground at a pixel of the world at a zoom, metres; `None` where it is not known.
    ///
    /// # Errors
    /// Where a tile cannot be read.
    pub fn height_m(&self, at: WorldPixel, zoom: u8) -> Result<Option<f64>, StoreError> {
        Ok(self.window(zoom, [at.x_px, at.y_px], [at.x_px, at.y_px])?.at(at, zoom))
    }

    /// The heights between two pixels of the world at a zoom, no finer than it: a fine terrain under a coarse view takes no more memory.
    fn window(&self, zoom: u8, from_px: [f64; 2], to_px: [f64; 2]) -> Result<HeightGrid, StoreError> {
        let read_at = zoom.min(self.layer.base_zoom);
        let factor = 2f64.powi(i32::from(read_at) - i32::from(zoom));
        let corner = from_px.map(|px| (px * factor - RIM_PX).floor() as i64);
        let end = to_px.map(|px| (px * factor + RIM_PX).ceil() as i64);
        let size = [0, 1].map(|axis| (end[axis] - corner[axis]).max(1) as usize);
        self.store.heights(self.layer, read_at, corner, size)
    }

    /// The heights under a grid whose nadir is a pose's, and beyond it on every side by a share of its size.
    fn under(&self, pose: &CameraPose, grid: &GroundGrid, beyond: f64) -> Result<HeightGrid, StoreError> {
        let size = [grid.width_px as f64, grid.height_px as f64];
        let corner = [pose.nadir.x_px - grid.nadir_px[0], pose.nadir.y_px - grid.nadir_px[1]];
        let from = [0, 1].map(|axis| corner[axis] - beyond * size[axis]);
        self.window(pose.zoom, from, [0, 1].map(|axis| corner[axis] + (1.0 + beyond) * size[axis]))
    }

    /// The grid of a view through a pose, whose nadir lies `fraction_px` right of and below a pixel corner, with the relief under it;
    /// `None` where the terrain does not cover all of it, or reaches up to the camera, and where the view is larger than any that is made.
    ///
    /// # Errors
    /// Where a tile cannot be read.
    pub fn laid(
        &self,
        camera: &Camera,
        pose: &CameraPose,
        gsd: Gsd,
        fraction_px: [f64; 2],
    ) -> Result<Option<LaidGrid>, StoreError> {
        let gsd_m_per_px = [gsd.east_m_per_px, gsd.north_m_per_px];
        let flat = GroundGrid::around(camera, pose.heading_rad, gsd_m_per_px, 1.0).filter(is_drawable);
        let Some(flat) = flat else { return Ok(None) };
        let Some(centre) = image_centre(camera, pose, gsd) else { return Ok(None) };
        let heights = self.under(pose, &flat, BEYOND_SHARE)?;
        let Some(reference_m) = heights.at(centre, pose.zoom) else { return Ok(None) };
        let Some(rises_m) = rises_m(&heights, reference_m) else { return Ok(None) };
        if rises_m[1] > MOST_RISE * camera.height_agl_m() {
            return Ok(None);
        }
        let laid = GroundGrid::around_relief(camera, pose.heading_rad, gsd_m_per_px, 1.0, rises_m);
        let Some(mut grid) = laid.filter(is_drawable) else { return Ok(None) };
        grid.nadir_px = [grid.nadir_px[0] + fraction_px[0], grid.nadir_px[1] + fraction_px[1]];
        let heights = self.under(pose, &grid, 0.0)?;
        let relief = relief(&heights, pose, &grid, reference_m);
        Ok(relief.map(|relief| LaidGrid { grid, relief }))
    }
}

/// The ground under the image's centre, in pixels of the pose's level; `None` above the horizon.
pub fn image_centre(camera: &Camera, pose: &CameraPose, gsd: Gsd) -> Option<WorldPixel> {
    let centre = BodyFrame::from_heading_rad(pose.heading_rad).enu_from_body(camera.image_centre_in_body()?);
    Some(WorldPixel {
        x_px: pose.nadir.x_px + centre.east_m / gsd.east_m_per_px,
        y_px: pose.nadir.y_px - centre.north_m / gsd.north_m_per_px,
    })
}

/// The lowest and the highest of the known heights above the reference, metres, at most 0 and at least 0.
fn rises_m(heights: &HeightGrid, reference_m: f64) -> Option<[f64; 2]> {
    let known = heights.heights_m().iter().filter(|height| height.is_finite()).map(|height| f64::from(*height));
    let extremes = known.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| [low.min(h), high.max(h)]);
    extremes[0].is_finite().then(|| [(extremes[0] - reference_m).min(0.0), (extremes[1] - reference_m).max(0.0)])
}

/// The relief of a grid; `None` where a height is not known.
fn relief(heights: &HeightGrid, pose: &CameraPose, grid: &GroundGrid, reference_m: f64) -> Option<Relief> {
    let left = pose.nadir.x_px - grid.nadir_px[0] + 0.5;
    let top = pose.nadir.y_px - grid.nadir_px[1] + 0.5;
    let mut rises = Vec::with_capacity(grid.width_px * grid.height_px);
    for y in 0..grid.height_px {
        for x in 0..grid.width_px {
            let at = WorldPixel { x_px: left + x as f64, y_px: top + y as f64 };
            rises.push((heights.at(at, pose.zoom)? - reference_m) as f32);
        }
    }
    Relief::new([grid.width_px, grid.height_px], rises)
}
