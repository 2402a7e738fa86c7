//! Selecting the tiles that a corridor needs, of each layer and level.

use super::corridor::Corridor;
use super::error::ExportError;
use super::request::ExportRequest;
use overfly_core::tile::TileId;
use overfly_store::{Layer, LayerPart, Reader};
use std::collections::BTreeSet;

/// Pixels of a level that a search reads past the ground that it compares: 30 to compute a peak's z-score (more than the 8
/// of windows and their borders), and some for rounding.
const MARGIN_PX: f64 = 40.0;

/// The most tiles of one level that the pieces of a corridor are compared with, counting each tile once for each piece: about half a
/// minute.
const MOST_COMPARISONS: u64 = 50_000_000;

/// Returns the tiles of one level that a search within the corridor reads: those that meet the widened corridor, and the
/// eight around each, because a tile is described together with its neighbours' edges.
///
/// # Errors
/// [`ExportError`] where the store cannot be read, the route leaves the tile matrix, or the corridor takes too many comparisons.
pub fn tiles_of_level(
    store: &Reader,
    layer: &Layer,
    zoom: u8,
    corridor: &Corridor,
) -> Result<BTreeSet<TileId>, ExportError> {
    let mut met = BTreeSet::new();
    let mut comparisons = 0;
    for region in corridor.regions(zoom, MARGIN_PX) {
        let region = region?;
        let footprints = store.footprints_in(layer, zoom, &region.mercator_bounds())?;
        comparisons += footprints.len() as u64;
        if comparisons > MOST_COMPARISONS {
            return Err(ExportError::TooManyComparisons { path: store.path().into(), most: MOST_COMPARISONS });
        }
        for footprint in footprints {
            if !met.contains(&footprint.tile) && region.meets(&footprint.tile.mercator_bounds()) {
                met.insert(footprint.tile);
            }
        }
    }
    let mut taken = BTreeSet::new();
    for tile in met.iter().flat_map(|tile| around(*tile)) {
        if met.contains(&tile) || (!taken.contains(&tile) && store.footprint(layer, tile)?.is_some()) {
            taken.insert(tile);
        }
    }
    Ok(taken)
}

/// Returns a tile and the eight around it, across the antimeridian but not beyond the poles.
fn around(tile: TileId) -> impl Iterator<Item = TileId> {
    let matrix = 1i64 << tile.zoom();
    (-1..=1).flat_map(move |dy| (-1..=1).map(move |dx| (dx, dy))).filter_map(move |(dx, dy)| {
        let column = (i64::from(tile.column()) + dx).rem_euclid(matrix);
        let row = u32::try_from(i64::from(tile.row()) + dy).ok()?;
        TileId::new(tile.zoom(), column as u32, row).ok()
    })
}

/// Returns the tiles that a request takes of each of its layers, and of the terrain, sorted by name. A layer that does not meet the corridor is
/// left out. The coarsest level is taken whole: still coarser levels are made from its whole tiles in flight, and it is small.
///
/// # Errors
/// [`ExportError::NothingInCorridor`], a missing or unfinished layer, or as [`tiles_of_level`].
pub fn select(store: &Reader, request: &ExportRequest, corridor: &Corridor) -> Result<Vec<LayerPart>, ExportError> {
    let mut layers: Vec<&Layer> = if request.layers.is_empty() {
        store.imagery_layers().collect()
    } else {
        request.layers.iter().map(|name| store.imagery_layer(name)).collect::<Result<_, _>>()?
    };
    layers.sort_by(|a, b| a.name.cmp(&b.name));
    layers.dedup_by(|a, b| a.name == b.name);
    let mut parts = Vec::new();
    for layer in layers {
        let base = tiles_of_level(store, layer, layer.base_zoom, corridor)?;
        if base.is_empty() {
            continue;
        }
        let mut tiles = base;
        for zoom in layer.min_zoom + 1..layer.base_zoom {
            tiles.extend(tiles_of_level(store, layer, zoom, corridor)?);
        }
        tiles.extend(store.footprints(layer, layer.min_zoom)?.iter().map(|f| f.tile));
        parts.push(LayerPart {
            name: layer.name.clone(),
            base_zoom: layer.base_zoom,
            min_zoom: layer.min_zoom,
            tiles: tiles.into_iter().collect(),
            with_descriptors: true,
            jpeg_quality: request.jpeg_quality,
        });
    }
    if parts.is_empty() {
        return Err(ExportError::NothingInCorridor { path: store.path().into() });
    }
    parts.extend(terrain(store, corridor)?);
    parts.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(parts)
}

/// The part of the terrain that a corridor needs, where the store has terrain there.
fn terrain(store: &Reader, corridor: &Corridor) -> Result<Option<LayerPart>, ExportError> {
    let Some((layer, _)) = store.terrain() else { return Ok(None) };
    let tiles = tiles_of_level(store, layer, layer.base_zoom, corridor)?;
    Ok((!tiles.is_empty()).then(|| LayerPart {
        name: layer.name.clone(),
        base_zoom: layer.base_zoom,
        min_zoom: layer.base_zoom,
        tiles: tiles.into_iter().collect(),
        with_descriptors: false,
        jpeg_quality: None,
    }))
}
