//! `Map`: a layer of a store as one seamless structure at any of its levels.

use overfly_core::feature::Structure;
use overfly_core::tile::TILE_SIZE_PX;
use overfly_store::{Layer, Reader, StoreError};

/// A window of a level, pixels of the world at that zoom. Columns may run past the antimeridian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelWindow {
    /// Zoom.
    pub zoom: u8,
    /// First column.
    pub left: i64,
    /// First row.
    pub top: i64,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
}

/// A layer to look at.
pub struct Map<'a> {
    store: &'a Reader,
    layer: &'a Layer,
}

impl<'a> Map<'a> {
    /// The layer of a store.
    pub fn new(store: &'a Reader, layer: &'a Layer) -> Self {
        Self { store, layer }
    }

    /// Structure of a window; where there is no tile, or beyond the poles, unknown.
    ///
    /// # Errors
    /// Where the store cannot give a tile.
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
