//! Inserts and deletes the rows of one tile in all its tables.

use super::footprint::Footprint;
use super::geometry::polygon_blob;
use super::versions::PLACES_SINCE;
use overfly_core::pixels::MaskOutline;
use overfly_core::tile::TileId;
use rusqlite::{Connection, params};

/// The rows of one tile.
pub(super) struct TileRows<'a> {
    pub footprint: &'a Footprint,
    pub image: &'a [u8],
    pub descriptors: Option<&'a [u8]>,
    pub cells: Option<&'a [u8]>,
}

/// Inserts a tile that the layer does not have yet.
pub(super) fn insert_tile(
    connection: &Connection,
    version: u32,
    layer: &str,
    rows: &TileRows<'_>,
) -> rusqlite::Result<()> {
    let tile = rows.footprint.tile;
    connection
        .prepare_cached(&format!(
            "INSERT INTO \"{layer}\" (zoom_level, tile_column, tile_row, tile_data) VALUES (?1, ?2, ?3, ?4)"
        ))?
        .execute(params![tile.zoom(), tile.column(), tile.row(), rows.image])?;
    let footprint = insert_footprint(connection, version, layer, rows.footprint)?;
    if let Some(descriptors) = rows.descriptors {
        connection
            .prepare_cached("INSERT INTO overfly_descriptors (footprint, descriptors) VALUES (?1, ?2)")?
            .execute(params![footprint, descriptors])?;
    }
    if let Some(cells) = rows.cells {
        connection
            .prepare_cached("INSERT INTO overfly_cells (footprint, cells) VALUES (?1, ?2)")?
            .execute(params![footprint, cells])?;
    }
    Ok(())
}

/// Inserts a footprint, and returns its `fid`.
fn insert_footprint(connection: &Connection, version: u32, layer: &str, known: &Footprint) -> rusqlite::Result<i64> {
    let tile = known.tile;
    let binds_places = version >= PLACES_SINCE;
    let error_m = known.horizontal_error_m.or((!binds_places).then_some(0.0));
    connection
        .prepare_cached(
            "INSERT INTO footprints
                 (geom, layer, zoom, tile_column, tile_row, content_hash, sources, acquired, valid_fraction,
                  horizontal_error_m, keypoints, distinctiveness)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)",
        )?
        .execute(params![
            polygon_blob(&tile.mercator_bounds()),
            layer,
            tile.zoom(),
            tile.column(),
            tile.row(),
            known.content_hash,
            known.sources,
            known.acquired,
            known.valid_fraction,
            error_m,
            known.keypoints,
            known.distinctiveness,
        ])?;
    let fid = connection.last_insert_rowid();
    if binds_places {
        connection
            .prepare_cached("UPDATE footprints SET valid_outline = ?2, hash = ?3 WHERE fid = ?1")?
            .execute(params![fid, known.valid_outline.as_ref().map(MaskOutline::to_bytes), known.hash(layer)])?;
    }
    Ok(fid)
}

/// Deletes imagery, footprint, descriptors and cells of a tile. A trigger updates the R-tree.
pub(super) fn clear_tile(connection: &Connection, layer: &str, tile: TileId) -> rusqlite::Result<()> {
    let key = params![layer, tile.zoom(), tile.row(), tile.column()];
    for sql in [
        "DELETE FROM overfly_descriptors WHERE footprint = (SELECT fid FROM footprints
             WHERE layer = ?1 AND zoom = ?2 AND tile_row = ?3 AND tile_column = ?4)",
        "DELETE FROM overfly_cells WHERE footprint = (SELECT fid FROM footprints
             WHERE layer = ?1 AND zoom = ?2 AND tile_row = ?3 AND tile_column = ?4)",
        "DELETE FROM footprints WHERE layer = ?1 AND zoom = ?2 AND tile_row = ?3 AND tile_column = ?4",
        &format!(
            "DELETE FROM \"{layer}\" WHERE ?1 NOT NULL AND zoom_level = ?2 AND tile_row = ?3 AND tile_column = ?4"
        ),
    ] {
        connection.prepare_cached(sql)?.execute(key)?;
    }
    Ok(())
}

/// Stores the inputs hash of a tile.
pub(super) fn put_inputs(
    connection: &Connection,
    layer: &str,
    tile: TileId,
    inputs_hash: &[u8; 32],
) -> rusqlite::Result<()> {
    connection
        .prepare_cached(
            "INSERT OR REPLACE INTO overfly_tile_inputs (layer, zoom, tile_row, tile_column, inputs_hash)
             VALUES (?1, ?2, ?3, ?4, ?5)",
        )?
        .execute(params![layer, tile.zoom(), tile.row(), tile.column(), inputs_hash])?;
    Ok(())
}
