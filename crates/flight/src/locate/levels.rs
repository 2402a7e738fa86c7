//! Which levels of the map to work on, from the frame's and the map's ground sample distances.

use overfly_core::camera::Camera;
use overfly_core::geodesy::Geodetic;
use overfly_core::tile::gsd_at;
use overfly_store::Layer;

/// The level of the coarse search and the finest one of the refinement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Levels {
    /// Where everything is searched.
    pub coarse: u8,
    /// Where the position is measured.
    pub finest: u8,
}

/// At the coarse level a frame's edge (square root of its area) has at least this many pixels: REGISTRATION.md finds
/// every frame at 50 and loses some at 30.
const COARSE_EDGE_PX: f64 = 46.0;
/// At the finest level a frame's edge need not have more pixels than this.
const FINEST_EDGE_PX: f64 = 400.0;

/// Levels that may be derived on the spot below the store's coarsest, which holds a few tiles at most.
const MOST_DERIVED: u8 = 4;

impl Levels {
    /// The levels for a camera over a layer near a place.
    pub fn choose(camera: &Camera, layer: &Layer, near: Geodetic) -> Self {
        let frame_gsd = camera.gsd_m_per_px();
        let (w, h) = camera.frame_size_px();
        let edge_m = (f64::from(w) * f64::from(h)).sqrt() * frame_gsd;
        let gsd = |zoom: u8| gsd_at(near, zoom).mean_m_per_px();
        let zooms = layer.min_zoom.saturating_sub(MOST_DERIVED)..=layer.base_zoom;
        let coarse = zooms.clone().find(|&z| edge_m / gsd(z) >= COARSE_EDGE_PX).unwrap_or(layer.base_zoom);
        // Neither beyond the frame's own sharpness (to half a level) nor beyond what measuring needs.
        let finest = zooms
            .rev()
            .find(|&z| gsd(z) * std::f64::consts::SQRT_2 >= frame_gsd && edge_m / gsd(z) <= FINEST_EDGE_PX)
            .unwrap_or(coarse)
            .max(coarse);
        Self { coarse, finest }
    }

    /// From coarse to finest.
    pub fn all(self) -> impl DoubleEndedIterator<Item = u8> {
        self.coarse..=self.finest
    }
}
