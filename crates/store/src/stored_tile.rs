//! Queries of a reader for tiles. Every tile has the content hash that its footprint states.

use super::cells::TileCells;
use super::digest::LevelOf;
use super::footprint::Footprint;
use super::footprint_rows;
use super::imagery::{self, EncodedTile};
use super::level::LevelDigests;
use super::{Layer, Reader, StoreError, TileContent, cells, digest};
use overfly_core::feature::CellMap;
use overfly_core::pixels::MaskedColour;
use overfly_core::tile::{MercatorBounds, TileId};
use rusqlite::{OptionalExtension, Row};
use serde::Serialize;
use std::sync::Arc;

/// A tile as stored.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredTile {
    /// Footprint.
    pub footprint: Footprint,
    /// Media type of the imagery.
    pub media_type: &'static str,
    /// Encoded imagery.
    pub image: Vec<u8>,
    /// Encoded keypoints: `None` for an overview.
    pub descriptors: Option<Vec<u8>>,
    /// Cells: `None` in a layer that was built before format version 3.
    pub cells: Option<Vec<u8>>,
}

impl StoredTile {
    /// Makes the stored form of a tile from its content.
    pub fn from_content(tile: TileId, made: TileContent) -> Self {
        Self {
            footprint: made.footprint(tile),
            media_type: made.image.media_type,
            image: made.image.bytes,
            descriptors: made.descriptors,
            cells: made.cells,
        }
    }
}

/// Sizes of stored tiles, bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct TileSizes {
    /// Imagery.
    pub imagery: u64,
    /// Keypoint descriptors.
    pub descriptors: u64,
    /// Cells of the wide search.
    pub cells: u64,
}

/// Footprint, imagery, descriptors and cells as read from the tables.
type Parts = (Footprint, Option<Vec<u8>>, Option<Vec<u8>>, Option<Vec<u8>>);

impl Reader {
    /// Returns a tile as stored: `None` if the layer has no such tile.
    ///
    /// # Errors
    /// Where the layer is unfinished, and [`StoreError::DamagedTile`] if the content does not have the hash that the footprint
    /// states. Onboard, [`Reader::damage`] reports such a tile.
    pub fn stored_tile(&self, layer: &Layer, tile: TileId) -> Result<Option<StoredTile>, StoreError> {
        self.require_complete(layer)?;
        if self.footprint_proof().is_some_and(|w| !w.knows(&layer.name, tile)) {
            return Ok(None);
        }
        let found = self.parts(layer, tile).and_then(|parts| self.check_tile(layer, tile, parts));
        found.map_err(|error| self.record_damage(layer, tile, error))
    }

    /// Returns the encoded imagery of a tile: `None` if the layer has no such tile.
    ///
    /// # Errors
    /// As [`Reader::stored_tile`].
    pub fn encoded_tile(&self, layer: &Layer, tile: TileId) -> Result<Option<EncodedTile>, StoreError> {
        let encoded = |t: StoredTile| EncodedTile {
            media_type: t.media_type,
            bytes: t.image,
            content_hash: t.footprint.content_hash,
        };
        Ok(self.stored_tile(layer, tile)?.map(encoded))
    }

    /// Returns the decoded pixels and mask of a tile: `None` if the layer has no such tile.
    ///
    /// # Errors
    /// As [`Reader::stored_tile`].
    pub fn tile(&self, layer: &Layer, tile: TileId) -> Result<Option<MaskedColour>, StoreError> {
        let Some(encoded) = self.encoded_tile(layer, tile)? else { return Ok(None) };
        let undecoded = |reason| self.record_damage(layer, tile, self.damaged(layer, tile, reason));
        imagery::decode(&encoded.bytes).map(Some).map_err(undecoded)
    }

    /// Returns the pixels of a tile for a search. Onboard, a damaged tile counts as absent, so that searches go on without it.
    ///
    /// # Errors
    /// As [`Reader::stored_tile`].
    pub(super) fn tile_to_match(&self, layer: &Layer, tile: TileId) -> Result<Option<MaskedColour>, StoreError> {
        match self.tile(layer, tile) {
            Err(StoreError::DamagedTile { .. }) if self.is_onboard() => Ok(None),
            other => other,
        }
    }

