//! Which tiles of which layers and levels a corridor needs.

use super::corridor::Corridor;
use super::{ExportRequest, PackageError};
use crate::store::{Layer, LayerPart, Reader};
use crate::tile::TileId;
use std::collections::BTreeSet;

/// Pixels of each level that a search reads past the ground it compares: the border of structure (3), the radius within which
/// windows are matched (8), rims and rounding; and a few of its neighbours.
const MARGIN_PX: f64 = 64.0;
/// Levels coarser than the coarsest stored are made of it on the spot, up to this many times as coarse.
const DERIVED: f64 = 16.0;

/// The tiles of one level that meet the corridor widened by what a search near its edge reads, by row and column.
///
/// # Errors
/// Where the store cannot be read or the route leaves the tile matrix.
pub fn tiles_of_level(
    store: &Reader,
    layer: &Layer,
    zoom: u8,
    corridor: &Corridor,
) -> Result<BTreeSet<TileId>, PackageError> {
    let margin_px = if zoom == layer.min_zoom { MARGIN_PX * DERIVED } else { MARGIN_PX };
    let mut met = BTreeSet::new();
    for region in corridor.regions(zoom, margin_px)? {
        for footprint in store.footprints_in(layer, zoom, &region.mercator_bounds())? {
            if !met.contains(&footprint.tile) && region.meets(&footprint.tile.mercator_bounds()) {
                met.insert(footprint.tile);
            }
        }
    }
    Ok(met)
}

/// What a request takes of every layer that it means, by name. A layer that does not meet the corridor is left out.
///
/// # Errors
/// [`PackageError::NothingInCorridor`], a layer that is not there or not finished, or as [`tiles_of_level`].
pub fn select(store: &Reader, request: &ExportRequest, corridor: &Corridor) -> Result<Vec<LayerPart>, PackageError> {
    let mut layers: Vec<&Layer> = if request.layers.is_empty() {
        store.layers().iter().filter(|l| l.complete).collect()
    } else {
        request.layers.iter().map(|name| store.layer(name)).collect::<Result<_, _>>()?
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
        for zoom in layer.min_zoom..layer.base_zoom {
            tiles.extend(tiles_of_level(store, layer, zoom, corridor)?);
        }
        parts.push(LayerPart {
            name: layer.name.clone(),
            base_zoom: layer.base_zoom,
            min_zoom: layer.min_zoom,
            tiles: tiles.into_iter().collect(),
            with_descriptors: true,
        });
    }
    if parts.is_empty() { Err(PackageError::NothingInCorridor { path: store.path().into() }) } else { Ok(parts) }
}
