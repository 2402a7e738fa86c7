//! The cells of a level: read in one scan, and cached.

use super::footprint_rows;
use lru::LruCache;
use overfly_core::feature::CellMap;
use parking_lot::Mutex;
use rusqlite::Connection;
use std::sync::Arc;

/// Memory that the cells of one tile need while a level is read: the blob, and the entry of the map.
const TILE_BYTES: u64 = 9_300;

/// Layer, zoom and pitch.
pub type Key = (String, u8, usize);

/// Column and row of a tile, and its cells.
pub type TileCells = ([u32; 2], Vec<u8>);

/// An LRU cache of cell maps, limited in bytes.
#[derive(Debug)]
pub struct CellCache {
    limit_bytes: u64,
    maps: Mutex<SizedMaps>,
}

/// The maps, and the sum of their sizes.
#[derive(Debug)]
struct SizedMaps {
    maps: LruCache<Key, Arc<CellMap>>,
    bytes: u64,
}

impl CellCache {
    /// Makes an empty cache that holds at most `limit_bytes`.
    pub fn new(limit_bytes: u64) -> Self {
        Self { limit_bytes, maps: Mutex::new(SizedMaps { maps: LruCache::unbounded(), bytes: 0 }) }
    }

    /// Whether the cells of `tiles` tiles can be read within the limit.
    pub fn has_room_for(&self, tiles: usize) -> bool {
        tiles as u64 * TILE_BYTES <= self.limit_bytes
    }

    /// Returns a cached map.
    pub fn get(&self, key: &Key) -> Option<Arc<CellMap>> {
        self.maps.lock().maps.get(key).cloned()
    }

    /// Caches a map, and drops the least recently used ones beyond the limit: even this one, if it alone is too large.
    pub fn insert(&self, key: Key, map: CellMap) -> Arc<CellMap> {
        let map = Arc::new(map);
        let mut cached = self.maps.lock();
        cached.bytes += map.bytes() as u64;
        if let Some(replaced) = cached.maps.put(key, Arc::clone(&map)) {
            cached.bytes -= replaced.bytes() as u64;
        }
        while cached.bytes > self.limit_bytes
            && let Some((_, dropped)) = cached.maps.pop_lru()
        {
            cached.bytes -= dropped.bytes() as u64;
        }
        map
    }
}

/// Reads column, row and cells of each tile of a level that has cells, by row and column.
pub fn load(connection: &Connection, layer: &str, zoom: u8) -> rusqlite::Result<Vec<TileCells>> {
    connection
        .prepare_cached(
            "SELECT f.zoom, f.tile_column, f.tile_row, c.cells FROM footprints f
             JOIN overfly_cells c ON c.footprint = f.fid WHERE f.layer = ?1 AND f.zoom = ?2
             ORDER BY f.tile_row, f.tile_column",
        )?
        .query_map((layer, zoom), |row| {
            let tile = footprint_rows::tile_at(row, 0)?;
            Ok(([tile.column(), tile.row()], row.get(3)?))
        })?
        .collect()
}
