//! The last transaction of a build, and the removal of a layer's rows.

use super::content::{self, StoredChild};
use super::declaration::Declaration;
use super::digest::LayerHashed;
use super::extent::extent;
use super::footprint_rows;
use super::source::{self, SourceTable};
use super::tile_rows::clear_tile;
use super::versions::PLACES_SINCE;
use super::{FORMAT_VERSION, StoreError, coverage, digest, geopackage, verify};
use overfly_core::tile::TileId;
use rusqlite::{Connection, params};
use std::path::Path;

/// A file with a larger share of unused pages is rewritten without them.
const UNUSED_SHARE: f64 = 0.25;

/// Footprints that are deleted at once.
const REMOVED_AT_ONCE: usize = 4096;

/// The result of the last transaction of a build.
pub(super) struct Finished {
    /// Number of tiles of the layer.
    pub tiles: u64,
    /// A moved tile that does not have the hash that its footprint states. The transaction must then not be committed.
    pub damaged: Option<TileId>,
}

/// Moves staged tiles to the layer's tables, deletes the tiles that are not in `required`, and declares the layer finished.
pub(super) fn finish(
    connection: &Connection,
    declaration: &Declaration,
    required: &dyn Fn(TileId) -> bool,
) -> rusqlite::Result<Finished> {
    let layer = &declaration.layer;
    let damaged = move_staged(connection, layer)?;
    for tile in tiles_with_inputs(connection, layer)?.into_iter().filter(|tile| !required(*tile)) {
        clear_tile(connection, layer, tile)?;
        connection
            .prepare_cached(
                "DELETE FROM overfly_tile_inputs
                 WHERE layer = ?1 AND zoom = ?2 AND tile_row = ?3 AND tile_column = ?4",
            )?
            .execute(params![layer, tile.zoom(), tile.row(), tile.column()])?;
    }
    connection.execute("DELETE FROM overfly_sources WHERE layer = ?1", [layer])?;
    for source in &declaration.sources {
        source::insert(connection, FORMAT_VERSION, layer, SourceTable::Finished, source)?;
    }
    clear_pending(connection, layer)?;
    let tiles = declare(connection, FORMAT_VERSION, declaration)?;
    geopackage::declare_footprints(connection)?;
    Ok(Finished { tiles, damaged })
}

/// Moves the staged tiles of a layer to its tables. Returns the first tile that was damaged on the way.
fn move_staged(connection: &Connection, layer: &str) -> rusqlite::Result<Option<TileId>> {
    let mut statement =
        connection.prepare("SELECT zoom, tile_column, tile_row FROM overfly_staged WHERE layer = ?1")?;
    let staged: Vec<TileId> =
        statement.query_map([layer], |row| footprint_rows::tile_at(row, 0))?.collect::<rusqlite::Result<_>>()?;
    for tile in staged {
        clear_tile(connection, layer, tile)?;
        let key = params![layer, tile.zoom(), tile.row(), tile.column()];
        for sql in [
            &format!(
                "INSERT INTO \"{layer}\" (zoom_level, tile_column, tile_row, tile_data)
                 SELECT zoom, tile_column, tile_row, tile_data FROM overfly_staged
                 WHERE layer = ?1 AND zoom = ?2 AND tile_row = ?3 AND tile_column = ?4 AND tile_data NOT NULL"
            ),
            "INSERT INTO footprints
                 (geom, layer, zoom, tile_column, tile_row, content_hash, sources, acquired, valid_fraction,
                  horizontal_error_m, keypoints, distinctiveness, valid_outline, hash)
             SELECT geom, layer, zoom, tile_column, tile_row, content_hash, sources, acquired, valid_fraction,
                    horizontal_error_m, keypoints, distinctiveness, valid_outline, hash FROM overfly_staged
             WHERE layer = ?1 AND zoom = ?2 AND tile_row = ?3 AND tile_column = ?4 AND tile_data NOT NULL",
            "INSERT INTO overfly_descriptors (footprint, descriptors)
             SELECT f.fid, s.descriptors FROM overfly_staged s
             JOIN footprints f USING (layer, zoom, tile_row, tile_column)
             WHERE s.layer = ?1 AND s.zoom = ?2 AND s.tile_row = ?3 AND s.tile_column = ?4 AND s.descriptors NOT NULL",
            "INSERT INTO overfly_cells (footprint, cells)
             SELECT f.fid, s.cells FROM overfly_staged s
             JOIN footprints f USING (layer, zoom, tile_row, tile_column)
             WHERE s.layer = ?1 AND s.zoom = ?2 AND s.tile_row = ?3 AND s.tile_column = ?4 AND s.cells NOT NULL",
            "INSERT OR REPLACE INTO overfly_tile_inputs (layer, zoom, tile_row, tile_column, inputs_hash)
             SELECT layer, zoom, tile_row, tile_column, inputs_hash FROM overfly_staged
             WHERE layer = ?1 AND zoom = ?2 AND tile_row = ?3 AND tile_column = ?4",
        ] {
            connection.prepare_cached(sql)?.execute(key)?;
        }
        if let Some(StoredChild::Damaged) = content::placed_child(connection, layer, tile)? {
            return Ok(Some(tile));
        }
    }
    Ok(None)
}

fn tiles_with_inputs(connection: &Connection, layer: &str) -> rusqlite::Result<Vec<TileId>> {
    let mut statement =
        connection.prepare("SELECT zoom, tile_column, tile_row FROM overfly_tile_inputs WHERE layer = ?1")?;
    statement.query_map([layer], |row| footprint_rows::tile_at(row, 0))?.collect()
}

