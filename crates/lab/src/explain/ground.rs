//! `Ground`: the map under a view.

use overfly_core::feature::Structure;
use overfly_core::pixels::{Colour, Mask};
use overfly_core::tile::{TILE_SIZE_PX, TileId};
use overfly_store::{Layer, Reader, StoreError};

/// A window of a level.
pub struct Ground {
    /// World pixel of its upper-left corner.
    pub corner: [i64; 2],
    /// Gray where there is no map.
    pub colour: Colour,
    /// What is compared of it.
    pub structure: Structure,
}

impl Ground {
    /// Columns and rows `size` from `corner` on.
    pub fn of(store: &Reader, layer: &Layer, zoom: u8, corner: [i64; 2], size: [usize; 2]) -> Result<Self, StoreError> {
        let mut colour = Colour::black(size[0], size[1]);
        colour.values_mut().fill(128);
        let mut mask = Mask::filled(size[0], size[1], false);
        let edge = i64::from(TILE_SIZE_PX);
        let tiles =
            |axis: usize| corner[axis].div_euclid(edge)..=(corner[axis] + size[axis] as i64 - 1).div_euclid(edge);
        for (row, column) in tiles(1).flat_map(|r| tiles(0).map(move |c| (r, c))) {
            let id = u32::try_from(column).ok().zip(u32::try_from(row).ok());
            let Some(Ok(id)) = id.map(|(c, r)| TileId::new(zoom, c, r)) else { continue };
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
                        mask.set(x, y, true);
                    }
                }
            }
        }
        let structure = Structure::new(&colour.to_gray(), &mask);
        Ok(Self { corner, colour, structure })
    }
}
