//! `SimulatedMap`: the map that is searched, and whether it shows what the aircraft sees.

use super::route::TruePose;
use crate::trial::error::TrialError;
use overfly_core::geodesy::{BodyFrame, BodyOffset, Enu, Geodetic, LocalFrame};
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::tile::{TILE_SIZE_PX, TileId, gsd_at};
use overfly_flight::locate::candidates::{ResidentIndex, default_layer};
use overfly_store::{Layer, Reader};
use std::collections::HashMap;
use std::sync::Arc;

/// The map of a simulation.
pub enum SimulatedMap {
    /// An endless map: the cost of a search follows (3), and every image lies in the map.
    Endless,
    /// The map of a store.
    Stored(Arc<StoredMap>),
}

/// A layer's tiles in memory.
pub struct StoredMap {
    index: ResidentIndex,
    valid_fraction: HashMap<TileId, f64>,
    zoom: u8,
    /// Edge of a tile at the centre of the layer, metres.
    pub tile_m: f64,
    /// The centre of the layer.
    pub frame: LocalFrame,
    /// Distance from the centre to the bounds of the layer, metres east and north.
    pub half_extent_m: [f64; 2],
}

/// Sample points along each edge of an image.
const LOOKS: usize = 7;

impl StoredMap {
    /// Loads the tiles of a layer.
    ///
    /// # Errors
    /// If the store or the layer cannot be read, or the layer is larger than 100 km.
    pub fn load(store: &Reader, layer: Option<&str>) -> Result<Self, TrialError> {
        let layer = match layer {
            Some(name) => store.layer(name)?,
            None => default_layer(store)?,
        };
        let footprints = store.footprints(layer, layer.base_zoom)?;
        let (frame, half_extent_m) = extent(layer)?;
        let tile_m = gsd_at(frame.origin(), layer.base_zoom).mean_m_per_px() * TILE_SIZE_PX as f64;
        Ok(Self {
            valid_fraction: footprints.iter().map(|f| (f.tile, f.valid_fraction)).collect(),
            index: ResidentIndex::new(footprints),
            zoom: layer.base_zoom,
            tile_m,
            frame,
            half_extent_m,
        })
    }

    /// Number of tiles that meet the region around a stated centre; all tiles of the layer if the region is too large
    /// to search.
    pub fn tiles_met(&self, centre: Geodetic, image: ImageOnGround, uncertainty: Uncertainty) -> usize {
        let Ok(region) = Region::new(centre, image, uncertainty) else { return self.index.len() };
        let near = self.index.footprints_in(&region.mercator_bounds());
        near.into_iter().filter(|f| region.meets(&f.tile.mercator_bounds())).count()
    }

    /// Share of an image that the map shows.
    pub fn shows(&self, pose: &TruePose, across_m: f64, along_m: f64) -> f64 {
        let (here, body) = (LocalFrame::at(pose.position), BodyFrame::from(pose.heading));
        let place = |k: usize| (k as f64 + 0.5) / LOOKS as f64 - 0.5;
        let (mut sum, looks) = (0.0, (LOOKS * LOOKS) as f64);
        for look in 0..LOOKS * LOOKS {
            let offset = BodyOffset { right_m: place(look % LOOKS) * across_m, ahead_m: place(look / LOOKS) * along_m };
            let at = here.geodetic_from_enu(body.enu_from_body(offset)).ok();
            let tile = at.and_then(|point| TileId::containing(point, self.zoom).ok());
            sum += tile.and_then(|tile| self.valid_fraction.get(&tile)).copied().unwrap_or(0.0);
        }
        sum / looks
    }
}

/// The centre of a layer, and the distance to its bounds, metres.
fn extent(layer: &Layer) -> Result<(LocalFrame, [f64; 2]), TrialError> {
    let bounds = layer.bounds_deg;
    let width_deg = bounds.unwrapped_east_deg() - bounds.west_deg;
    let far = |value: f64| TrialError::Option { name: "store", value, expected: "a layer of at most 100 km" };
    let frame = bounds.middle().map(LocalFrame::at).map_err(|_| far(width_deg))?;
    let corner = bounds.north_east().map_err(|_| far(bounds.north_deg))?;
    let Enu { east_m, north_m } = frame.enu_from_geodetic(corner);
    if east_m.max(north_m) > 50_000.0 {
        return Err(far(2.0 * east_m.max(north_m)));
    }
    Ok((frame, [east_m.max(1.0), north_m.max(1.0)]))
}
