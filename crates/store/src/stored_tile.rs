//! What a reader gives of one tile: nothing whose content hash was not proved.

use super::cells::TileCells;
use super::footprint::{self, Footprint};
use super::imagery::{self, EncodedTile};
use super::level::LevelDigests;
use super::{Layer, Reader, StoreError, TileContent, cells, digest};
use overfly_core::feature::CellMap;
use overfly_core::pixels::MaskedColour;
use overfly_core::tile::{MercatorBounds, TileId};
use rusqlite::{OptionalExtension, Row};
use serde::Serialize;
use std::sync::Arc;

/// All that is stored of a tile, its content hash proved.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredTile {
    /// Its row.
    pub footprint: Footprint,
    /// Its imagery's media type.
    pub media_type: &'static str,
    /// Its imagery, encoded.
    pub image: Vec<u8>,
    /// Its keypoints, encoded; `None` for an overview.
    pub descriptors: Option<Vec<u8>>,
    /// Its cells; `None` in a layer built before there were cells.
    pub cells: Option<Vec<u8>>,
}

impl StoredTile {
    /// A tile as it was made.
    pub fn of(tile: TileId, made: TileContent) -> Self {
        Self {
            footprint: made.footprint(tile),
            media_type: made.image.media_type,
            image: made.image.bytes,
            descriptors: made.descriptors,
            cells: Some(made.cells),
        }
    }
}

/// Bytes that tiles take, by what they are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, utoipa::ToSchema)]
pub struct TileSizes {
    /// Imagery.
    pub imagery: u64,
    /// Keypoint descriptors.
    pub descriptors: u64,
    /// Cells of the wide search.
    pub cells: u64,
}

/// Footprint, imagery, descriptors and cells as they stand in the tables.
type Parts = (Footprint, Option<Vec<u8>>, Option<Vec<u8>>, Option<Vec<u8>>);

impl Reader {
    /// All that is stored of a tile, or `None` where the layer has no such tile.
    ///
    /// # Errors
    /// Where the layer is unfinished, or [`StoreError::DamagedTile`]: its content does not have the hash that its footprint
    /// states. Onboard such a tile is noted ([`Reader::damage`]).
    pub fn stored_tile(&self, layer: &Layer, tile: TileId) -> Result<Option<StoredTile>, StoreError> {
        self.require_complete(layer)?;
        if self.witness().is_some_and(|w| !w.knows(&layer.name, tile)) {
            return Ok(None);
        }
        let found = self.parts(layer, tile).and_then(|parts| self.proved(layer, tile, parts));
        found.map_err(|error| self.noted(layer, tile, error))
    }

    /// A tile's imagery as stored, or `None` where the layer has no such tile.
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

    /// A tile's pixels and mask, decoded.
    ///
    /// # Errors
    /// As [`Reader::stored_tile`].
    pub fn tile(&self, layer: &Layer, tile: TileId) -> Result<Option<MaskedColour>, StoreError> {
        let Some(encoded) = self.encoded_tile(layer, tile)? else { return Ok(None) };
        let undecoded = |reason| self.noted(layer, tile, self.damaged(layer, tile, reason));
        imagery::decode(&encoded.bytes).map(Some).map_err(undecoded)
    }

    /// A tile's pixels for a search. Onboard a damaged tile is none: searches go on over the rest.
    ///
    /// # Errors
    /// As [`Reader::stored_tile`].
    pub(super) fn tile_to_match(&self, layer: &Layer, tile: TileId) -> Result<Option<MaskedColour>, StoreError> {
        match self.tile(layer, tile) {
            Err(StoreError::DamagedTile { .. }) if self.is_onboard() => Ok(None),
            other => other,
        }
    }

    /// A tile's descriptor blob (`feature::keypoint::from_blob`); `None` where there is no such tile or it has none
    /// (overviews are not described).
    ///
    /// # Errors
    /// As [`Reader::stored_tile`].
    pub fn descriptors(&self, layer: &Layer, tile: TileId) -> Result<Option<Vec<u8>>, StoreError> {
        Ok(self.stored_tile(layer, tile)?.and_then(|t| t.descriptors))
    }

    /// Bytes that tiles take; those that the layer does not have take none.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store damaged.
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

