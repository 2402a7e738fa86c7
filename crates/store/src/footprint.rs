//! `Footprint`: the properties of one tile, a row of the feature table.

use overfly_core::tile::TileId;
use rusqlite::Row;

/// The properties of one tile.
#[derive(Debug, Clone, PartialEq)]
pub struct Footprint {
    /// The tile.
    pub tile: TileId,
    /// BLAKE3 hash of the content.
    pub content_hash: [u8; 32],
    /// Newest acquisition date of its sources, ISO 8601, if known.
    pub acquired: Option<String>,
    /// Share of valid pixels, above 0 and at most 1.
    pub valid_fraction: f64,
    /// Position error of the map here, one standard deviation per axis, metres.
    pub horizontal_error_m: f64,
    /// Number of described keypoints.
    pub keypoints: u32,
    /// See `feature::keypoint::distinctiveness`.
    pub distinctiveness: f64,
    /// Content hashes of its visible sources, hexadecimal, newest first, separated by spaces.
    pub sources: String,
}

/// The columns that [`read`] expects, in order, from a table with the alias `f`.
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

/// Reads a tile from three columns: zoom, column and row, beginning at `first`.
pub(super) fn tile_at(row: &Row<'_>, first: usize) -> rusqlite::Result<TileId> {
    let column: u32 = row.get(first + 1)?;
    TileId::new(row.get(first)?, column, row.get(first + 2)?)
        .map_err(|e| rusqlite::Error::FromSqlConversionFailure(first, rusqlite::types::Type::Integer, Box::new(e)))
}
