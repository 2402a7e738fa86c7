//! Reads footprints from their rows, in stores of every readable format.

use super::footprint::{Footprint, MOST_ERROR_M};
use super::versions::PLACES_SINCE;
use overfly_core::pixels::MaskOutline;
use overfly_core::tile::{TILE_SIZE_PX, TileId};
use rusqlite::Row;
use rusqlite::types::Type;

/// The number of columns of [`columns`].
pub(super) const COLUMN_COUNT: usize = 13;

/// The columns that [`read`] expects, in order, from a table with the alias `f` in a store of a format version.
pub(super) fn columns(version: u32) -> &'static str {
    if version < PLACES_SINCE {
        "f.zoom, f.tile_column, f.tile_row, f.content_hash, f.acquired, f.valid_fraction,
         nullif(f.horizontal_error_m, 0.0), f.keypoints, f.distinctiveness, f.sources, NULL, f.layer, NULL"
    } else {
        "f.zoom, f.tile_column, f.tile_row, f.content_hash, f.acquired, f.valid_fraction,
         f.horizontal_error_m, f.keypoints, f.distinctiveness, f.sources, f.valid_outline, f.layer, f.hash"
    }
}

/// Reads a footprint. A number that no footprint can have is an error, and in a store that has the hashes of footprints so is one
/// whose hash is not the stated one.
pub(super) fn read(row: &Row<'_>) -> rusqlite::Result<Footprint> {
    let footprint = read_unproved(row)?;
    if let Some(stated) = row.get::<_, Option<[u8; 32]>>(12)?
        && stated != footprint.hash(row.get_ref(11)?.as_str()?)
    {
        return Err(malformed(12, &format!("the footprint of tile {} does not have its hash", footprint.tile)));
    }
    Ok(footprint)
}

/// As [`read`], without a look at the hash.
pub(super) fn read_unproved(row: &Row<'_>) -> rusqlite::Result<Footprint> {
    let outline = row.get::<_, Option<Vec<u8>>>(10)?;
    let outline = outline.map(|bytes| {
        MaskOutline::from_bytes(&bytes, TILE_SIZE_PX as u16).ok_or_else(|| malformed(10, "no valid outline"))
    });
    let footprint = Footprint {
        tile: tile_at(row, 0)?,
        content_hash: row.get(3)?,
        acquired: row.get(4)?,
        valid_fraction: row.get(5)?,
        horizontal_error_m: error_at(row, 6)?,
        keypoints: row.get(7)?,
        distinctiveness: row.get(8)?,
        sources: row.get(9)?,
        valid_outline: outline.transpose()?,
    };
    if !(footprint.valid_fraction > 0.0 && footprint.valid_fraction <= 1.0) {
        return Err(malformed(5, &format!("a valid fraction of {}", footprint.valid_fraction)));
    }
    if !footprint.distinctiveness.is_finite() {
        return Err(malformed(8, &format!("a distinctiveness of {}", footprint.distinctiveness)));
    }
    Ok(footprint)
}

/// Reads a horizontal error, metres: `None` where it is unknown.
pub(super) fn error_at(row: &Row<'_>, column: usize) -> rusqlite::Result<Option<f64>> {
    let error_m: Option<f64> = row.get(column)?;
    match error_m {
        Some(error_m) if !(0.0..=MOST_ERROR_M).contains(&error_m) => {
            Err(malformed(column, &format!("a horizontal error of {error_m} m")))
        }
        known => Ok(known),
    }
}

/// Reads a tile from three columns: zoom, column and row, beginning at `first`.
pub(super) fn tile_at(row: &Row<'_>, first: usize) -> rusqlite::Result<TileId> {
    let column: u32 = row.get(first + 1)?;
    TileId::new(row.get(first)?, column, row.get(first + 2)?)
        .map_err(|e| rusqlite::Error::FromSqlConversionFailure(first, Type::Integer, Box::new(e)))
}

pub(super) fn malformed(column: usize, what: &str) -> rusqlite::Error {
    rusqlite::Error::FromSqlConversionFailure(column, Type::Blob, what.into())
}
