//! `Map`: a layer of a store as one seamless image of structural channels at any of its levels.

use super::ground_heights::GroundHeights;
use super::pixel_window::PixelWindow;
use super::search_context::SearchContext;
use overfly_core::feature::Structure;
use overfly_core::tile::TILE_SIZE_PX;
use overfly_store::{Layer, Reader, StoreError};

/// A layer of a store, and the terrain below it.
pub struct Map<'a> {
    store: &'a Reader,
    layer: &'a Layer,
    ground: Option<GroundHeights<'a>>,
}

impl<'a> Map<'a> {
    /// Returns the map that a registration searches.
    pub fn new(context: &SearchContext<'a>) -> Self {
        Self { store: context.store, layer: context.layer, ground: context.ground }
    }

    /// The terrain, where frames are laid on it.
    pub fn ground(&self) -> Option<&GroundHeights<'a>> {
        self.ground.as_ref()
    }

    /// The structural channels of a window; unknown where there is no tile, and beyond the poles.
    ///
    /// # Errors
    /// Where a tile cannot be read.
    pub fn window(&self, window: &PixelWindow) -> Result<Structure, StoreError> {
        let mut structure = Structure::unknown(window.width_px, window.height_px);
        let size = i64::from(TILE_SIZE_PX);
        let columns = window.left.div_euclid(size)..=(window.left + window.width_px as i64 - 1).div_euclid(size);
        let rows = window.top.div_euclid(size)..=(window.top + window.height_px as i64 - 1).div_euclid(size);
        for row in rows {
            for column in columns.clone() {
                if let Some(tile) = self.store.structure(self.layer, window.zoom, column, row)? {
                    structure.paste(&tile, column * size - window.left, row * size - window.top);
                }
            }
        }
        Ok(structure)
    }
}
