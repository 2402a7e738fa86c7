//! `Levels`: the levels of the map to work on, from the ground sample distances of frame and map.

use overfly_core::camera::Camera;
use overfly_core::feature::CELL_PX;
use overfly_core::geodesy::Geodetic;
use overfly_core::tile::gsd_at;
use overfly_store::Layer;

/// A frame's edge (square root of its area) should have this many merged cells. With 8 cells the score of the right place, in a frame
/// of another year, is no higher than that of some wrong ones among a million; with 12 it is twice as high.
const EDGE_CELLS: f64 = 10.0;
/// A smaller frame is searched for on the finest cells, if its edge has at least this many.
const MIN_EDGE_CELLS: f64 = 6.5;

/// The level of the coarse search and the finest one of the refinement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Levels {
    /// Zoom of the coarse search.
    pub coarse: u8,
    /// Zoom at which the position is measured.
    pub finest: u8,
}

/// At the coarse level a frame's edge (square root of its area) has at least this many pixels. In experiments every frame was
/// found at 50 pixels, and some were lost at 30.
const MIN_COARSE_EDGE_PX: f64 = 46.0;
/// At the finest level a frame's edge has at most this many pixels.
const MAX_FINEST_EDGE_PX: f64 = 400.0;

/// Levels coarser than the store's coarsest that may be derived in memory; the coarsest level holds a few tiles at most.
const MAX_DERIVED_LEVELS: u8 = 4;

impl Levels {
    /// Chooses the levels for a camera over a layer near a point.
    pub fn choose(camera: &Camera, layer: &Layer, near: Geodetic) -> Self {
        let frame_gsd = camera.gsd_m_per_px();
        let (w, h) = camera.frame_size_px();
        let edge_m = (f64::from(w) * f64::from(h)).sqrt() * frame_gsd;
        let gsd = |zoom: u8| gsd_at(near, zoom).mean_m_per_px();
        let zooms = layer.min_zoom.saturating_sub(MAX_DERIVED_LEVELS)..=layer.base_zoom;
        let coarse = zooms.clone().find(|&z| edge_m / gsd(z) >= MIN_COARSE_EDGE_PX).unwrap_or(layer.base_zoom);
        // Neither sharper than the frame (to half a level) nor sharper than the measurement needs.
        let finest = zooms
            .rev()
            .find(|&z| gsd(z) * std::f64::consts::SQRT_2 >= frame_gsd && edge_m / gsd(z) <= MAX_FINEST_EDGE_PX)
            .unwrap_or(coarse)
            .max(coarse);
        Self { coarse, finest }
    }

    /// Every zoom from the coarse to the finest level.
    pub fn all(self) -> impl DoubleEndedIterator<Item = u8> {
        self.coarse..=self.finest
    }
}

/// The level of the wide search, and how its cells are merged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellLevel {
    /// Zoom of the level.
    pub zoom: u8,
    /// Number of cells merged along each axis.
    pub pitch: usize,
}

impl CellLevel {
    /// Chooses the coarsest level on which a frame of edge `edge_m` has enough cells, or the finest level; `None` where even the finest
    /// has too few.
    pub fn choose(layer: &Layer, near: Geodetic, edge_m: f64) -> Option<Self> {
        let pitches = |zoom: u8| if zoom == layer.base_zoom { 1..=3 } else { 2..=3 };
        let edge_cells = |level: &Self| edge_m / (gsd_at(near, level.zoom).mean_m_per_px() * level.pitch_px());
        let finest = Self { zoom: layer.base_zoom, pitch: 1 };
        (layer.min_zoom..=layer.base_zoom)
            .flat_map(|zoom| pitches(zoom).rev().map(move |pitch| Self { zoom, pitch }))
            .find(|level| edge_cells(level) >= EDGE_CELLS)
            .or_else(|| Some(finest).filter(|level| edge_cells(level) >= MIN_EDGE_CELLS))
    }

    /// Edge of a merged cell, pixels.
    pub fn pitch_px(self) -> f64 {
        (self.pitch * CELL_PX) as f64
    }
}
