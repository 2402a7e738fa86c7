//! `TileContent`: a tile as a build writes it; `Child`: a tile as an overview reads it.

use super::footprint::{Footprint, larger_error};
use super::footprint_rows;
use super::hashing;
use super::imagery::{self, EncodedTile};
use super::source::Source;
use super::{StoreError, digest, heights};
use overfly_core::feature::describe_cells;
use overfly_core::feature::keypoint::{self, Keypoints};
use overfly_core::pixels::{Mask, MaskOutline, MaskedColour};
use overfly_core::tile::TileId;
use rusqlite::{Connection, OptionalExtension, Row, params};
use std::path::Path;

/// The content of a tile that has valid pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct TileContent {
    /// Encoded imagery.
    pub image: EncodedTile,
    /// Encoded keypoints: `None` for an overview.
    pub descriptors: Option<Vec<u8>>,
    /// Cells (`feature::describe_cells`) as bytes: `None` for heights.
    pub cells: Option<Vec<u8>>,
    /// Content hashes of the visible sources, hexadecimal, newest first, separated by spaces.
    pub sources: String,
    /// Newest acquisition date of the visible sources, if known.
    pub acquired: Option<String>,
    /// Share of valid pixels, above 0 and at most 1.
    pub valid_fraction: f64,
    /// Largest horizontal error of the visible sources, one standard deviation per axis, metres: unknown where one of them is.
    pub horizontal_error_m: Option<f64>,
    /// Where the valid pixels are: `None` where all are.
    pub valid_outline: Option<MaskOutline>,
    /// Number of described keypoints.
    pub keypoints: u32,
    /// See `feature::keypoint::distinctiveness`.
    pub distinctiveness: f64,
}

impl TileContent {
    /// Encodes a tile and hashes its content. `seen` are the visible sources in covering order.
    ///
    /// # Errors
    /// [`StoreError::Encode`].
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
        Ok(Self {
            descriptors,
            cells: Some(cells),
            keypoints: keypoints.map_or(0, |k| k.points.len() as u32),
            distinctiveness: keypoints.map_or(0.0, keypoint::distinctiveness),
            ..Self::undescribed(EncodedTile { media_type, bytes, content_hash }, &pixels.mask, seen)
        })
    }

    /// As [`TileContent::encode`], for a tile of heights: red and green of a pixel are the higher and the lower byte of its step
    /// ([`super::step_of`]).
    ///
    /// # Errors
    /// [`StoreError::Encode`].
    pub fn encode_heights(tile: TileId, pixels: &MaskedColour, seen: &[&Source]) -> Result<Self, StoreError> {
        let (media_type, bytes) = ("image/png", heights::encode(tile, pixels)?);
        let content_hash = digest::content_hash(media_type, &bytes, &[], None);
        Ok(Self::undescribed(EncodedTile { media_type, bytes, content_hash }, &pixels.mask, seen))
    }

    /// A tile without descriptors and cells.
    fn undescribed(image: EncodedTile, mask: &Mask, seen: &[&Source]) -> Self {
        let hashes: Vec<_> = seen.iter().map(|s| hashing::hex(&s.content_hash)).collect();
        Self {
            image,
            descriptors: None,
            cells: None,
            sources: hashes.join(" "),
            acquired: seen.iter().filter_map(|s| s.acquired.clone()).max(),
            valid_fraction: mask.valid_fraction(),
            horizontal_error_m: seen.iter().map(|s| s.horizontal_error_m).reduce(larger_error).flatten(),
            valid_outline: outline_of(mask),
            keypoints: 0,
            distinctiveness: 0.0,
        }
    }

    /// Returns the footprint of this content at `tile`.
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
            valid_outline: self.valid_outline.clone(),
        }
    }
}

/// Returns the outline of a tile's valid pixels: `None` where all are valid.
pub fn outline_of(mask: &Mask) -> Option<MaskOutline> {
    (!mask.is_full()).then(|| MaskOutline::new(mask))
}