    /// The cells of one level, merged `pitch` by `pitch` (1, 2 or 3); without blocks where the layer has none of that
    /// level or was built before there were cells. Kept, so that the next frame finds them in memory, within a bound:
    /// the longest unused go first. Where an exported store states their digest, they are held against it.
    /// See [`Reader::cells_around`] for what stays within the bound while it is worked out, too.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store damaged.
    pub fn cells(&self, layer: &Layer, zoom: u8, pitch: usize) -> Result<Arc<CellMap>, StoreError> {
        self.require_complete(layer)?;
        let key = (layer.name.clone(), zoom, pitch);
        if let Some(kept) = self.cells.get(&key) {
            return Ok(kept);
        }
        let map = if pitch == 1 {
            CellMap::of_tiles(self.proved_cells(layer, zoom)?)
        } else {
            self.cells(layer, zoom, 1)?.merged(pitch)
        };
        Ok(self.cells.keep(key, map))
    }

    /// As [`Reader::cells`] where the level is small enough to be read within the bound; else of those of its tiles alone that
    /// meet `bounds`, and not kept; `None` where even these are too many.
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
        Ok(Some(Arc::new(CellMap::of_tiles(self.cells_of(layer, &met)?).merged(pitch))))
    }

    /// The cells of a level as they stand in their table, where they have the stated digest; else those of the tiles whose
    /// content hash is right, one by one.
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

    /// The cells of those tiles whose content hash is right.
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

    /// What the footprints and cells of a level hash to.
    ///
    /// # Errors
    /// Where the layer is unfinished or the store damaged.
    pub fn level_digests(&self, layer: &Layer, zoom: u8) -> Result<LevelDigests, StoreError> {
        let footprints = self.footprints(layer, zoom)?;
        let cells = self.with(|c| cells::load(c, &layer.name, zoom))?;
        Ok(LevelDigests::of(zoom, &footprints, &cells))
    }

    fn parts(&self, layer: &Layer, tile: TileId) -> Result<Option<Parts>, StoreError> {
        let sql = format!("SELECT {}, t.tile_data, d.descriptors, c.cells {}", footprint::COLUMNS, tables(&layer.name));
        let key = (&layer.name, tile.zoom(), tile.row(), tile.column());
        let read = |row: &Row<'_>| Ok((footprint::read(row)?, row.get(10)?, row.get(11)?, row.get(12)?));
        self.with(|c| c.prepare_cached(&sql)?.query_row(key, read).optional())
    }

    fn proved(&self, layer: &Layer, tile: TileId, parts: Option<Parts>) -> Result<Option<StoredTile>, StoreError> {
        let damaged = |reason: &str| self.damaged(layer, tile, reason.into());
        let Some((footprint, image, descriptors, cells)) = parts else {
            let lost = self.witness().is_some();
            return if lost { Err(damaged("its footprint cannot be found any more")) } else { Ok(None) };
        };
        if self.witness().is_some_and(|w| !w.agrees(&layer.name, &footprint)) {
            return Err(damaged("its footprint is not what it was when the store was opened"));
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

    /// Onboard, whatever is wrong with a tile's pages is wrong with that tile, and is noted.
    fn noted(&self, layer: &Layer, tile: TileId, error: StoreError) -> StoreError {
        if !self.is_onboard() {
            return error;
        }
        let error = match error {
            StoreError::Damaged { reason, .. } => self.damaged(layer, tile, reason),
            StoreError::DiskError { reason, .. } => self.damaged(layer, tile, reason),
            other => other,
        };
        if let StoreError::DamagedTile { reason, .. } = &error {
            self.damage.note(&layer.name, tile, reason);
        }
        error
    }
}

/// A tile of a checked layer's name in all its tables, keyed by layer, zoom, row and column.
fn tables(layer: &str) -> String {
    format!(
        "FROM footprints f
         LEFT JOIN \"{layer}\" t ON t.zoom_level = f.zoom AND t.tile_column = f.tile_column AND t.tile_row = f.tile_row
         LEFT JOIN overfly_descriptors d ON d.footprint = f.fid
         LEFT JOIN overfly_cells c ON c.footprint = f.fid
         WHERE f.layer = ?1 AND f.zoom = ?2 AND f.tile_row = ?3 AND f.tile_column = ?4"
    )
}
