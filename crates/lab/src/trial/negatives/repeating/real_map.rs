//! `RealMap`: the imagery of a layer, or of a part of it, as one gray image.

use overfly_core::geodesy::{GeodesyError, Geodetic, LocalFrame};
use overfly_core::pixels::{Gray, Mask};
use overfly_core::tile::{TILE_SIZE_PX, TileId, WorldPixel};
use overfly_store::{Layer, Reader, StoreError};

/// The most pixels of a map that is used whole.
const WHOLE_PX: u64 = 4_000_000;
/// Edge of the part of a larger map, pixels.
const PART_EDGE_PX: u64 = 2048;

/// Imagery of a layer at its base zoom.
#[derive(Debug, Clone)]
pub struct RealMap {
    /// The base zoom.
    pub zoom: u8,
    /// The upper-left corner, pixels of the world's grid.
    pub corner_px: [u64; 2],
    /// Brightness.
    pub gray: Gray,
    /// Pixels with imagery.
    pub mask: Mask,
}

impl RealMap {
    /// Reads a small layer as a whole, and of a larger one a square around a point; `None` if the layer is empty.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn read(store: &Reader, layer: &Layer, around: Geodetic) -> Result<Option<Self>, StoreError> {
        let zoom = layer.base_zoom;
        let tiles: Vec<TileId> = store.footprints(layer, zoom)?.into_iter().map(|f| f.tile).collect();
        let Some(whole) = bounds(&tiles) else { return Ok(None) };
        let Ok(at) = WorldPixel::from_geodetic(around, zoom) else { return Ok(None) };
        let [x, y] = window(whole, [at.x_px, at.y_px]);
        let (width, height) = ((x[1] - x[0]) as usize, (y[1] - y[0]) as usize);
        let (mut gray, mut mask) = (Gray::filled(width, height, 0.0), Mask::filled(width, height, false));
        for tile in tiles {
            let edge = u64::from(TILE_SIZE_PX);
            let (left, top) = (u64::from(tile.column()) * edge, u64::from(tile.row()) * edge);
            let (columns, rows) = (left.max(x[0])..(left + edge).min(x[1]), top.max(y[0])..(top + edge).min(y[1]));
            if columns.is_empty() || rows.is_empty() {
                continue;
            }
            let Some(pixels) = store.tile(layer, tile)? else { continue };
            let brightness = pixels.colour.to_gray();
            for row in rows {
                for column in columns.clone() {
                    let (u, v) = ((column - left) as usize, (row - top) as usize);
                    if pixels.mask.at(u, v) {
                        let (i, j) = ((column - x[0]) as usize, (row - y[0]) as usize);
                        gray.values_mut()[j * width + i] = brightness.at(u, v);
                        mask.set(i, j, true);
                    }
                }
            }
        }
        Ok(Some(Self { zoom, corner_px: [x[0], y[0]], gray, mask }))
    }

    /// The local frame at the middle of the map.
    ///
    /// # Errors
    /// [`GeodesyError`] for a map outside the world.
    pub fn frame(&self) -> Result<LocalFrame, GeodesyError> {
        let middle = [self.gray.width_px() as f64 / 2.0, self.gray.height_px() as f64 / 2.0];
        Ok(LocalFrame::at(self.geodetic_from_map(middle)?))
    }

    /// The point at a position, pixels from the map's upper-left corner.
    ///
    /// # Errors
    /// [`GeodesyError`] for a position outside the world.
    pub fn geodetic_from_map(&self, [x, y]: [f64; 2]) -> Result<Geodetic, GeodesyError> {
        WorldPixel { x_px: self.corner_px[0] as f64 + x, y_px: self.corner_px[1] as f64 + y }.to_geodetic(self.zoom)
    }

    /// Whether there is imagery at a point.
    pub fn holds(&self, point: Geodetic) -> bool {
        let Ok(at) = WorldPixel::from_geodetic(point, self.zoom) else { return false };
        let (x, y) = (at.x_px - self.corner_px[0] as f64, at.y_px - self.corner_px[1] as f64);
        let is_inside = |v: f64, n: usize| (0.0..n as f64).contains(&v);
        is_inside(x, self.mask.width_px())
            && is_inside(y, self.mask.height_px())
            && self.mask.at(x as usize, y as usize)
    }
}

/// The pixels that tiles cover: first and end of columns and rows.
fn bounds(tiles: &[TileId]) -> Option<[[u64; 2]; 2]> {
    let edge = u64::from(TILE_SIZE_PX);
    let range = |of: fn(&TileId) -> u32| {
        let (first, last) = (tiles.iter().map(of).min()?, tiles.iter().map(of).max()?);
        Some([u64::from(first) * edge, (u64::from(last) + 1) * edge])
    };
    Some([range(|t| t.column())?, range(|t| t.row())?])
}

/// The whole, or the part of it nearest to a square around a point.
fn window(whole: [[u64; 2]; 2], at_px: [f64; 2]) -> [[u64; 2]; 2] {
    let length = |axis: [u64; 2]| axis[1] - axis[0];
    if length(whole[0]) * length(whole[1]) <= WHOLE_PX {
        return whole;
    }
    std::array::from_fn(|k| {
        let [first, end] = whole[k];
        let edge = PART_EDGE_PX.min(end - first);
        let from = ((at_px[k].max(0.0) as u64).saturating_sub(edge / 2)).clamp(first, end - edge);
        [from, from + edge]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_map_is_used_around_the_point_and_inside_its_bounds() {
        assert_eq!(window([[512, 1536], [0, 1024]], [600.0, 5.0]), [[512, 1536], [0, 1024]]);
        let large = [[0, 51_200], [5120, 10_240]];
        assert_eq!(window(large, [20_000.0, 5200.0]), [[18_976, 21_024], [5120, 7168]]);
        assert_eq!(window(large, [51_199.0, 10_239.0]), [[49_152, 51_200], [8192, 10_240]]);
    }
}
