//! `PixelBlock`: a decoded rectangle of a source; `BlockSource`: a file that is decoded by blocks; `BlockCache`: an LRU cache.

use super::error::RasterError;
use lru::LruCache;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

/// A decoded rectangle of a source: 8-bit gray, gray + validity, RGB, or RGB + validity, interleaved by `channels`
/// (1, 2, 3, 4). Validity is 0 or 255; invalid pixels hold zeros.
#[derive(Debug)]
pub(super) struct PixelBlock {
    pub width_px: usize,
    pub height_px: usize,
    pub channels: usize,
    pub data: Vec<u8>,
}

impl PixelBlock {
    /// Makes a rectangle without a valid pixel.
    pub fn missing(width_px: usize, height_px: usize) -> Self {
        Self { width_px, height_px, channels: 2, data: vec![0; width_px * height_px * 2] }
    }

    /// Whether the block has a validity channel.
    pub fn has_validity(&self) -> bool {
        self.channels.is_multiple_of(2)
    }
}

/// One resolution of a source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RasterLevel {
    pub width_px: u64,
    pub height_px: u64,
    /// Width of its blocks; those at the right edge are narrower.
    pub block_width_px: u64,
    /// Height of its blocks; those at the lower edge are lower.
    pub block_height_px: u64,
}

/// A file that is decoded by blocks.
pub(super) trait BlockSource: Send + Sync {
    /// The resolutions: full resolution first, then overviews, finer before coarser.
    fn levels(&self) -> &[RasterLevel];
    /// Whether decoding stays on the calling thread. Otherwise the thread may run other work of its pool meanwhile, so no
    /// thread may wait for it: the work that it runs could be the one that waits.
    fn decodes_alone(&self) -> bool;
    /// Whether a block was never written, known without decoding it. Sparse files have whole regions of such blocks.
    fn is_missing(&self, _level: usize, _column: u64, _row: u64) -> bool {
        false
    }
    /// Decodes one block; `column`, `row` count blocks.
    fn read(&self, level: usize, column: u64, row: u64) -> Result<PixelBlock, RasterError>;
}

/// An LRU cache of decoded blocks of any number of sources, bounded in bytes.
///
/// Two threads that need the same block of a file decode it once, where that file's decoder stays on its thread. Blocks in
/// use, and a single block larger than the bound, may exceed the bound.
pub struct BlockCache {
    capacity_bytes: usize,
    state: Mutex<CacheState>,
}

/// A block, or the place where the thread that decodes it will put it.
type Slot = Arc<Mutex<Option<Arc<PixelBlock>>>>;
/// Source, level, block column, block row.
pub(super) type BlockKey = (u64, usize, u64, u64);

struct CacheState {
    blocks: LruCache<BlockKey, CachedBlock>,
    kept_bytes: usize,
    sources: u64,
}

#[derive(Default)]
struct CachedBlock {
    slot: Slot,
    /// 0 until the block is decoded.
    bytes: usize,
}

impl std::fmt::Debug for BlockCache {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BlockCache").field("capacity_bytes", &self.capacity_bytes).finish_non_exhaustive()
    }
}

impl Default for BlockCache {
    /// 64 MB: a row of 512 px tiles of a source 20,000 px wide.
    fn default() -> Self {
        Self::new(64 << 20)
    }
}

impl BlockCache {
    /// Makes a cache that keeps at most `capacity_bytes` of decoded pixels.
    pub fn new(capacity_bytes: usize) -> Self {
        let state = CacheState { blocks: LruCache::unbounded(), kept_bytes: 0, sources: 0 };
        Self { capacity_bytes, state: Mutex::new(state) }
    }

    /// Returns a new number for the keys of a source.
    pub(super) fn new_source(&self) -> u64 {
        let mut state = self.state();
        state.sources += 1;
        state.sources
    }