/// Computes the cells of a tile as they are stored.
pub fn cells_blob(pixels: &MaskedColour) -> Vec<u8> {
    describe_cells(&pixels.colour.to_gray(), &pixels.mask).into_iter().map(|v| v as u8).collect()
}

/// A tile as the overview above it needs it.
#[derive(Debug, Clone, PartialEq)]
pub struct Child {
    /// Encoded imagery.
    pub image: Vec<u8>,
    /// As [`TileContent::sources`].
    pub sources: String,
    /// As [`TileContent::acquired`].
    pub acquired: Option<String>,
    /// As [`TileContent::horizontal_error_m`].
    pub horizontal_error_m: Option<f64>,
}

/// A tile that was read for the overview above it.
pub(super) enum StoredChild {
    /// The tile has no valid pixel.
    Empty,
    /// The tile does not have the hash that its row states. An overview made from it would be wrong and have a right hash.
    Damaged,
    /// The tile has the hash that its row states.
    Proved(Child),
}

impl StoredChild {
    /// Returns the child: `None` for an empty tile.
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

/// Returns the error for a tile that does not have the stated hash.
pub(super) fn damaged(path: &Path, layer: &str, tile: TileId) -> StoreError {
    let reason = "imagery, descriptors or cells do not have the stated hash".into();
    StoreError::DamagedTile { path: path.into(), layer: layer.into(), tile, reason }
}

/// Reads a staged tile: `None` if it is not staged.
pub(super) fn staged_child(
    connection: &Connection,
    layer: &str,
    tile: TileId,
) -> rusqlite::Result<Option<StoredChild>> {
    let sql = "SELECT tile_data, sources, acquired, horizontal_error_m, content_hash, descriptors, cells
               FROM overfly_staged WHERE layer = ?1 AND zoom = ?2 AND tile_row = ?3 AND tile_column = ?4";
    read_child(connection, sql, layer, tile)
}

/// Reads a tile of the tile table: `None` if there is none.
pub(super) fn placed_child(
    connection: &Connection,
    layer: &str,
    tile: TileId,
) -> rusqlite::Result<Option<StoredChild>> {
    let sql = format!(
        "SELECT t.tile_data, f.sources, f.acquired, f.horizontal_error_m, f.content_hash, d.descriptors, c.cells
         FROM \"{layer}\" t
         JOIN footprints f ON f.layer = ?1 AND f.zoom = ?2 AND f.tile_row = ?3 AND f.tile_column = ?4
         LEFT JOIN overfly_descriptors d ON d.footprint = f.fid
         LEFT JOIN overfly_cells c ON c.footprint = f.fid
         WHERE t.zoom_level = ?2 AND t.tile_row = ?3 AND t.tile_column = ?4"
    );
    read_child(connection, &sql, layer, tile)
}

fn read_child(connection: &Connection, sql: &str, layer: &str, tile: TileId) -> rusqlite::Result<Option<StoredChild>> {
    let key = params![layer, tile.zoom(), tile.row(), tile.column()];
    let read = |row: &Row<'_>| {
        let image: Option<Vec<u8>> = row.get(0)?;
        let Some(image) = image else { return Ok(StoredChild::Empty) };
        let stated: [u8; 32] = row.get(4)?;
        let (descriptors, cells): (Option<Vec<u8>>, Option<Vec<u8>>) = (row.get(5)?, row.get(6)?);
        let described = descriptors.as_deref().unwrap_or_default();
        let hash = |media_type| digest::content_hash(media_type, &image, described, cells.as_deref());
        if imagery::media_type(&image).map(hash) != Some(stated) {
            return Ok(StoredChild::Damaged);
        }
        let (sources, acquired, horizontal_error_m) = (row.get(1)?, row.get(2)?, footprint_rows::error_at(row, 3)?);
        Ok(StoredChild::Proved(Child { image, sources, acquired, horizontal_error_m }))
    };
    connection.prepare_cached(sql)?.query_row(key, read).optional()
}
