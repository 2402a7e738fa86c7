//! The ground as searches use it: gray tiles and their structure, at any level, cached between searches.
//!
//! The structure of a tile takes a few milliseconds to compute and half a megabyte for each pair of channels; stored, it would
//! have ten times the size of the JPEG. So it is computed on demand and cached.

use super::ground_cache::GrayTile;
use super::{Layer, Reader, StoreError};
use overfly_core::feature::{BORDER_PX, Structure};
use overfly_core::pixels::{Gray, Mask};
use overfly_core::tile::{MAX_ZOOM, TILE_SIZE_PX, TileId};
use std::sync::Arc;

const SIZE_PX: i64 = TILE_SIZE_PX as i64;

impl Reader {
    /// Returns the structure of a tile, computed with its neighbours: `None` if the layer has no such tile. Levels coarser than the
    /// coarsest of the layer are derived from that one. `column` may run past the antimeridian; no tile lies beyond the poles.
    ///
    /// # Errors
    /// Where the layer is unfinished or a tile is damaged.
    pub fn structure(
        &self,
        layer: &Layer,
        zoom: u8,
        column: i64,
        row: i64,
    ) -> Result<Option<Arc<Structure>>, StoreError> {
        let Some(id) = tile_at(zoom, column, row) else { return Ok(None) };
        let key = (self.index_of(layer), id);
        self.ground.structures.get(key, || self.describe(layer, zoom, column, row))
    }

    /// Returns brightness and mask of a window of a level, whose corner is a pixel of the world at `zoom`; columns may run past the
    /// antimeridian. The mask says where the layer has pixels.
    ///
    /// # Errors
    /// Where the layer is unfinished or a tile is damaged.
    pub fn gray_window(
        &self,
        layer: &Layer,
        zoom: u8,
        corner_px: [i64; 2],
        size_px: [usize; 2],
    ) -> Result<(Gray, Mask), StoreError> {
        let mut window = (Gray::filled(size_px[0], size_px[1], 0.0), Mask::filled(size_px[0], size_px[1], false));
        let tiles = |axis: usize| {
            corner_px[axis].div_euclid(SIZE_PX)..=(corner_px[axis] + size_px[axis] as i64 - 1).div_euclid(SIZE_PX)
        };
        for row in tiles(1) {
            for column in tiles(0) {
                if let Some(tile) = self.gray(layer, zoom, column, row)? {
                    paste(&tile, [column * SIZE_PX - corner_px[0], row * SIZE_PX - corner_px[1]], &mut window);
                }
            }
        }
        Ok(window)
    }

    fn describe(&self, layer: &Layer, zoom: u8, column: i64, row: i64) -> Result<Option<Structure>, StoreError> {
        if self.gray(layer, zoom, column, row)?.is_none() {
            return Ok(None);
        }
        let border = BORDER_PX as i64;
        let side = (SIZE_PX + 2 * border) as usize;
        let mut window = (Gray::filled(side, side, 0.0), Mask::filled(side, side, false));
        for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
            if let Some(tile) = self.gray(layer, zoom, column + dx, row + dy)? {
                paste(&tile, [dx * SIZE_PX + border, dy * SIZE_PX + border], &mut window);
            }
        }
        let mut structure = Structure::unknown(SIZE_PX as usize, SIZE_PX as usize);
        structure.paste(&Structure::new(&window.0, &window.1), -border, -border);
        Ok(Some(structure))
    }

    /// Returns brightness and mask of a tile.
    fn gray(&self, layer: &Layer, zoom: u8, column: i64, row: i64) -> Result<Option<Arc<GrayTile>>, StoreError> {
        let Some(id) = tile_at(zoom, column, row) else { return Ok(None) };
        self.ground.grays.get((self.index_of(layer), id), || {
            if zoom < layer.min_zoom {
                return self.overview(layer, id);
            }
            Ok(self.tile_to_match(layer, id)?.map(|t| (t.colour.to_gray(), t.mask)))
        })
    }

    /// Computes a tile coarser than the overviews of the store, from its four children.
    fn overview(&self, layer: &Layer, id: TileId) -> Result<Option<GrayTile>, StoreError> {
        let Some(children) = id.children() else { return Ok(None) };
        let side = 2 * SIZE_PX as usize;
        let mut joined = (Gray::filled(side, side, 0.0), Mask::filled(side, side, false));
        let mut empty = true;
        for (i, child) in children.into_iter().enumerate() {
            if let Some(tile) = self.gray(layer, child.zoom(), i64::from(child.column()), i64::from(child.row()))? {
                paste(&tile, [i as i64 % 2 * SIZE_PX, i as i64 / 2 * SIZE_PX], &mut joined);
                empty = false;
            }
        }
        Ok((!empty).then(|| joined.0.halved(&joined.1)))
    }

    fn index_of(&self, layer: &Layer) -> usize {
        self.layers().iter().position(|l| l.name == layer.name).unwrap_or(usize::MAX)
    }
}

/// Returns the tile of a column that may run past the antimeridian: `None` beyond the poles.
fn tile_at(zoom: u8, column: i64, row: i64) -> Option<TileId> {
    let matrix = 1i64 << zoom.min(MAX_ZOOM);
    let inside = (0..matrix).contains(&row);
    inside.then(|| TileId::new(zoom, column.rem_euclid(matrix) as u32, row as u32).ok()).flatten()
}

/// Copies the part of a tile that lies inside a window. `at` is the corner of the tile in the window.
fn paste(tile: &GrayTile, at: [i64; 2], window: &mut GrayTile) {
    let (gray, mask) = (&mut window.0, &mut window.1);
    let (width, height) = (gray.width_px() as i64, gray.height_px() as i64);
    let (x0, x1) = (at[0].max(0), (at[0] + SIZE_PX).min(width));
    if x0 >= x1 {
        return;
    }
    for y in at[1].max(0)..(at[1] + SIZE_PX).min(height) {
        let from = ((y - at[1]) * SIZE_PX + x0 - at[0]) as usize;
        let to = (y * width + x0) as usize;
        let count = (x1 - x0) as usize;
        gray.values_mut()[to..to + count].copy_from_slice(&tile.0.values()[from..from + count]);
        mask.values_mut()[to..to + count].copy_from_slice(&tile.1.values()[from..from + count]);
    }
}
