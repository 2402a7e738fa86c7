//! `LayerJson`: a layer of the store.

use overfly_store::Layer;
use serde::Serialize;
use utoipa::ToSchema;

/// One epoch of imagery: a tile table of its own.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Layer)]
pub(crate) struct LayerJson {
    /// Its name, `ortho` by default.
    name: String,
    /// The finest level: what sources are warped to.
    base_zoom: u8,
    /// The coarsest overview.
    min_zoom: u8,
    /// Tiles at the base level.
    base_tiles: u64,
    /// Tiles at all levels.
    tiles: u64,
    /// Extent, degrees: west, south, east, north. West may exceed east: then it crosses the antimeridian.
    bounds_deg: [f64; 4],
    /// Earliest and latest acquisition date of its sources, where known.
    acquired: Option<(String, String)>,
    /// Whether its last build was finished; an unfinished layer answers nothing.
    complete: bool,
    /// BLAKE3 of its logical content, hexadecimal; `None` while it is unfinished.
    digest: Option<String>,
}

impl From<&Layer> for LayerJson {
    fn from(layer: &Layer) -> Self {
        Self {
            name: layer.name.clone(),
            base_zoom: layer.base_zoom,
            min_zoom: layer.min_zoom,
            base_tiles: layer.base_tiles,
            tiles: layer.tiles,
            bounds_deg: layer.bounds_deg.into(),
            acquired: layer.acquired.clone(),
            complete: layer.complete,
            digest: layer.digest.clone(),
        }
    }
}
