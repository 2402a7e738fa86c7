//! `TileJson`: a layer as map viewers read it.

use overfly_core::geodesy::GeodeticBounds;
use overfly_core::tile::TILE_SIZE_PX;
use overfly_store::Layer;
use serde::Serialize;
use utoipa::ToSchema;

/// A layer as TileJSON 3.0.0, with `tileSize` for MapLibre.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(crate) struct TileJson {
    /// "3.0.0".
    tilejson: &'static str,
    /// Name of the layer.
    name: String,
    /// Address template of the tiles; absolute if the request has a `Host`.
    tiles: Vec<String>,
    /// "xyz".
    scheme: &'static str,
    /// Coarsest level.
    minzoom: u8,
    /// Finest level.
    maxzoom: u8,
    /// West, south, east, north, degrees.
    #[schema(min_items = 4, max_items = 4)]
    bounds: [f64; 4],
    /// Longitude, latitude and zoom of the initial view.
    #[schema(min_items = 3, max_items = 3)]
    center: [f64; 3],
    /// Whom a map must name, and the licence, as the layer states them.
    #[serde(skip_serializing_if = "Option::is_none")]
    attribution: Option<String>,
    /// 512.
    #[serde(rename = "tileSize")]
    tile_size: u32,
}

impl TileJson {
    /// The description of a layer whose tiles are at `{origin}/v1/tiles/`.
    pub fn new(layer: &Layer, origin: &str) -> Self {
        let GeodeticBounds { west_deg: west, south_deg: south, north_deg: north, .. } = layer.bounds_deg;
        // Viewers read the bounds as an interval: east stays above west across the antimeridian.
        let east = layer.bounds_deg.unwrapped_east_deg();
        let middle = (west + east) / 2.0;
        Self {
            tilejson: "3.0.0",
            name: layer.name.clone(),
            tiles: vec![format!("{origin}/v1/tiles/{}/{{z}}/{{x}}/{{y}}", layer.name)],
            scheme: "xyz",
            minzoom: layer.min_zoom,
            maxzoom: layer.base_zoom,
            bounds: [west, south, east, north],
            center: [
                if middle > 180.0 { middle - 360.0 } else { middle },
                (south + north) / 2.0,
                f64::from(layer.min_zoom),
            ],
            attribution: attribution(layer),
            tile_size: TILE_SIZE_PX,
        }
    }
}

/// Attribution, then licence, where the layer states either. Viewers show it as HTML, so what is special there is escaped.
fn attribution(layer: &Layer) -> Option<String> {
    let stated: Vec<&str> =
        [&layer.terms.attribution, &layer.terms.licence].into_iter().flatten().map(|t| &**t).collect();
    let escaped = |text: String| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    (!stated.is_empty()).then(|| escaped(stated.join(", ")))
}
