//! The cells of a level: read in one scan, and kept.

use super::footprint;
use crate::feature::CellMap;
use rusqlite::Connection;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Most that is kept, bytes: a level of 200,000 tiles. The last asked for is kept whatever its size.
const MOST_BYTES: usize = 1 << 30;

/// Layer, zoom and pitch.
pub type Key = (String, u8, usize);

/// Column and row of a tile, and its cells.
pub type TileCells = ([u32; 2], Vec<u8>);

/// Cells asked for before, the last used last.
#[derive(Debug, Default)]
pub struct CellCache {
    kept: Mutex<Vec<(Key, Arc<CellMap>)>>,
}

impl CellCache {
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
        while kept.len() > 1 && kept.iter().map(|(_, m)| m.bytes()).sum::<usize>() > MOST_BYTES {
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
