//! `Footprint`: what is known of one tile; a row of the feature table.

use overfly_core::tile::TileId;
use rusqlite::Row;

/// What is known of one tile.
#[derive(Debug, Clone, PartialEq)]
pub struct Footprint {
    /// Which tile.
    pub tile: TileId,
    /// BLAKE3 of its content.
    pub content_hash: [u8; 32],
    /// Newest acquisition date seen in it, ISO 8601, where known.
    pub acquired: Option<String>,
    /// Share of valid pixels.
    pub valid_fraction: f64,
    /// One standard deviation per axis of the map itself here, metres.
    pub horizontal_error_m: f64,
    /// Keypoints described in it.
    pub keypoints: u32,
    /// See `feature::keypoint::distinctiveness`.
    pub distinctiveness: f64,
    /// Content hashes of the sources seen in it, hexadecimal, newest first, separated by spaces.
    pub sources: String,
}

/// The columns that [`read`] takes, in its order, of a table or alias `f`.
pub(super) const COLUMNS: &str = "f.zoom, f.tile_column, f.tile_row, f.content_hash, f.acquired, f.valid_fraction,
    f.horizontal_error_m, f.keypoints, f.distinctiveness, f.sources";

pub(super) fn read(row: &Row<'_>) -> rusqlite::Result<Footprint> {
    Ok(Footprint {
        tile: tile_at(row, 0)?,
        content_hash: row.get(3)?,
        acquired: row.get(4)?,
        valid_fraction: row.get(5)?,
        horizontal_error_m: row.get(6)?,
        keypoints: row.get(7)?,
        distinctiveness: row.get(8)?,
        sources: row.get(9)?,
    })
}

/// The tile whose zoom, column and row stand from column `first` on.
pub(super) fn tile_at(row: &Row<'_>, first: usize) -> rusqlite::Result<TileId> {
    let column: u32 = row.get(first + 1)?;
    TileId::new(row.get(first)?, column, row.get(first + 2)?)
        .map_err(|e| rusqlite::Error::FromSqlConversionFailure(first, rusqlite::types::Type::Integer, Box::new(e)))
}