    /// Returns the block of a key, decoded by `read` where it is not cached. Where another thread is decoding it, this one
    /// waits for the result, or, without `may_wait`, decodes it again. A failed read is not cached.
    pub(super) fn get(
        &self,
        key: BlockKey,
        may_wait: bool,
        read: impl FnOnce() -> Result<PixelBlock, RasterError>,
    ) -> Result<Arc<PixelBlock>, RasterError> {
        let slot = self.slot(key);
        let mut held = match slot.try_lock() {
            Ok(held) => held,
            Err(TryLockError::Poisoned(held)) => held.into_inner(),
            Err(TryLockError::WouldBlock) if may_wait => slot.lock().unwrap_or_else(PoisonError::into_inner),
            Err(TryLockError::WouldBlock) => return read().map(Arc::new),
        };
        if let Some(block) = &*held {
            return Ok(block.clone());
        }
        match read() {
            Ok(block) => {
                let block = Arc::new(block);
                *held = Some(block.clone());
                drop(held);
                self.account(key, block.data.len());
                Ok(block)
            }
            Err(error) => {
                self.state().blocks.pop(&key);
                Err(error)
            }
        }
    }

    fn slot(&self, key: BlockKey) -> Slot {
        self.state().blocks.get_or_insert_mut(key, CachedBlock::default).slot.clone()
    }

    /// Counts a block that was just decoded, and evicts the least recently used others beyond the bound.
    fn account(&self, key: BlockKey, bytes: usize) {
        let mut state = self.state();
        if let Some(cached) = state.blocks.peek_mut(&key) {
            let before = std::mem::replace(&mut cached.bytes, bytes);
            state.kept_bytes = state.kept_bytes + bytes - before;
        }
        while state.kept_bytes > self.capacity_bytes {
            // Only blocks that other threads are decoding are skipped, so this looks at a few entries at most.
            let oldest = state.blocks.iter().rev().find(|(k, cached)| **k != key && cached.bytes > 0).map(|(k, _)| *k);
            let Some(evicted) = oldest.and_then(|oldest| state.blocks.pop(&oldest)) else { break };
            state.kept_bytes -= evicted.bytes;
        }
    }

    fn state(&self) -> MutexGuard<'_, CacheState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use std::sync::atomic::{AtomicUsize, Ordering};

    fn block(bytes: usize) -> PixelBlock {
        PixelBlock { width_px: bytes, height_px: 1, channels: 1, data: vec![7; bytes] }
    }

    #[test]
    fn keeps_the_latest_within_its_bound() {
        let cache = BlockCache::new(250);
        let reads = AtomicUsize::new(0);
        let get = |n: u64| {
            let read = || {
                reads.fetch_add(1, Ordering::Relaxed);
                Ok(block(100))
            };
            cache.get((1, 0, n, 0), true, read).unwrap();
        };
        for n in [1, 2, 1, 3, 1, 2] {
            get(n);
        }
        // 3 evicts 2, which is then read again.
        assert_eq!(reads.load(Ordering::Relaxed), 4);
        assert!(cache.state().kept_bytes <= 250);
    }

    #[test]
    fn reads_once_for_many_threads() {
        let (cache, reads) = (BlockCache::new(1000), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    let read = || {
                        reads.fetch_add(1, Ordering::Relaxed);
                        std::thread::sleep(std::time::Duration::from_millis(20));
                        Ok(block(10))
                    };
                    cache.get((1, 0, 0, 0), true, read).unwrap();
                });
            }
        });
        assert_eq!(reads.load(Ordering::Relaxed), 1);
    }

    #[test]
    fn forgets_a_failed_read() {
        let cache = BlockCache::new(1000);
        let fail = || Err(RasterError::damaged(Path::new("a.tif"), "truncated"));
        assert!(cache.get((1, 0, 0, 0), true, fail).is_err());
        assert!(cache.get((1, 0, 0, 0), true, || Ok(block(10))).is_ok());
    }
}
