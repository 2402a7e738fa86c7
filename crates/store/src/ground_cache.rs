//! `GroundCache`: the decoded and described tiles that a reader caches.

use super::CacheLimits;
use super::tile_cache::TileCache;
use overfly_core::feature::Structure;
use overfly_core::pixels::{Gray, Mask};
use overfly_core::tile::HeightGrid;

/// Brightness and mask of one tile.
pub(super) type GrayTile = (Gray, Mask);

/// LRU caches of decoded and described tiles.
#[derive(Debug)]
pub(super) struct GroundCache {
    pub grays: TileCache<GrayTile>,
    pub structures: TileCache<Structure>,
    pub heights: TileCache<HeightGrid>,
}

impl GroundCache {
    /// Makes empty caches within the limits.
    pub fn new(limits: &CacheLimits) -> Self {
        let [grays, structures] = limits.tile_counts();
        Self {
            grays: TileCache::new(grays),
            structures: TileCache::new(structures),
            heights: TileCache::new(grays / 4),
        }
    }
}
