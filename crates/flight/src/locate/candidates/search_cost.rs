//! `SearchCost`: how long a fix takes that searches tiles.

use super::super::hypotheses::{REACH_SIGMAS, around, step};
use super::super::levels::Levels;
use super::super::parameters::{DEFAULT_HEADING_SIGMA_DEG, DEFAULT_HEIGHT_SIGMA_RATIO};
use super::super::search_extent::estimated_s;
use overfly_core::camera::{Camera, View};
use overfly_core::geodesy::Geodetic;
use overfly_core::region::ImageOnGround;
use overfly_core::tile::{TILE_SIZE_PX, gsd_at};
use overfly_store::Layer;

/// Pixels along the edge (square root of the area) of the image that is assumed; the time hardly depends on it.
const EDGE_PX: f64 = 480.0;

/// The cost of searching one tile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchCost {
    /// Coarse pixels of a tile times headings and scales.
    comparisons_per_tile: f64,
}

impl SearchCost {
    /// The cost of a tile of a layer's level near a point, for an image whose heading and height are as uncertain as those of a fix
    /// that does not state it.
    pub fn new(layer: &Layer, zoom: u8, near: Geodetic, image: ImageOnGround) -> Self {
        let gsd_m_per_px = (image.across_m * image.along_m).sqrt() / EDGE_PX;
        let pixels = |extent_m: f64| (extent_m / gsd_m_per_px).round().max(1.0) as u32;
        let (width_px, height_px) = (pixels(image.across_m), pixels(image.along_m));
        let camera = Camera::new(&View::Nadir { gsd_m_per_px }, width_px, height_px);
        let coarse = camera.map_or(layer.base_zoom, |camera| Levels::choose(&camera, layer, near).coarse);
        let half_diagonal_m = image.across_m.hypot(image.along_m) / 2.0;
        let step = step(half_diagonal_m / gsd_at(near, coarse).mean_m_per_px());
        let headings = around(REACH_SIGMAS * DEFAULT_HEADING_SIGMA_DEG.to_radians(), step).len();
        let scales = around(REACH_SIGMAS * DEFAULT_HEIGHT_SIGMA_RATIO, 1.5 * step).len();
        let edge_px = f64::from(TILE_SIZE_PX) * 2f64.powi(i32::from(coarse) - i32::from(zoom));
        Self { comparisons_per_tile: edge_px * edge_px * (headings * scales) as f64 }
    }

    /// Estimated time to search so many tiles with one thread, seconds; 0 without a tile.
    pub fn estimated_s(&self, tiles: usize) -> f64 {
        if tiles == 0 { 0.0 } else { estimated_s(self.comparisons_per_tile * tiles as f64) }
    }
}
