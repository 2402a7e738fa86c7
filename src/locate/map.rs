//! `Map`: a layer of a store as one seamless gray image at any of its levels.

use crate::pixels::{Gray, Mask};
use crate::store::{Layer, Reader, StoreError};
use crate::tile::{MAX_ZOOM, TILE_SIZE_PX, TileId};
use std::collections::HashMap;
use std::sync::Arc;

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

type GrayTile = Arc<(Gray, Mask)>;

/// Decoded tiles kept, oldest dropped first: 64 tiles are 84 MB.
const TILES_KEPT: usize = 64;

/// A layer to look at. Keeps the tiles that it decoded last.
pub struct Map<'a> {
    store: &'a Reader,
    layer: &'a Layer,
    tiles: HashMap<TileId, (u64, Option<GrayTile>)>,
    clock: u64,
}

impl<'a> Map<'a> {
    /// The layer of a store.
    pub fn new(store: &'a Reader, layer: &'a Layer) -> Self {
        Self { store, layer, tiles: HashMap::new(), clock: 0 }
    }

    /// Brightness and validity of a window; where there is no tile, or beyond the poles, masked.
    ///
    /// # Errors
    /// Where the store cannot give a tile.
    pub fn window(&mut self, window: &PixelWindow) -> Result<(Gray, Mask), StoreError> {
        let (width, height) = (window.width_px, window.height_px);
        let mut gray = Gray::filled(width, height, 0.0);
        let mut mask = Mask::filled(width, height, false);
        let size = i64::from(TILE_SIZE_PX);
        let columns = window.left.div_euclid(size)..=(window.left + width as i64 - 1).div_euclid(size);
        let rows = window.top.div_euclid(size)..=(window.top + height as i64 - 1).div_euclid(size);
        for row in rows {
            for column in columns.clone() {
                if let Some(tile) = self.tile(window.zoom, column, row)? {
                    paste(&tile, [column * size - window.left, row * size - window.top], &mut gray, &mut mask);
                }
            }
        }
        Ok((gray, mask))
    }

    fn tile(&mut self, zoom: u8, column: i64, row: i64) -> Result<Option<GrayTile>, StoreError> {
        let matrix = 1i64 << zoom.min(MAX_ZOOM);
        if !(0..matrix).contains(&row) {
            return Ok(None);
        }
        let Ok(id) = TileId::new(zoom, column.rem_euclid(matrix) as u32, row as u32) else { return Ok(None) };
        self.clock += 1;
        if let Some((used, tile)) = self.tiles.get_mut(&id) {
            *used = self.clock;
            return Ok(tile.clone());
        }
        let tile = if zoom < self.layer.min_zoom {
            self.overview(id)?
        } else {
            self.store.tile(self.layer, id)?.map(|t| Arc::new((t.colour.to_gray(), t.mask)))
        };
        if self.tiles.len() >= TILES_KEPT {
            let oldest = self.tiles.iter().min_by_key(|(_, (used, _))| *used).map(|(id, _)| *id);
            oldest.map(|id| self.tiles.remove(&id));
        }
        self.tiles.insert(id, (self.clock, tile.clone()));
        Ok(tile)
    }
}

impl Map<'_> {
    /// A tile coarser than the store's overviews, from its four children.
    fn overview(&mut self, id: TileId) -> Result<Option<GrayTile>, StoreError> {
        let Some(children) = id.children() else { return Ok(None) };
        let side = TILE_SIZE_PX as usize;
        let mut joined = (Gray::filled(2 * side, 2 * side, 0.0), Mask::filled(2 * side, 2 * side, false));
        let mut empty = true;
        for (i, child) in children.into_iter().enumerate() {
            if let Some(tile) = self.tile(child.zoom(), i64::from(child.column()), i64::from(child.row()))? {
                let at = [(i % 2 * side) as i64, (i / 2 * side) as i64];
                paste(&tile, at, &mut joined.0, &mut joined.1);
                empty = false;
            }
        }
        Ok((!empty).then(|| Arc::new(joined.0.halved(&joined.1))))
    }
}

/// Copies what of a tile falls into the window, its corner at `at` in the window.
fn paste(tile: &GrayTile, at: [i64; 2], gray: &mut Gray, mask: &mut Mask) {
    let (source, valid) = (&tile.0, &tile.1);
    let size = i64::from(TILE_SIZE_PX);
    let (width, height) = (gray.width_px() as i64, gray.height_px() as i64);
    let (x0, x1) = (at[0].max(0), (at[0] + size).min(width));
    if x0 >= x1 {
        return;
    }
    for y in at[1].max(0)..(at[1] + size).min(height) {
        let from = ((y - at[1]) * size + x0 - at[0]) as usize;
        let to = (y * width + x0) as usize;
        let count = (x1 - x0) as usize;
        gray.values_mut()[to..to + count].copy_from_slice(&source.values()[from..from + count]);
        mask.values_mut()[to..to + count].copy_from_slice(&valid.values()[from..from + count]);
    }
}