/// Deletes a pending build and its staged tiles.
pub(super) fn clear_pending(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    for table in ["overfly_pending", "overfly_pending_sources", "overfly_staged"] {
        connection.execute(&format!("DELETE FROM {table} WHERE layer = ?1"), [layer])?;
    }
    Ok(())
}

/// Deletes a layer.
pub(super) fn remove(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    clear_pending(connection, layer)?;
    remove_footprints(connection, layer)?;
    for table in ["overfly_tile_inputs", "overfly_sources", "overfly_terrain", "overfly_index"] {
        connection.execute(&format!("DELETE FROM {table} WHERE layer = ?1"), [layer])?;
    }
    connection.execute("DELETE FROM overfly_layers WHERE name = ?1", [layer])?;
    geopackage::withdraw(connection, layer)?;
    coverage::withdraw(connection, layer)?;
    connection.execute_batch(&format!("DROP TABLE IF EXISTS \"{layer}\""))?;
    geopackage::declare_footprints(connection)
}

/// Deletes the footprints of a layer with their descriptors and cells, some at a time: SQLite holds in memory which rows a statement
/// deletes.
fn remove_footprints(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    loop {
        let chunk: Vec<i64> = connection
            .prepare_cached(&format!("SELECT fid FROM footprints WHERE layer = ?1 LIMIT {REMOVED_AT_ONCE}"))?
            .query_map([layer], |row| row.get(0))?
            .collect::<rusqlite::Result<_>>()?;
        if chunk.is_empty() {
            return Ok(());
        }
        for fid in chunk {
            for sql in [
                "DELETE FROM overfly_descriptors WHERE footprint = ?1",
                "DELETE FROM overfly_cells WHERE footprint = ?1",
                "DELETE FROM footprints WHERE fid = ?1",
            ] {
                connection.prepare_cached(sql)?.execute([fid])?;
            }
        }
    }
}

/// Writes the row of a layer and its GeoPackage declaration from the contents of its tables. Returns the number of tiles.
pub(super) fn declare(connection: &Connection, version: u32, declaration: &Declaration) -> rusqlite::Result<u64> {
    let Declaration { layer, sources, zoom_override, base_zoom, min_zoom, terms, terrain } = declaration;
    let base: Vec<TileId> = connection
        .prepare("SELECT zoom, tile_column, tile_row FROM footprints WHERE layer = ?1 AND zoom = ?2")?
        .query_map(params![layer, base_zoom], |row| footprint_rows::tile_at(row, 0))?
        .collect::<rusqlite::Result<_>>()?;
    let tiles: u32 =
        connection.query_row("SELECT count(*) FROM footprints WHERE layer = ?1", [layer], |row| row.get(0))?;
    let (bounds, bounds_deg) = extent(&base);
    let hashed =
        LayerHashed { name: layer, base_zoom: *base_zoom, min_zoom: *min_zoom, terms, terrain: terrain.as_ref() };
    let digest = digest::layer_digest(connection, &hashed, version, sources)?;
    if version >= PLACES_SINCE {
        let set = "UPDATE overfly_layers SET licence = ?2, attribution = ?3 WHERE name = ?1";
        connection.execute(set, params![layer, terms.licence, terms.attribution])?;
    }
    connection.execute(
        "UPDATE overfly_layers SET complete = 1, zoom_override = ?2, base_zoom = ?3, min_zoom = ?4, base_tiles = ?5,
             tiles = ?6, west_deg = ?7, south_deg = ?8, east_deg = ?9, north_deg = ?10, digest = ?11
         WHERE name = ?1",
        params![
            layer,
            zoom_override,
            base_zoom,
            min_zoom,
            base.len() as u32,
            tiles,
            bounds_deg.west_deg,
            bounds_deg.south_deg,
            bounds_deg.east_deg,
            bounds_deg.north_deg,
            digest
        ],
    )?;
    let newest = sources.iter().filter_map(|s| s.acquired.as_deref()).max();
    geopackage::declare(connection, layer, *min_zoom..=*base_zoom, &bounds, &geopackage::last_change(newest))?;
    coverage::declare_terrain(connection, layer, terrain.as_ref())?;
    Ok(tiles.into())
}

/// Closes a store. If many of its pages are unused, rewrites it without them first, and then verifies every tile: SQLite takes
/// pages that it cannot read to their end for zeros, and copies these. If the store cannot be rewritten, it stays as it is.
///
/// # Errors
/// [`StoreError::Damaged`], or where the disk fails.
pub(super) fn compact(connection: Connection, path: &Path) -> Result<(), StoreError> {
    let pragma = |name: &str| connection.query_row(&format!("PRAGMA {name}"), [], |row| row.get::<_, f64>(0));
    let mut rewritten = false;
    if let (Ok(unused), Ok(all)) = (pragma("freelist_count"), pragma("page_count"))
        && unused > UNUSED_SHARE * all
        && unused > 64.0
    {
        // With a temporary file instead of memory, because the store may be large. A failure here is not a failure of the build:
        // SQLite reuses the unused pages.
        rewritten = connection.execute_batch("PRAGMA temp_store = FILE; PRAGMA cache_spill = 1; VACUUM").is_ok();
    }
    connection.close().map_err(|(_, e)| StoreError::sqlite(path, e))?;
    if !rewritten {
        return Ok(());
    }
    match verify::verify(path, &|_, _| ())?.bad_tiles.first() {
        None => Ok(()),
        Some(bad) => {
            let reason = format!("tile {} of layer {}: {}", bad.id, bad.layer, bad.reason);
            Err(StoreError::Damaged { path: path.into(), reason })
        }
    }
}
