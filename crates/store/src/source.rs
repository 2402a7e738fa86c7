//! `Source`: one orthophoto of a layer, as declared.

use super::footprint_rows;
use super::versions::PLACES_SINCE;
use rusqlite::types::Type;
use rusqlite::{Connection, Row, params};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::path::PathBuf;

/// One orthophoto of a layer. Its content identifies it: the same bytes at another path are the same source.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// BLAKE3 hash of the file and of its companions (world file, `.prj`).
    pub content_hash: [u8; 32],
    /// Absolute path from which it was read.
    pub path: PathBuf,
    /// Acquisition date, ISO 8601, if known.
    pub acquired: Option<String>,
    /// EPSG code that the user stated instead of the file's own CRS.
    pub crs_epsg: Option<u32>,
    /// Pixel values that become 0 and 255, if stated.
    pub stretch: Option<(f64, f64)>,
    /// Position error, one standard deviation per axis, metres: the stated error and that of the CRS. `None` where nothing states
    /// it.
    pub horizontal_error_m: Option<f64>,
    /// Ground sample distance at the centre, true metres a pixel.
    pub gsd_m_per_px: f64,
    /// Outline, not closed: longitude and latitude, degrees.
    pub outline_deg: Vec<[f64; 2]>,
}

impl Source {
    /// Orders sources by covering: a newer one covers an older one, unknown dates are last, ties go by content hash.
    pub fn covering_order(&self, other: &Self) -> Ordering {
        other.acquired.cmp(&self.acquired).then_with(|| self.content_hash.cmp(&other.content_hash))
    }
}

/// The table of a source: that of finished layers, or that of pending builds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SourceTable {
    Finished,
    Pending,
}

impl SourceTable {
    fn name(self) -> &'static str {
        match self {
            Self::Finished => "overfly_sources",
            Self::Pending => "overfly_pending_sources",
        }
    }
}

pub(super) fn load(
    connection: &Connection,
    layer: &str,
    table: SourceTable,
    version: u32,
) -> rusqlite::Result<Vec<Source>> {
    // Before, 0 stood for an unknown error.
    let error = if version < PLACES_SINCE { "nullif(horizontal_error_m, 0.0)" } else { "horizontal_error_m" };
    let sql = format!(
        "SELECT content_hash, path, acquired, crs_epsg, stretch_low, stretch_high, {error}, gsd_m_per_px,
                outline
         FROM {} WHERE layer = ?1 ORDER BY content_hash",
        table.name()
    );
    let mut statement = connection.prepare(&sql)?;
    statement.query_map([layer], read)?.collect()
}

fn read(row: &Row<'_>) -> rusqlite::Result<Source> {
    let low: Option<f64> = row.get(4)?;
    let high: Option<f64> = row.get(5)?;
    let outline: Vec<u8> = row.get(8)?;
    let path: String = row.get(1)?;
    Ok(Source {
        content_hash: row.get(0)?,
        path: path.into(),
        acquired: row.get(2)?,
        crs_epsg: row.get(3)?,
        stretch: low.zip(high),
        horizontal_error_m: footprint_rows::error_at(row, 6)?,
        gsd_m_per_px: row.get(7)?,
        outline_deg: outline_from_blob(&outline).ok_or_else(|| {
            rusqlite::Error::FromSqlConversionFailure(8, Type::Blob, "an outline of odd length".into())
        })?,
    })
}

pub(super) fn insert(
    connection: &Connection,
    version: u32,
    layer: &str,
    table: SourceTable,
    source: &Source,
) -> rusqlite::Result<()> {
    let sql = format!(
        "INSERT INTO {} (layer, content_hash, path, acquired, crs_epsg, stretch_low, stretch_high, horizontal_error_m,
                         gsd_m_per_px, outline)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
        table.name()
    );
    connection.prepare_cached(&sql)?.execute(params![
        layer,
        source.content_hash,
        source.path.to_string_lossy(),
        source.acquired,
        source.crs_epsg,
        source.stretch.map(|s| s.0),
        source.stretch.map(|s| s.1),
        source.horizontal_error_m.or((version < PLACES_SINCE).then_some(0.0)),
        source.gsd_m_per_px,
        outline_blob(&source.outline_deg),
    ])?;
    Ok(())
}

fn outline_blob(outline_deg: &[[f64; 2]]) -> Vec<u8> {
    outline_deg.iter().flatten().flat_map(|v| v.to_le_bytes()).collect()
}

fn outline_from_blob(blob: &[u8]) -> Option<Vec<[f64; 2]>> {
    let number = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().expect("eight bytes"));
    let points = blob.chunks_exact(16).map(|p| [number(&p[..8]), number(&p[8..])]).collect();
    blob.len().is_multiple_of(16).then_some(points)
}
