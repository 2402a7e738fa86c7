//! `candidates`: which tiles to search for a position and its uncertainty, from the store's R-tree.

use super::candidate_tiles::Candidates;
use super::error::CandidatesError;
use super::query::{CandidateQuery, MAX_TILES};
use super::ranking::rank;
use super::search_cost::SearchCost;
use overfly_core::region::Region;
use overfly_core::tile::{MAX_ZOOM, MercatorBounds, TileId, zoom_for_gsd};
use overfly_store::{ANY_LAYER, Layer, Reader};

/// Answers a query from the store's own R-tree. [`super::Residents`] answers the same from memory.
///
/// # Errors
/// [`CandidatesError`]: parameters out of range, an unknown layer, more than [`MAX_TILES`] tiles, the store.
pub fn candidates(store: &Reader, query: &CandidateQuery) -> Result<Candidates, CandidatesError> {
    let (layer, zoom, region) = prepare(store, query)?;
    let footprints = store.footprints_in(layer, zoom, &region.mercator_bounds())?;
    let cost = SearchCost::new(layer, zoom, query.centre, query.image);
    Ok(rank(&layer.name, footprints.iter(), &region, query.max_tiles, &cost))
}

/// The layer, the zoom and the region of a query.
pub(super) fn prepare<'a>(
    store: &'a Reader,
    query: &CandidateQuery,
) -> Result<(&'a Layer, u8, Region), CandidatesError> {
    let layer = match &query.layer {
        Some(name) => named_layer(store, name)?,
        None => default_layer(store)?,
    };
    let zoom = level(layer, query)?;
    let region = Region::new(query.centre, query.image, query.uncertainty)?;
    bounded(&region.mercator_bounds(), zoom, layer, MAX_TILES)?;
    Ok((layer, zoom, region))
}

/// Returns the finished layer of a name.
///
/// # Errors
/// [`CandidatesError::AnyLayer`] for [`ANY_LAYER`], unless a layer of an older program has that name; where the store has no such layer.
pub fn named_layer<'a>(store: &'a Reader, name: &str) -> Result<&'a Layer, CandidatesError> {
    if name == ANY_LAYER && store.layers().iter().all(|layer| layer.name != ANY_LAYER) {
        return Err(CandidatesError::AnyLayer { layers: store.imagery_layers().map(|l| l.name.clone()).collect() });
    }
    Ok(store.imagery_layer(name)?)
}

/// Returns the layer to use where none is named: the only complete one, or `ortho` among several.
///
/// # Errors
/// [`CandidatesError::LayerNotStated`] where this is not one layer.
pub fn default_layer(store: &Reader) -> Result<&Layer, CandidatesError> {
    let mut complete = store.imagery_layers();
    match (complete.next(), complete.next()) {
        (Some(only), None) => Ok(only),
        _ => store.imagery_layers().find(|l| l.name == "ortho").ok_or_else(|| CandidatesError::LayerNotStated {
            layers: store.imagery_layers().map(|l| l.name.clone()).collect(),
        }),
    }
}

fn level(layer: &Layer, query: &CandidateQuery) -> Result<u8, CandidatesError> {
    let Some(gsd) = query.gsd_m_per_px else { return Ok(layer.base_zoom) };
    if !(gsd.is_finite() && gsd > 0.0) {
        return Err(CandidatesError::out_of_range("gsd_m_per_px", gsd, "metres per pixel, more than 0 and finite"));
    }
    Ok(zoom_for_gsd(query.centre, gsd).clamp(layer.min_zoom, layer.base_zoom))
}

/// The number of tiles that a query could meet; refused where it exceeds `most`.
pub(super) fn bounded(bounds: &MercatorBounds, zoom: u8, layer: &Layer, most: u64) -> Result<u64, CandidatesError> {
    let world = TileId::new(0, 0, 0).expect("the world is a tile").mercator_bounds();
    let span_m = (world.max_x_m - world.min_x_m) / f64::from(1u32 << zoom.min(MAX_ZOOM));
    let cells = |extent_m: f64| (extent_m / span_m).ceil() + 1.0;
    let tiles = cells(bounds.max_x_m - bounds.min_x_m) * cells(bounds.max_y_m - bounds.min_y_m);
    let tiles = tiles.min(layer.tiles as f64) as u64;
    if tiles > most { Err(CandidatesError::TooManyTiles { tiles, zoom, most }) } else { Ok(tiles) }
}