    /// Returns the descriptor blob of a tile (`feature::keypoint::from_blob`): `None` if the layer has no such tile, and for
    /// overviews, which are not described.
    ///
    /// # Errors
    /// As [`Reader::stored_tile`].
    pub fn descriptors(&self, layer: &Layer, tile: TileId) -> Result<Option<Vec<u8>>, StoreError> {
        Ok(self.stored_tile(layer, tile)?.and_then(|t| t.descriptors))
    }

    /// Sums the sizes of tiles. Tiles that the layer does not have count zero.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store is damaged.
    pub fn sizes(&self, layer: &Layer, tiles: impl Iterator<Item = TileId>) -> Result<TileSizes, StoreError> {
        self.require_complete(layer)?;
        let sql = format!("SELECT length(t.tile_data), length(d.descriptors), length(c.cells) {}", tables(&layer.name));
        let mut sizes = TileSizes::default();
        for tile in tiles {
            let key = (&layer.name, tile.zoom(), tile.row(), tile.column());
            let read = |row: &Row<'_>| Ok([row.get(0)?, row.get(1)?, row.get(2)?]);
            let row: Option<[Option<u32>; 3]> =
                self.with(|c| c.prepare_cached(&sql)?.query_row(key, read).optional())?;
            let [imagery, descriptors, cells] = row.unwrap_or_default().map(|n| u64::from(n.unwrap_or(0)));
            sizes.imagery += imagery;
            sizes.descriptors += descriptors;
            sizes.cells += cells;
        }
        Ok(sizes)
    }

    /// Returns the cells of one level, merged `pitch` by `pitch` (1, 2 or 3). The map is empty if the layer has no cells of that
    /// level. An LRU cache keeps the maps for the next frame. If an exported store states the digest of the cells, it is checked.
    ///
    /// This method reads the whole level, even beyond the limit of the cache: see [`Reader::cells_around`].
    ///
    /// # Errors
    /// Where the layer is unfinished or the store is damaged.
    pub fn cells(&self, layer: &Layer, zoom: u8, pitch: usize) -> Result<Arc<CellMap>, StoreError> {
        self.require_complete(layer)?;
        let key = (layer.name.clone(), zoom, pitch);
        if let Some(cached) = self.cells.get(&key) {
            return Ok(cached);
        }
        let map = if pitch == 1 {
            CellMap::from_tiles(self.proved_cells(layer, zoom)?)
        } else {
            self.cells(layer, zoom, 1)?.merged(pitch)
        };
        Ok(self.cells.insert(key, map))
    }

    /// Returns the cells of one level as [`Reader::cells`], if the whole level can be read within the limit of the cache. Otherwise
    /// returns the cells of the tiles that intersect `bounds`, without caching them: `None` if these are too many as well.
    ///
    /// # Errors
    /// As [`Reader::cells`].
    pub fn cells_around(
        &self,
        layer: &Layer,
        zoom: u8,
        pitch: usize,
        bounds: &MercatorBounds,
    ) -> Result<Option<Arc<CellMap>>, StoreError> {
        let most = if zoom == layer.base_zoom { layer.base_tiles } else { layer.tiles - layer.base_tiles };
        if self.cells.has_room_for(most as usize) {
            return self.cells(layer, zoom, pitch).map(Some);
        }
        let met = self.footprints_in(layer, zoom, bounds)?;
        if !self.cells.has_room_for(met.len()) {
            return Ok(None);
        }
        Ok(Some(Arc::new(CellMap::from_tiles(self.cells_of(layer, &met)?).merged(pitch))))
    }

    /// Reads the cells of a level from their table. If they do not have the stated digest, reads them tile by tile, and leaves out
    /// damaged tiles.
    fn proved_cells(&self, layer: &Layer, zoom: u8) -> Result<Vec<TileCells>, StoreError> {
        let read = self.with(|c| cells::load(c, &layer.name, zoom));
        let Some(stated) = self.stated_cells.get(&(layer.name.clone(), zoom)) else { return read };
        if let Ok(cells) = read
            && digest::cells_digest(&cells) == *stated
        {
            return Ok(cells);
        }
        self.cells_of(layer, &self.footprints(layer, zoom)?)
    }

