//! `Keep`: how much a reader may hold in memory between questions.

use overfly_core::tile::TILE_SIZE_PX;

/// Bounds on what a reader keeps. They change how long answers take, never what they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Keep {
    /// Decoded and described tiles, bytes.
    pub ground_bytes: u64,
    /// Cells of levels, bytes.
    pub cells_bytes: u64,
    /// Connections to the file that stay open.
    pub connections: usize,
    /// Pages of the file that each connection holds, bytes.
    pub pages_bytes: u64,
}

/// A gray tile takes four bytes a pixel and one of its mask; a described one as many.
const TILE_BYTES: u64 = 5 * (TILE_SIZE_PX as u64).pow(2);
/// A tile is described with the eight around it; fewer would be decoded again and again.
const LEAST_TILES: usize = 12;

impl Default for Keep {
    /// 147 MB of ground, a gigabyte of cells (a level of 200,000 tiles), 32 MB of pages.
    fn default() -> Self {
        Self { ground_bytes: 112 * TILE_BYTES, cells_bytes: 1 << 30, connections: 16, pages_bytes: 2_048_000 }
    }
}

impl Keep {
    /// Gray tiles and described tiles.
    pub(super) fn tiles(&self) -> [usize; 2] {
        let tiles = (self.ground_bytes / TILE_BYTES) as usize;
        let grays = (tiles * 3 / 7).max(LEAST_TILES);
        [grays, tiles.saturating_sub(grays).max(LEAST_TILES)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_is_48_gray_and_64_described_tiles() {
        assert_eq!(Keep::default().tiles(), [48, 64]);
        assert_eq!(Keep { ground_bytes: 0, ..Keep::default() }.tiles(), [LEAST_TILES; 2]);
    }
}
