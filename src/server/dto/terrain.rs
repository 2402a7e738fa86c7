//! `TerrainJson`: the terrain of the store.

use overfly_store::{Layer, Terrain};
use serde::Serialize;
use utoipa::ToSchema;

/// Heights of the ground, on whose relief frames are laid.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Terrain)]
pub(crate) struct TerrainJson {
    /// What the heights are above: `egm96`, `egm2008` or `ellipsoid`.
    vertical_datum: String,
    /// One standard deviation of the heights, metres; null where unknown.
    vertical_error_m: Option<f64>,
    /// Zoom of its tiles.
    zoom: u8,
    /// Number of tiles.
    tiles: u64,
    /// Extent, degrees: west, south, east, north. West exceeds east if it crosses the antimeridian.
    #[schema(min_items = 4, max_items = 4)]
    bounds_deg: [f64; 4],
}

impl TerrainJson {
    /// Describes a layer of heights.
    pub fn new(layer: &Layer, terrain: &Terrain) -> Self {
        Self {
            vertical_datum: terrain.vertical_datum.word().to_owned(),
            vertical_error_m: terrain.vertical_error_m,
            zoom: layer.base_zoom,
            tiles: layer.tiles,
            bounds_deg: layer.bounds_deg.into(),
        }
    }
}
