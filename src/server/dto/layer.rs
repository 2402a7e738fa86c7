//! `LayerJson`: a layer of the store.

use overfly_store::Layer;
use serde::Serialize;
use utoipa::ToSchema;

/// One epoch of imagery, with its own tile table.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Layer)]
pub(crate) struct LayerJson {
    /// Name, `ortho` by default.
    name: String,
    /// Zoom of the finest level, to which sources are warped.
    base_zoom: u8,
    /// Zoom of the coarsest overview.
    min_zoom: u8,
    /// Number of tiles at the base level.
    base_tiles: u64,
    /// Number of tiles at all levels.
    tiles: u64,
    /// Extent, degrees: west, south, east, north. West exceeds east if the layer crosses the antimeridian.
    #[schema(min_items = 4, max_items = 4)]
    bounds_deg: [f64; 4],
    /// Earliest and latest acquisition date of its sources, if known.
    #[schema(min_items = 2, max_items = 2)]
    acquired: Option<[String; 2]>,
    /// Whether the layer is finished. An unfinished layer answers no requests.
    complete: bool,
    /// BLAKE3 digest of the logical content, hexadecimal; null while the layer is unfinished.
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
            acquired: layer.acquired.clone().map(<[String; 2]>::from),
            complete: layer.complete,
            digest: layer.digest.clone(),
        }
    }
}
