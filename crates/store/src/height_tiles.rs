//! Queries of a reader for the terrain: heights are decoded tile by tile, and cached.

use super::terrain::Terrain;
use super::{Layer, Reader, StoreError, heights};
use overfly_core::tile::{HeightGrid, MAX_ZOOM, TILE_SIZE_PX, TileId};
use std::sync::Arc;

impl Reader {
    /// The finished layers of imagery by name: in these frames are located.
    pub fn imagery_layers(&self) -> impl Iterator<Item = &Layer> {
        self.finished_layers().filter(|l| l.terrain.is_none())
    }

    /// As [`Reader::layer`], for a layer of imagery.
    ///
    /// # Errors
    /// As [`Reader::layer`], and [`StoreError::Heights`].
    pub fn imagery_layer(&self, name: &str) -> Result<&Layer, StoreError> {
        let layer = self.layer(name)?;
        if layer.terrain.is_some() {
            return Err(StoreError::Heights { path: self.path().into(), name: name.into() });
        }
        Ok(layer)
    }

    /// The layer of heights, where the store has a finished one.
    pub fn terrain(&self) -> Option<(&Layer, &Terrain)> {
        self.finished_layers().find_map(|layer| layer.terrain.as_ref().map(|terrain| (layer, terrain)))
    }

    /// The heights of a window of a layer of heights, at its base zoom or a coarser one, where each is the mean of those that it covers;
    /// unknown where it has none. Columns may run past the antimeridian. Onboard, a damaged tile counts as unknown. Memory is that of the
    /// window and one tile.
    ///
    /// # Errors
    /// Where the layer is unfinished or a tile is damaged.
    pub fn heights(
        &self,
        layer: &Layer,
        zoom: u8,
        corner_px: [i64; 2],
        size_px: [usize; 2],
    ) -> Result<HeightGrid, StoreError> {
        let mut window = HeightGrid::unknown(zoom, corner_px, size_px);
        let coarser_by = layer.base_zoom.saturating_sub(zoom);
        let size = i64::from(TILE_SIZE_PX) >> coarser_by;
        if zoom > layer.base_zoom || size == 0 {
            return Ok(window);
        }
        let tiles = |axis: usize| {
            corner_px[axis].div_euclid(size)..=(corner_px[axis] + size_px[axis] as i64 - 1).div_euclid(size)
        };
        let matrix = 1i64 << layer.base_zoom.min(MAX_ZOOM);
        for row in tiles(1).filter(|row| (0..matrix).contains(row)) {
            for column in tiles(0) {
                let Ok(tile) = TileId::new(layer.base_zoom, column.rem_euclid(matrix) as u32, row as u32) else {
                    continue;
                };
                if let Some(known) = self.height_tile(layer, tile, coarser_by)? {
                    let copies = (column - i64::from(tile.column())) * size;
                    window.paste_shifted(&known, copies);
                }
            }
        }
        Ok(window)
    }

    fn height_tile(&self, layer: &Layer, tile: TileId, coarser_by: u8) -> Result<Option<Arc<HeightGrid>>, StoreError> {
        self.ground.heights.get((coarser_by.into(), tile), || {
            let encoded = match self.encoded_tile(layer, tile) {
                Err(StoreError::DamagedTile { .. }) if self.is_onboard() => None,
                other => other?,
            };
            let Some(encoded) = encoded else { return Ok(None) };
            let known = heights::decode(tile, &encoded.bytes).map_err(|reason| self.damaged(layer, tile, reason))?;
            Ok(Some(if coarser_by == 0 { known } else { known.shrunk(coarser_by) }))
        })
    }
}
