//! `CacheLimits`: how much memory a reader may hold between queries.

use overfly_core::tile::TILE_SIZE_PX;

/// Limits on a reader's caches. They change how long queries take, never the answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CacheLimits {
    /// Decoded and described tiles, bytes.
    pub ground_bytes: u64,
    /// Cells of whole levels, bytes.
    pub cells_bytes: u64,
    /// Number of connections to the file that stay open.
    pub connections: usize,
    /// SQLite's page cache of each connection, bytes.
    pub pages_bytes: u64,
}

/// Size of a decoded tile: four bytes of brightness and one byte of mask a pixel. A described tile has the same size.
const TILE_BYTES: u64 = 5 * (TILE_SIZE_PX as u64).pow(2);
/// Describing a tile needs the eight tiles around it. A smaller cache would decode them again for each tile.
const LEAST_TILES: usize = 12;

impl Default for CacheLimits {
    /// 147 MB for the ground, 1 GiB for cells (a level of 200,000 tiles), and 2 MB of pages for each of 16 connections.
    fn default() -> Self {
        Self { ground_bytes: 112 * TILE_BYTES, cells_bytes: 1 << 30, connections: 16, pages_bytes: 2_048_000 }
    }
}

impl CacheLimits {
    /// Returns how many decoded tiles and how many described tiles may be cached.
    pub(super) fn tile_counts(&self) -> [usize; 2] {
        let tiles = (self.ground_bytes / TILE_BYTES) as usize;
        let grays = (tiles * 3 / 7).max(LEAST_TILES);
        [grays, tiles.saturating_sub(grays).max(LEAST_TILES)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_48_decoded_and_64_described_tiles() {
        assert_eq!(CacheLimits::default().tile_counts(), [48, 64]);
        assert_eq!(CacheLimits { ground_bytes: 0, ..CacheLimits::default() }.tile_counts(), [LEAST_TILES; 2]);
    }
}
