//! What a build hands over of one tile.

use super::footprint::Footprint;
use super::imagery::{self, EncodedTile};
use super::source::Source;
use super::{StoreError, digest};
use overfly_core::feature::cells_of;
use overfly_core::feature::keypoint::{self, Keypoints};
use overfly_core::pixels::MaskedColour;
use overfly_core::tile::TileId;
use rusqlite::{Connection, OptionalExtension, Row, params};
use std::path::Path;

/// What a tile with pixels holds.
#[derive(Debug, Clone, PartialEq)]
pub struct TileContent {
    /// Its imagery, encoded.
    pub image: EncodedTile,
    /// Its keypoints, encoded; `None` for an overview.
    pub descriptors: Option<Vec<u8>>,
    /// Its cells (`feature::cells_of`) as bytes.
    pub cells: Vec<u8>,
    /// Content hashes of the sources seen in it, hexadecimal, newest first, separated by spaces.
    pub sources: String,
    /// Newest acquisition date seen in it.
    pub acquired: Option<String>,
    /// Share of valid pixels.
    pub valid_fraction: f64,
    /// The largest horizontal error of the sources seen in it, metres.
    pub horizontal_error_m: f64,
    /// Keypoints described.
    pub keypoints: u32,
    /// See `feature::keypoint::distinctiveness`.
    pub distinctiveness: f64,
}

impl TileContent {
    /// Encodes a tile and hashes its content; `seen` are the sources seen in it, in covering order.
    ///
    /// # Errors
    /// Where the encoder refuses.
    pub fn encode(
        tile: TileId,
        pixels: &MaskedColour,
        seen: &[&Source],
        keypoints: Option<&Keypoints>,
    ) -> Result<Self, StoreError> {
        let (media_type, bytes) = imagery::encode(tile, pixels)?;
        let descriptors = keypoints.map(keypoint::to_blob);
        let cells = cells_blob(pixels);
        let described = descriptors.as_deref().unwrap_or_default();
        let content_hash = digest::content_hash(media_type, &bytes, described, Some(&cells));
        let hashes: Vec<_> = seen.iter().map(|s| digest::hex(&s.content_hash)).collect();
        Ok(Self {
            image: EncodedTile { media_type, bytes, content_hash },
            descriptors,
            cells,
            sources: hashes.join(" "),
            acquired: seen.iter().filter_map(|s| s.acquired.clone()).max(),
            valid_fraction: pixels.mask.valid_fraction(),
            horizontal_error_m: seen.iter().map(|s| s.horizontal_error_m).fold(0.0, f64::max),
            keypoints: keypoints.map_or(0, |k| k.points.len() as u32),
            distinctiveness: keypoints.map_or(0.0, keypoint::distinctiveness),
        })
    }

    /// The row that says all this of a tile.
    pub(super) fn footprint(&self, tile: TileId) -> Footprint {
        Footprint {
            tile,
            content_hash: self.image.content_hash,
            acquired: self.acquired.clone(),
            valid_fraction: self.valid_fraction,
            horizontal_error_m: self.horizontal_error_m,
            keypoints: self.keypoints,
            distinctiveness: self.distinctiveness,
            sources: self.sources.clone(),
        }
    }
}

/// A tile's cells as they are stored.
pub fn cells_blob(pixels: &MaskedColour) -> Vec<u8> {
    cells_of(&pixels.colour.to_gray(), &pixels.mask).into_iter().map(|v| v as u8).collect()
}

/// What an overview needs to know of a tile below it.
#[derive(Debug, Clone, PartialEq)]
pub struct Child {
    /// Its imagery's bytes.
    pub image: Vec<u8>,
    /// As [`TileContent::sources`].
    pub sources: String,
    /// As [`TileContent::acquired`].
    pub acquired: Option<String>,
    /// As [`TileContent::horizontal_error_m`].
    pub horizontal_error_m: f64,
}

/// What stands in the store of a tile below an overview.
pub(super) enum Below {
    /// A tile without a valid pixel.
    Empty,
    /// A tile that does not have the hash that its row states. An overview of it would be wrong, and its own hash right.
    Damaged,
    /// A tile, its hash proved.
    Proved(Child),
}

impl Below {
    /// The child; none of an empty tile.
    ///
    /// # Errors
    /// [`StoreError::DamagedTile`].
    pub fn proved(self, path: &Path, layer: &str, tile: TileId) -> Result<Option<Child>, StoreError> {
        match self {
            Self::Empty => Ok(None),
            Self::Proved(child) => Ok(Some(child)),
            Self::Damaged => Err(damaged(path, layer, tile)),
        }
    }
}

/// The failure of a tile that does not have the hash that is stated.
pub(super) fn damaged(path: &Path, layer: &str, tile: TileId) -> StoreError {
    let reason = "imagery, descriptors or cells do not have the hash that is stated".into();
    StoreError::DamagedTile { path: path.into(), layer: layer.into(), tile, reason }
}

/// A staged tile; `None` where it is not staged.
pub(super) fn staged_child(connection: &Connection, layer: &str, tile: TileId) -> rusqlite::Result<Option<Below>> {
    let sql = "SELECT tile_data, sources, acquired, horizontal_error_m, content_hash, descriptors, cells
               FROM overfly_staged WHERE layer = ?1 AND zoom = ?2 AND tile_row = ?3 AND tile_column = ?4";
    below(connection, sql, layer, tile)
}

/// A tile in its place; `None` where there is none.
pub(super) fn placed_child(connection: &Connection, layer: &str, tile: TileId) -> rusqlite::Result<Option<Below>> {
    let sql = format!(
        "SELECT t.tile_data, f.sources, f.acquired, f.horizontal_error_m, f.content_hash, d.descriptors, c.cells
         FROM \"{layer}\" t
         JOIN footprints f ON f.layer = ?1 AND f.zoom = ?2 AND f.tile_row = ?3 AND f.tile_column = ?4
         LEFT JOIN overfly_descriptors d ON d.footprint = f.fid
         LEFT JOIN overfly_cells c ON c.footprint = f.fid
         WHERE t.zoom_level = ?2 AND t.tile_row = ?3 AND t.tile_column = ?4"
    );
    below(connection, &sql, layer, tile)
}

fn below(connection: &Connection, sql: &str, layer: &str, tile: TileId) -> rusqlite::Result<Option<Below>> {
    let key = params![layer, tile.zoom(), tile.row(), tile.column()];
    let read = |row: &Row<'_>| {
        let image: Option<Vec<u8>> = row.get(0)?;
        let Some(image) = image else { return Ok(Below::Empty) };
        let stated: [u8; 32] = row.get(4)?;
        let (descriptors, cells): (Option<Vec<u8>>, Option<Vec<u8>>) = (row.get(5)?, row.get(6)?);
        let described = descriptors.as_deref().unwrap_or_default();
        let hash = |media_type| digest::content_hash(media_type, &image, described, cells.as_deref());
        if imagery::media_type(&image).map(hash) != Some(stated) {
            return Ok(Below::Damaged);
        }
        let (sources, acquired, horizontal_error_m) = (row.get(1)?, row.get(2)?, row.get(3)?);
        Ok(Below::Proved(Child { image, sources, acquired, horizontal_error_m }))
    };
    connection.prepare_cached(sql)?.query_row(key, read).optional()
}
