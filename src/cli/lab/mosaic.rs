//! A layer as one picture.

use crate::cli::failure::Failure;
use overfly_lab::report::Mosaic;
use overfly_store::{Layer, Reader};

/// The tiles of one level of a layer as one picture; `None` if the level has no tiles.
///
/// # Errors
/// If the store cannot be read.
pub fn mosaic_of(store: &Reader, layer: &Layer, zoom: u8) -> Result<Option<Mosaic>, Failure> {
    let mut tiles = Vec::new();
    for footprint in store.footprints(layer, zoom)? {
        tiles.extend(store.tile(layer, footprint.tile)?.map(|pixels| (footprint.tile, pixels)));
    }
    Ok(Mosaic::assemble(&tiles))
}

/// The finest level of a layer that has at most `most` tiles; `None` if even the coarsest has more.
///
/// # Errors
/// If the store cannot be read.
pub fn finest_level(store: &Reader, layer: &Layer, most: usize) -> Result<Option<u8>, Failure> {
    for zoom in (layer.min_zoom..=layer.base_zoom).rev() {
        if store.footprints(layer, zoom)?.len() <= most {
            return Ok(Some(zoom));
        }
    }
    Ok(None)
}
