//! The cells of a level: read in one scan, and kept.

use super::footprint;
use overfly_core::feature::CellMap;
use rusqlite::Connection;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What a tile's cells take while a level is read: as stored, and in the map.
const TILE_BYTES: u64 = 9_300;

/// Layer, zoom and pitch.
pub type Key = (String, u8, usize);

/// Column and row of a tile, and its cells.
pub type TileCells = ([u32; 2], Vec<u8>);

/// Cells asked for before, the last used last.
#[derive(Debug)]
pub struct CellCache {
    most_bytes: u64,
    kept: Mutex<Vec<(Key, Arc<CellMap>)>>,
}

impl CellCache {
    /// Holds at most so many bytes.
    pub fn new(most_bytes: u64) -> Self {
        Self { most_bytes, kept: Mutex::default() }
    }

    /// Whether the cells of so many tiles can be read within the bound.
    pub fn has_room_for(&self, tiles: usize) -> bool {
        tiles as u64 * TILE_BYTES <= self.most_bytes
    }

    /// What is kept under a key.
    pub fn get(&self, key: &Key) -> Option<Arc<CellMap>> {
        let mut kept = self.lock();
        let at = kept.iter().position(|(k, _)| k == key)?;
        let entry = kept.remove(at);
        let map = Arc::clone(&entry.1);
        kept.push(entry);
        Some(map)
    }

    /// Keeps a map; drops the longest unused beyond the bound.
    pub fn keep(&self, key: Key, map: CellMap) -> Arc<CellMap> {
        let map = Arc::new(map);
        let mut kept = self.lock();
        kept.retain(|(k, _)| *k != key);
        kept.push((key, Arc::clone(&map)));
        while kept.iter().map(|(_, m)| m.bytes() as u64).sum::<u64>() > self.most_bytes && !kept.is_empty() {
            kept.remove(0);
        }
        map
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(Key, Arc<CellMap>)>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Column, row and cells of every tile of one level that has any, by row and column.
pub fn load(connection: &Connection, layer: &str, zoom: u8) -> rusqlite::Result<Vec<TileCells>> {
    connection
        .prepare_cached(
            "SELECT f.zoom, f.tile_column, f.tile_row, c.cells FROM footprints f
             JOIN overfly_cells c ON c.footprint = f.fid WHERE f.layer = ?1 AND f.zoom = ?2
             ORDER BY f.tile_row, f.tile_column",
        )?
        .query_map((layer, zoom), |row| {
            let tile = footprint::tile_at(row, 0)?;
            Ok(([tile.column(), tile.row()], row.get(3)?))
        })?
        .collect()
}