    /// Reads the cells of tiles one by one. Onboard, leaves out damaged tiles.
    fn cells_of(&self, layer: &Layer, footprints: &[Footprint]) -> Result<Vec<TileCells>, StoreError> {
        let mut cells = Vec::new();
        for footprint in footprints {
            let tile = footprint.tile;
            match self.stored_tile(layer, tile) {
                Ok(found) => {
                    cells.extend(found.and_then(|t| t.cells).map(|blob| ([tile.column(), tile.row()], blob)));
                }
                Err(StoreError::DamagedTile { .. }) if self.is_onboard() => {}
                Err(other) => return Err(other),
            }
        }
        Ok(cells)
    }

    /// Computes the digests of one level.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store is damaged.
    pub fn level_digests(&self, layer: &Layer, zoom: u8) -> Result<LevelDigests, StoreError> {
        let footprints = self.footprints(layer, zoom)?;
        let cells = self.with(|c| cells::load(c, &layer.name, zoom))?;
        let level = LevelOf { layer: &layer.name, zoom, version: self.format_version() };
        Ok(LevelDigests::from_rows(&level, &footprints, &cells))
    }

    fn parts(&self, layer: &Layer, tile: TileId) -> Result<Option<Parts>, StoreError> {
        let sql = format!(
            "SELECT {}, t.tile_data, d.descriptors, c.cells {}",
            footprint_rows::columns(self.format_version()),
            tables(&layer.name)
        );
        let key = (&layer.name, tile.zoom(), tile.row(), tile.column());
        let read = |row: &Row<'_>| {
            let after = |n: usize| row.get(footprint_rows::COLUMN_COUNT + n);
            Ok((footprint_rows::read(row)?, after(0)?, after(1)?, after(2)?))
        };
        self.with(|c| c.prepare_cached(&sql)?.query_row(key, read).optional())
    }

    fn check_tile(&self, layer: &Layer, tile: TileId, parts: Option<Parts>) -> Result<Option<StoredTile>, StoreError> {
        let damaged = |reason: &str| self.damaged(layer, tile, reason.into());
        let Some((footprint, image, descriptors, cells)) = parts else {
            let proved = self.footprint_proof().is_some();
            return if proved { Err(damaged("its footprint is missing")) } else { Ok(None) };
        };
        if self.footprint_proof().is_some_and(|w| !w.agrees(&layer.name, &footprint)) {
            return Err(damaged("its footprint has changed since the store was opened"));
        }
        let Some(image) = image else { return Err(damaged("its imagery is missing")) };
        let Some(media_type) = imagery::media_type(&image) else {
            return Err(damaged("its imagery is neither JPEG nor PNG"));
        };
        let described = descriptors.as_deref().unwrap_or_default();
        if digest::content_hash(media_type, &image, described, cells.as_deref()) != footprint.content_hash {
            return Err(damaged("imagery, descriptors or cells do not have the hash that the footprint states"));
        }
        Ok(Some(StoredTile { footprint, media_type, image, descriptors, cells }))
    }

    /// Onboard, turns any damage of the file or the disk into damage of this tile, and records it.
    fn record_damage(&self, layer: &Layer, tile: TileId, error: StoreError) -> StoreError {
        if !self.is_onboard() {
            return error;
        }
        let error = match error {
            StoreError::Damaged { reason, .. } => self.damaged(layer, tile, reason),
            StoreError::DiskError { reason, .. } => self.damaged(layer, tile, reason),
            other => other,
        };
        if let StoreError::DamagedTile { reason, .. } = &error {
            self.damage.record(&layer.name, tile, reason);
        }
        error
    }
}

/// The tables of a tile, joined, keyed by layer, zoom, row and column. The name of the layer must be checked.
fn tables(layer: &str) -> String {
    format!(
        "FROM footprints f
         LEFT JOIN \"{layer}\" t ON t.zoom_level = f.zoom AND t.tile_column = f.tile_column AND t.tile_row = f.tile_row
         LEFT JOIN overfly_descriptors d ON d.footprint = f.fid
         LEFT JOIN overfly_cells c ON c.footprint = f.fid
         WHERE f.layer = ?1 AND f.zoom = ?2 AND f.tile_row = ?3 AND f.tile_column = ?4"
    )
}
