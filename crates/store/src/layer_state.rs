//! `LayerState`: the state of one layer, finished or not. A build reads it before it plans.

use super::StoreError;
use super::connection::{self, Access, OpenedStore};
use super::contract::require_contract;
use super::footprint_rows;
use super::source::{self, Source, SourceTable};
use super::terms::Terms;
use super::terrain::{self, Terrain};
use super::versions::{PLACES_SINCE, TERRAIN_SINCE};
use overfly_core::tile::TileId;
use rusqlite::{Connection, OptionalExtension, Row};
use std::collections::HashMap;
use std::path::Path;

/// The state of one layer in a store.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayerState {
    /// Whether the layer answers queries.
    pub complete: bool,
    /// Whether a build of it is running, or was killed.
    pub pending: bool,
    /// The sources of the pending build, or else of the finished layer, by content hash.
    pub sources: Vec<Source>,
    /// Base zoom, if the user stated one.
    pub zoom_override: Option<u8>,
    /// The terms of the finished layer.
    pub terms: Terms,
    /// What the finished layer states of its heights, where it is one of heights.
    pub terrain: Option<Terrain>,
    /// The inputs hash of each stored or staged tile.
    pub inputs: HashMap<TileId, [u8; 32]>,
}

impl LayerState {
    /// Reads the state of a layer. The state is empty if the file does not exist, is empty, or has no such layer.
    ///
    /// # Errors
    /// Where the file is not a store, has a newer format or another contract, or is damaged.
    pub fn read(path: &Path, layer: &str) -> Result<Self, StoreError> {
        if std::fs::metadata(path).is_ok_and(|m| m.is_file() && m.len() == 0) {
            return Ok(Self::default());
        }
        match connection::open_read(path, Access::Shared) {
            Ok(OpenedStore { connection, version, .. }) => {
                require_contract(&connection, path)?;
                Self::load(&connection, version, layer).map_err(|e| StoreError::sqlite(path, e))
            }
            // A store of an older format is migrated when it is opened for writing. Until then its state is unknown.
            Err(StoreError::OlderFormat { .. } | StoreError::Missing { .. }) => Ok(Self::default()),
            Err(other) => Err(other),
        }
    }

    fn load(connection: &Connection, version: u32, layer: &str) -> rusqlite::Result<Self> {
        let finished: Option<(bool, Option<u8>)> = connection
            .query_row("SELECT complete, zoom_override FROM overfly_layers WHERE name = ?1", [layer], |row| {
                Ok((row.get(0)?, row.get(1)?))
            })
            .optional()?;
        let pending: Option<Option<u8>> = connection
            .query_row("SELECT zoom_override FROM overfly_pending WHERE layer = ?1", [layer], |row| row.get(0))
            .optional()?;
        let declared = if pending.is_some() { SourceTable::Pending } else { SourceTable::Finished };
        Ok(Self {
            complete: finished.is_some_and(|(complete, _)| complete),
            pending: pending.is_some(),
            sources: source::load(connection, layer, declared, version)?,
            terms: terms(connection, version, layer)?,
            terrain: terrain(connection, version, layer)?,
            zoom_override: pending.unwrap_or_else(|| finished.and_then(|(_, zoom)| zoom)),
            inputs: inputs(connection, layer)?,
        })
    }
}

/// The terms of a layer: none in a store of an older format.
fn terms(connection: &Connection, version: u32, layer: &str) -> rusqlite::Result<Terms> {
    if version < PLACES_SINCE {
        return Ok(Terms::default());
    }
    let sql = "SELECT licence, attribution FROM overfly_layers WHERE name = ?1";
    let read = |row: &Row<'_>| Ok(Terms { licence: row.get(0)?, attribution: row.get(1)? });
    Ok(connection.query_row(sql, [layer], read).optional()?.unwrap_or_default())
}

/// What a layer states of its heights.
fn terrain(connection: &Connection, version: u32, layer: &str) -> rusqlite::Result<Option<Terrain>> {
    if version < TERRAIN_SINCE {
        return Ok(None);
    }
    let sql = "SELECT vertical_datum, vertical_error_m FROM overfly_terrain WHERE layer = ?1";
    Ok(connection.query_row(sql, [layer], |row| terrain::read(row, 0)).optional()?.flatten())
}

fn inputs(connection: &Connection, layer: &str) -> rusqlite::Result<HashMap<TileId, [u8; 32]>> {
    let mut inputs = HashMap::new();
    for table in ["overfly_tile_inputs", "overfly_staged"] {
        let mut statement = connection
            .prepare(&format!("SELECT zoom, tile_column, tile_row, inputs_hash FROM {table} WHERE layer = ?1"))?;
        let rows = statement.query_map([layer], |row| Ok((footprint_rows::tile_at(row, 0)?, row.get(3)?)))?;
        for row in rows {
            let (tile, hash) = row?;
            inputs.insert(tile, hash);
        }
    }
    Ok(inputs)
}
