//! `TileCache`: an LRU cache of results computed from tiles.

use lru::LruCache;
use overfly_core::tile::TileId;
use parking_lot::Mutex;
use std::num::NonZeroUsize;
use std::sync::Arc;

/// The index of a layer (for heights: by how many levels a tile is shrunken), and a tile.
type Key = (usize, TileId);

/// An LRU cache of results by layer and tile. An entry is `None` where the layer has no such tile.
#[derive(Debug)]
pub(super) struct TileCache<V> {
    entries: Mutex<LruCache<Key, Option<Arc<V>>>>,
}

impl<V> TileCache<V> {
    /// Makes a cache of at most `capacity` results, and of at least one. Absent tiles count as results.
    pub fn new(capacity: usize) -> Self {
        let capacity = NonZeroUsize::new(capacity).unwrap_or(NonZeroUsize::MIN);
        Self { entries: Mutex::new(LruCache::new(capacity)) }
    }

    /// Returns the cached result, or computes it with `make` and caches it. A failure is not cached. Two threads may compute
    /// the same result at the same time.
    pub fn get<E>(&self, key: Key, make: impl FnOnce() -> Result<Option<V>, E>) -> Result<Option<Arc<V>>, E> {
        if let Some(value) = self.entries.lock().get(&key) {
            return Ok(value.clone());
        }
        let value = make()?.map(Arc::new);
        self.entries.lock().put(key, value.clone());
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    #[test]
    fn keeps_the_most_recently_used() {
        let cache = TileCache::new(2);
        let tile = |column| (0, TileId::new(3, column, 0).unwrap());
        let get =
            |column: u32, value| cache.get(tile(column), || Ok::<_, Infallible>(Some(value))).unwrap().map(|v| *v);
        assert_eq!([get(0, 10), get(1, 11), get(0, 99), get(2, 12)], [Some(10), Some(11), Some(10), Some(12)]);
        // 1 was used least recently.
        assert_eq!([get(0, 99), get(1, 77)], [Some(10), Some(77)]);
    }

    #[test]
    fn caches_absence_but_not_failure() {
        let cache: TileCache<u8> = TileCache::new(2);
        let key = (0, TileId::new(3, 0, 0).unwrap());
        assert_eq!(cache.get(key, || Err("torn")), Err("torn"));
        assert_eq!(cache.get(key, || Ok::<_, &str>(None)), Ok(None));
        assert_eq!(cache.get(key, || Err("torn")), Ok(None));
    }
}
