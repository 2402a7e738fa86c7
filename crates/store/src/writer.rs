//! `Writer`: one build of a layer. It declares the layer, puts tiles, and finishes.
//!
//! A finished layer keeps answering queries with its old content until the transaction that finishes the build: its new tiles are
//! staged. The tiles of a layer that was never finished go directly to its tables.

use super::content::{self, Child, TileContent};
use super::contract::require_contract;
use super::declaration::Declaration;
use super::finish::Finished;
use super::geometry::polygon_blob;
use super::layer;
use super::source::{self, SourceTable};
use super::tile_rows::{self, TileRows, insert_tile};
use super::{FORMAT_VERSION, StoreError, connection, finish, geopackage};
use overfly_core::pixels::MaskOutline;
use overfly_core::tile::TileId;
use rusqlite::{Connection, OptionalExtension, params};
use std::path::{Path, PathBuf};

/// A tile as a build computed it.
#[derive(Debug, Clone, PartialEq)]
pub struct BuiltTile {
    /// The tile.
    pub tile: TileId,
    /// Hash of everything that decides the content.
    pub inputs_hash: [u8; 32],
    /// The content: `None` if the tile has no valid pixel.
    pub content: Option<TileContent>,
}

/// A store that is open for one build. Only one thread writes.
///
/// See [`crate::Reader`] for an example.
#[derive(Debug)]
pub struct Writer {
    path: PathBuf,
    connection: Connection,
    declaration: Declaration,
    plan_hash: [u8; 32],
    staging: bool,
    in_transaction: bool,
}

impl Writer {
    /// Opens or creates the store, and declares the layer.
    ///
    /// # Errors
    /// Where the file is not a store, cannot be written, or has another contract.
    pub fn begin(path: &Path, contract: &str, declaration: Declaration) -> Result<Self, StoreError> {
        layer::check_name(&declaration.layer)?;
        let connection = open_or_create(path, contract)?;
        let plan_hash = declaration.plan_hash();
        let fail = |e| StoreError::sqlite(path, e);
        let transaction = connection.unchecked_transaction().map_err(fail)?;
        let staging = declare(&transaction, &declaration, &plan_hash).map_err(fail)?;
        transaction.commit().map_err(fail)?;
        Ok(Self { path: path.into(), connection, declaration, plan_hash, staging, in_transaction: false })
    }

    /// Writes a tile: to the tables of the layer, or to the staging table if the layer is finished. [`Writer::commit`] makes it
    /// durable.
    ///
    /// # Errors
    /// Where the disk is full or another build took over the layer.
    pub fn put(&mut self, built: &BuiltTile) -> Result<(), StoreError> {
        if !self.in_transaction {
            self.begin_transaction()?;
        }
        let layer = &self.declaration.layer;
        let outcome =
            if self.staging { stage(&self.connection, layer, built) } else { replace(&self.connection, layer, built) };
        outcome.map_err(|e| StoreError::sqlite(&self.path, e))
    }

    /// Commits the tiles that were put.
    ///
    /// # Errors
    /// Where the disk is full.
    pub fn commit(&mut self) -> Result<(), StoreError> {
        if std::mem::take(&mut self.in_transaction) {
            self.connection.execute_batch("COMMIT").map_err(|e| self.fail(e))?;
        }
        Ok(())
    }

    /// Returns a tile, stored or staged, as the overview above it needs it: `None` if it has no valid pixel.
    ///
    /// # Errors
    /// Where the store is damaged.
    pub fn child(&self, tile: TileId) -> Result<Option<Child>, StoreError> {
        let layer = &self.declaration.layer;
        let mut found = None;
        if self.staging {
            found = content::staged_child(&self.connection, layer, tile).map_err(|e| self.fail(e))?;
        }
        if found.is_none() {
            found = content::placed_child(&self.connection, layer, tile).map_err(|e| self.fail(e))?;
        }
        found.map_or(Ok(None), |below| below.proved(&self.path, layer, tile))
    }

    /// Finishes the build in one transaction: moves staged tiles, deletes the tiles that are not in `required`, and updates sources,
    /// counts, digest and the GeoPackage declaration. Returns the number of tiles of the layer: `None` if it would have no tile,
    /// in which case the build is abandoned.
    ///
    /// # Errors
    /// Where the disk is full or another build took over the layer. The layer is then unchanged.
    pub fn finish(mut self, required: &dyn Fn(TileId) -> bool) -> Result<Option<u64>, StoreError> {
        self.commit()?;
        self.begin_transaction()?;
        let Finished { tiles, damaged } =
            finish::finish(&self.connection, &self.declaration, required).map_err(|e| self.fail(e))?;
        if let Some(tile) = damaged {
            // Dropping the connection rolls the transaction back.
            return Err(content::damaged(&self.path, &self.declaration.layer, tile));
        }
        if tiles == 0 {
            self.in_transaction = false;
            self.connection.execute_batch("ROLLBACK").map_err(|e| self.fail(e))?;
            self.abandon()?;
            return Ok(None);
        }
        self.commit()?;
        finish::compact(self.connection, &self.path)?;
        Ok(Some(tiles))
    }

