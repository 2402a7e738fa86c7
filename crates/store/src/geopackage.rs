//! The tile table of a layer, and the rows that declare it in a GeoPackage.

use super::geometry::SRS_ID;
use overfly_core::geodesy::WORLD_M;
use overfly_core::tile::{MercatorBounds, TILE_SIZE_PX};
use rusqlite::{Connection, OptionalExtension, params};

/// Size of a pixel at a zoom, metres of the projection.
pub fn pixel_size_m(zoom: u8) -> f64 {
    WORLD_M / f64::from(TILE_SIZE_PX) / f64::from(1u32 << zoom)
}

/// Creates the tile table of a layer with the five standard columns (OGC 12-128r18, 2.2.8).
pub(super) fn create_tile_table(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    connection.execute_batch(&format!(
        "CREATE TABLE IF NOT EXISTS \"{layer}\" (
             id INTEGER PRIMARY KEY AUTOINCREMENT,
             zoom_level INTEGER NOT NULL,
             tile_column INTEGER NOT NULL,
             tile_row INTEGER NOT NULL,
             tile_data BLOB NOT NULL,
             UNIQUE (zoom_level, tile_column, tile_row)
         )"
    ))
}

/// The description of a layer that nobody has described.
pub(super) const NO_DESCRIPTION: &str = "orthophotos";

/// Declares a finished layer: contents, tile matrix set, and a tile matrix for each zoom. Replaces an older declaration, and keeps its
/// description.
pub(super) fn declare(
    connection: &Connection,
    layer: &str,
    zooms: std::ops::RangeInclusive<u8>,
    bounds: &MercatorBounds,
    last_change: &str,
) -> rusqlite::Result<()> {
    let described = description(connection, layer)?.unwrap_or_else(|| NO_DESCRIPTION.into());
    withdraw(connection, layer)?;
    connection.execute(
        "INSERT INTO gpkg_contents
             (table_name, data_type, identifier, description, last_change, min_x, min_y, max_x, max_y, srs_id)
         VALUES (?1, 'tiles', ?1, ?8, ?2, ?3, ?4, ?5, ?6, ?7)",
        params![layer, last_change, bounds.min_x_m, bounds.min_y_m, bounds.max_x_m, bounds.max_y_m, SRS_ID, described],
    )?;
    let half_m = WORLD_M / 2.0;
    connection.execute(
        "INSERT INTO gpkg_tile_matrix_set (table_name, srs_id, min_x, min_y, max_x, max_y)
         VALUES (?1, ?2, ?3, ?3, ?4, ?4)",
        params![layer, SRS_ID, -half_m, half_m],
    )?;
    for zoom in zooms {
        connection.execute(
            "INSERT INTO gpkg_tile_matrix
                 (table_name, zoom_level, matrix_width, matrix_height, tile_width, tile_height, pixel_x_size, pixel_y_size)
             VALUES (?1, ?2, ?3, ?3, ?4, ?4, ?5, ?5)",
            params![layer, zoom, 1u32 << zoom, TILE_SIZE_PX, pixel_size_m(zoom)],
        )?;
    }
    Ok(())
}

/// Deletes the declaration of a layer.
pub(super) fn withdraw(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    for table in ["gpkg_tile_matrix", "gpkg_tile_matrix_set", "gpkg_contents"] {
        connection.execute(&format!("DELETE FROM {table} WHERE table_name = ?1"), [layer])?;
    }
    Ok(())
}

/// The description of a declared layer.
pub(super) fn description(connection: &Connection, layer: &str) -> rusqlite::Result<Option<String>> {
    let sql = "SELECT description FROM gpkg_contents WHERE table_name = ?1";
    let text: Option<Option<String>> = connection.query_row(sql, [layer], |row| row.get(0)).optional()?;
    Ok(text.flatten())
}

/// Describes a declared layer; an empty text takes its description away.
pub(super) fn describe(connection: &Connection, layer: &str, text: &str) -> rusqlite::Result<()> {
    let text = if text.is_empty() { NO_DESCRIPTION } else { text };
    connection.execute("UPDATE gpkg_contents SET description = ?2 WHERE table_name = ?1", [layer, text])?;
    Ok(())
}

/// Gives a declared layer and its tile table another name.
pub(super) fn rename(connection: &Connection, from: &str, to: &str) -> rusqlite::Result<()> {
    connection.execute_batch(&format!("ALTER TABLE \"{from}\" RENAME TO \"{to}\""))?;
    connection
        .execute("UPDATE gpkg_contents SET table_name = ?2, identifier = ?2 WHERE table_name = ?1", [from, to])?;
    for table in ["gpkg_tile_matrix_set", "gpkg_tile_matrix"] {
        connection.execute(&format!("UPDATE {table} SET table_name = ?2 WHERE table_name = ?1"), [from, to])?;
    }
    Ok(())
}

/// Writes when a declared layer was last changed.
pub(super) fn put_last_change(connection: &Connection, layer: &str, last_change: &str) -> rusqlite::Result<()> {
    connection.execute("UPDATE gpkg_contents SET last_change = ?2 WHERE table_name = ?1", [layer, last_change])?;
    Ok(())
}

/// Updates the declaration of the footprints from those of the finished layers.
pub(super) fn declare_footprints(connection: &Connection) -> rusqlite::Result<()> {
    connection.execute(
        "UPDATE gpkg_contents SET (min_x, min_y, max_x, max_y, last_change) = (
             SELECT min(min_x), min(min_y), max(max_x), max(max_y), coalesce(max(last_change), '1970-01-01T00:00:00.000Z')
             FROM gpkg_contents WHERE data_type IN ('tiles', '2d-gridded-coverage'))
         WHERE table_name = 'footprints'",
        [],
    )?;
    Ok(())
}

/// Formats an acquisition date as a GeoPackage time: the Unix epoch if the date is unknown.
pub(super) fn last_change(acquired: Option<&str>) -> String {
    let date = acquired.and_then(|a| a.get(..10)).unwrap_or("1970-01-01");
    match acquired.and_then(|a| a.get(10..19)) {
        Some(time) => format!("{date}{time}.000Z"),
        None => format!("{date}T00:00:00.000Z"),
    }
}
