//! `MapPicture`: the colours of the map in a window of a level.

use overfly_core::pixels::Colour;
use overfly_core::tile::{TILE_SIZE_PX, TileId};
use overfly_flight::locate::PixelWindow;
use overfly_store::{Layer, Reader, StoreError};

/// Map drawn beyond a window on every side, pixels.
const MARGIN_PX: usize = 16;
/// Gray level where there is no map.
const NO_MAP: u8 = 128;

/// A window of the map in colour, with a margin.
pub struct MapPicture {
    /// The pixels; gray where there is no map.
    pub colour: Colour,
    /// World pixel of the upper-left corner.
    pub corner: [i64; 2],
}

impl MapPicture {
    /// Reads the tiles of a window and a margin around.
    ///
    /// # Errors
    /// Where a tile cannot be read.
    pub fn read(store: &Reader, layer: &Layer, window: PixelWindow) -> Result<Self, StoreError> {
        let size = [window.width_px, window.height_px].map(|n| n + 2 * MARGIN_PX);
        let corner = [window.left, window.top].map(|v| v - MARGIN_PX as i64);
        let mut colour = Colour::black(size[0], size[1]);
        colour.values_mut().fill(NO_MAP);
        let edge = i64::from(TILE_SIZE_PX);
        let tiles =
            |axis: usize| corner[axis].div_euclid(edge)..=(corner[axis] + size[axis] as i64 - 1).div_euclid(edge);
        for (row, column) in tiles(1).flat_map(|r| tiles(0).map(move |c| (r, c))) {
            let id = u32::try_from(column).ok().zip(u32::try_from(row).ok());
            let Some(Ok(id)) = id.map(|(c, r)| TileId::new(window.zoom, c, r)) else { continue };
            let Some(tile) = store.tile(layer, id)? else { continue };
            let inside = |from: i64, axis: usize| {
                (from.max(corner[axis]) - corner[axis]) as usize
                    ..((from + edge).min(corner[axis] + size[axis] as i64) - corner[axis]).max(0) as usize
            };
            for y in inside(row * edge, 1) {
                for x in inside(column * edge, 0) {
                    let tx = (x as i64 + corner[0] - column * edge) as usize;
                    let ty = (y as i64 + corner[1] - row * edge) as usize;
                    if tile.mask.at(tx, ty) {
                        colour.set(x, y, tile.colour.at(tx, ty));
                    }
                }
            }
        }
        Ok(Self { colour, corner })
    }
}
