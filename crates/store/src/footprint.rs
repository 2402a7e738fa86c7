//! `Footprint`: the properties of one tile, a row of the feature table.

use super::{digest, migration};
use overfly_core::pixels::MaskOutline;
use overfly_core::tile::TileId;
use rusqlite::Row;
use rusqlite::types::Type;

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
    /// Position error of the map here, one standard deviation per axis, metres: `None` where one of its sources states none.
    pub horizontal_error_m: Option<f64>,
    /// Number of described keypoints.
    pub keypoints: u32,
    /// See `feature::keypoint::distinctiveness`.
    pub distinctiveness: f64,
    /// Content hashes of its visible sources, hexadecimal, newest first, separated by spaces.
    pub sources: String,
    /// Where its valid pixels are: `None` where all are valid, and where a store of an older format does not say.
    pub valid_outline: Option<MaskOutline>,
}

/// The largest horizontal error that a store may state, metres.
pub const MOST_ERROR_M: f64 = 10_000.0;
/// The number of columns of [`columns`].
pub(super) const COLUMN_COUNT: usize = 13;

/// Least standard deviation of a map whose error nobody states, metres.
const LEAST_UNKNOWN_ERROR_M: f64 = 3.0;

impl Footprint {
    /// The map's error for a covariance, one standard deviation per axis, metres: where it is unknown half a pixel of the layer's
    /// finest level, whose ground sample distance is given, at least 3 m.
    pub fn error_or_default_m(&self, gsd_m_per_px: f64) -> f64 {
        self.horizontal_error_m.unwrap_or_else(|| default_error_m(gsd_m_per_px))
    }
}

/// The standard deviation per axis that stands for an unknown error of imagery of this ground sample distance, metres.
pub fn default_error_m(gsd_m_per_px: f64) -> f64 {
    (gsd_m_per_px / 2.0).max(LEAST_UNKNOWN_ERROR_M)
}

/// The columns that [`read`] expects, in order, from a table with the alias `f` in a store of a format version.
pub(super) fn columns(version: u32) -> &'static str {
    if version < migration::PLACES_SINCE {
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
        && stated != digest::footprint_hash(row.get_ref(11)?.as_str()?, &footprint)
    {
        return Err(malformed(12, &format!("the footprint of tile {} does not have its hash", footprint.tile)));
    }
    Ok(footprint)
}

/// As [`read`], without a look at the hash.
pub(super) fn read_unproved(row: &Row<'_>) -> rusqlite::Result<Footprint> {
    let outline = row.get::<_, Option<Vec<u8>>>(10)?;
    let outline = outline.map(|bytes| MaskOutline::from_bytes(&bytes).ok_or_else(|| malformed(10, "no valid outline")));
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

/// The larger of two horizontal errors: unknown where either is.
pub fn larger_error(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.zip(b).map(|(a, b)| a.max(b))
}