    /// Abandons the build. A finished layer is unchanged; a layer that was never finished is removed.
    ///
    /// # Errors
    /// Where SQLite fails.
    pub fn abandon(mut self) -> Result<(), StoreError> {
        self.commit()?;
        self.begin_transaction()?;
        let layer = &self.declaration.layer;
        let outcome = if self.staging {
            finish::clear_pending(&self.connection, layer)
        } else {
            finish::remove(&self.connection, layer)
        };
        outcome.map_err(|e| self.fail(e))?;
        self.commit()
    }

    fn begin_transaction(&mut self) -> Result<(), StoreError> {
        self.connection.execute_batch("BEGIN IMMEDIATE").map_err(|e| self.fail(e))?;
        self.in_transaction = true;
        let ours: Option<[u8; 32]> = self
            .connection
            .prepare_cached("SELECT plan_hash FROM overfly_pending WHERE layer = ?1")
            .and_then(|mut s| s.query_row([&self.declaration.layer], |row| row.get(0)).optional())
            .map_err(|e| self.fail(e))?;
        if ours == Some(self.plan_hash) {
            return Ok(());
        }
        Err(StoreError::Superseded { path: self.path.clone(), layer: self.declaration.layer.clone() })
    }

    fn fail(&self, error: rusqlite::Error) -> StoreError {
        StoreError::sqlite(&self.path, error)
    }
}

fn open_or_create(path: &Path, contract: &str) -> Result<Connection, StoreError> {
    let absent = match std::fs::metadata(path) {
        Ok(metadata) => metadata.is_file() && metadata.len() == 0,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => true,
        Err(e) => return Err(StoreError::io(path, e)),
    };
    if absent {
        return connection::create(path, contract);
    }
    let connection = connection::open_write(path)?;
    require_contract(&connection, path)?;
    Ok(connection)
}

/// Writes the declaration. Returns whether the layer is finished, so that tiles must be staged.
fn declare(connection: &Connection, declaration: &Declaration, plan_hash: &[u8; 32]) -> rusqlite::Result<bool> {
    let Declaration { layer, zoom_override, base_zoom, min_zoom, sources, .. } = declaration;
    geopackage::create_tile_table(connection, layer)?;
    connection.execute(
        "INSERT INTO overfly_layers (name, complete, zoom_override, base_zoom, min_zoom) VALUES (?1, 0, ?2, ?3, ?4)
         ON CONFLICT (name) DO UPDATE SET base_zoom = excluded.base_zoom, min_zoom = excluded.min_zoom,
             zoom_override = excluded.zoom_override WHERE complete = 0",
        params![layer, zoom_override, base_zoom, min_zoom],
    )?;
    connection.execute(
        "INSERT OR REPLACE INTO overfly_pending (layer, zoom_override, base_zoom, min_zoom, plan_hash)
         VALUES (?1, ?2, ?3, ?4, ?5)",
        params![layer, zoom_override, base_zoom, min_zoom, plan_hash],
    )?;
    connection.execute("DELETE FROM overfly_pending_sources WHERE layer = ?1", [layer])?;
    for source in sources {
        source::insert(connection, FORMAT_VERSION, layer, SourceTable::Pending, source)?;
    }
    connection.query_row("SELECT complete FROM overfly_layers WHERE name = ?1", [layer], |row| row.get(0))
}

/// Writes a tile to the staging table.
fn stage(connection: &Connection, layer: &str, built: &BuiltTile) -> rusqlite::Result<()> {
    let tile = built.tile;
    let content = built.content.as_ref();
    let footprint = content.map(|c| c.footprint(tile));
    connection
        .prepare_cached(
            "INSERT OR REPLACE INTO overfly_staged
                 (layer, zoom, tile_row, tile_column, inputs_hash, tile_data, geom, content_hash, sources, acquired,
                  valid_fraction, horizontal_error_m, keypoints, distinctiveness, descriptors, cells, valid_outline, hash)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18)",
        )?
        .execute(params![
            layer,
            tile.zoom(),
            tile.row(),
            tile.column(),
            built.inputs_hash,
            content.map(|c| &c.image.bytes),
            content.map(|_| polygon_blob(&tile.mercator_bounds())),
            content.map(|c| c.image.content_hash),
            content.map(|c| &c.sources),
            content.and_then(|c| c.acquired.as_deref()),
            content.map(|c| c.valid_fraction),
            content.and_then(|c| c.horizontal_error_m),
            content.map(|c| c.keypoints),
            content.map(|c| c.distinctiveness),
            content.and_then(|c| c.descriptors.as_deref()),
            content.and_then(|c| c.cells.as_deref()),
            footprint.as_ref().and_then(|f| f.valid_outline.as_ref()).map(MaskOutline::to_bytes),
            footprint.as_ref().map(|f| f.hash(layer)),
        ])?;
    Ok(())
}

/// Writes a tile to the tables of the layer, and replaces the one there.
fn replace(connection: &Connection, layer: &str, built: &BuiltTile) -> rusqlite::Result<()> {
    let tile = built.tile;
    tile_rows::clear_tile(connection, layer, tile)?;
    if let Some(content) = &built.content {
        let footprint = content.footprint(tile);
        let rows = TileRows {
            footprint: &footprint,
            image: &content.image.bytes,
            descriptors: content.descriptors.as_deref(),
            cells: content.cells.as_deref(),
        };
        insert_tile(connection, FORMAT_VERSION, layer, &rows)?;
    }
    tile_rows::put_inputs(connection, layer, tile, &built.inputs_hash)
}
