//! The declaration of a layer of heights as a tiled gridded coverage.
//!
//! # References
//! OGC 17-066r1, GeoPackage Extension for Tiled Gridded Coverage Data.

use super::heights::{LOWEST_M, STEP_M, UNKNOWN};
use super::terrain::Terrain;
use rusqlite::{Connection, params};

/// Its extension, and where that is defined.
const EXTENSION: [&str; 2] = ["gpkg_2d_gridded_coverage", "http://docs.opengeospatial.org/is/17-066r1/17-066r1.html"];

/// Writes what a layer states of its heights, and declares their coverage. Does nothing for imagery.
pub(super) fn declare_terrain(connection: &Connection, layer: &str, terrain: Option<&Terrain>) -> rusqlite::Result<()> {
    let Some(terrain) = terrain else { return Ok(()) };
    connection.execute(
        "INSERT OR REPLACE INTO overfly_terrain (layer, vertical_datum, vertical_error_m) VALUES (?1, ?2, ?3)",
        params![layer, terrain.vertical_datum.word(), terrain.vertical_error_m],
    )?;
    declare(connection, layer)
}

/// Declares a layer, whose contents must be declared, and its tiles. Replaces an older declaration.
fn declare(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    withdraw(connection, layer)?;
    connection.execute("UPDATE gpkg_contents SET data_type = '2d-gridded-coverage' WHERE table_name = ?1", [layer])?;
    connection.execute(
        "INSERT INTO gpkg_2d_gridded_coverage_ancillary
             (tile_matrix_set_name, datatype, scale, offset, precision, data_null, uom)
         VALUES (?1, 'integer', ?2, ?3, ?2, ?4, 'm')",
        params![layer, STEP_M, LOWEST_M, f64::from(UNKNOWN)],
    )?;
    connection.execute(
        "INSERT INTO gpkg_extensions VALUES (?1, 'tile_data', ?2, ?3, 'read-write')",
        params![layer, EXTENSION[0], EXTENSION[1]],
    )?;
    connection.execute(
        &format!(
            "INSERT INTO gpkg_2d_gridded_tile_ancillary (tpudt_name, tpudt_id, scale, offset)
             SELECT ?1, id, 1.0, 0.0 FROM \"{layer}\" ORDER BY id"
        ),
        [layer],
    )?;
    Ok(())
}

/// Deletes the declaration of a layer, where there is one.
pub(super) fn withdraw(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    for sql in [
        "DELETE FROM gpkg_2d_gridded_tile_ancillary WHERE tpudt_name = ?1",
        "DELETE FROM gpkg_2d_gridded_coverage_ancillary WHERE tile_matrix_set_name = ?1",
        "DELETE FROM gpkg_extensions WHERE table_name = ?1 AND extension_name = 'gpkg_2d_gridded_coverage'",
    ] {
        connection.execute(sql, [layer])?;
    }
    Ok(())
}

/// Gives the declaration of a layer another name.
pub(super) fn rename(connection: &Connection, from: &str, to: &str) -> rusqlite::Result<()> {
    for sql in [
        "UPDATE gpkg_2d_gridded_tile_ancillary SET tpudt_name = ?2 WHERE tpudt_name = ?1",
        "UPDATE gpkg_2d_gridded_coverage_ancillary SET tile_matrix_set_name = ?2 WHERE tile_matrix_set_name = ?1",
        "UPDATE gpkg_extensions SET table_name = ?2 WHERE table_name = ?1",
    ] {
        connection.execute(sql, [from, to])?;
    }
    Ok(())
}
