//! `Block` and `BlockCache`: decoded pieces of sources, held within a bound.

use super::RasterError;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

/// A decoded rectangle of a source: 8-bit gray, gray + validity, RGB, or RGB + validity, interleaved by `channels`
/// (1, 2, 3, 4). Validity is 0 or 255; invalid pixels hold zeros.
#[derive(Debug)]
pub(super) struct Block {
    pub width_px: usize,
    pub height_px: usize,
    pub channels: usize,
    pub data: Vec<u8>,
}

impl Block {
    /// A rectangle without one valid pixel.
    pub fn missing(width_px: usize, height_px: usize) -> Self {
        Self { width_px, height_px, channels: 2, data: vec![0; width_px * height_px * 2] }
    }

    /// Whether a validity channel is kept.
    pub fn has_validity(&self) -> bool {
        self.channels.is_multiple_of(2)
    }
}

/// One resolution of a source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Level {
    pub width_px: u64,
    pub height_px: u64,
    /// Size of its blocks; those at the right and lower edge are cut off.
    pub block_width_px: u64,
    pub block_height_px: u64,
}

/// What decodes a file by blocks.
pub(super) trait BlockSource: Send + Sync {
    /// Full resolution first, then overviews, finer before coarser.
    fn levels(&self) -> &[Level];
    /// Whether decoding stays on its thread. Else it may run other work of the same thread pool meanwhile, and no one
    /// may wait for it: that work could be the one waiting.
    fn decodes_alone(&self) -> bool;
    /// Whether nothing of a block was ever written, known without decoding it: whole regions of a sparse file are.
    fn is_missing(&self, _level: usize, _column: u64, _row: u64) -> bool {
        false
    }
    /// Decodes one block; `column`, `row` count blocks.
    fn read(&self, level: usize, column: u64, row: u64) -> Result<Block, RasterError>;
}

/// Decoded blocks of any number of sources, least recently used out first.
///
/// Two threads that want the same block of a file that is decoded whole decode it once. The bound holds for what is kept; beyond it stand only the
/// blocks in use, and a single block that is itself larger than the bound.
pub struct BlockCache {
    capacity_bytes: usize,
    state: Mutex<State>,
}

type Slot = Arc<Mutex<Option<Arc<Block>>>>;
/// Source, level, block column, block row.
pub(super) type BlockKey = (u64, usize, u64, u64);

#[derive(Default)]
struct State {
    slots: HashMap<BlockKey, Entry>,
    kept_bytes: usize,
    clock: u64,
    sources: u64,
}

struct Entry {
    slot: Slot,
    bytes: usize,
    last_used: u64,
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
    /// A cache that keeps at most `capacity_bytes` of decoded pixels.
    pub fn new(capacity_bytes: usize) -> Self {
        Self { capacity_bytes, state: Mutex::default() }
    }

    /// A number for a new source's keys.
    pub(super) fn new_source(&self) -> u64 {
        let mut state = self.state();
        state.sources += 1;
        state.sources
    }

    /// The block of a key, read by `read` where it is not kept. Where another thread is reading it, its result is
    /// waited for, or, without `may_wait`, it is read once more. A failed read is not remembered.
    pub(super) fn get(
        &self,
        key: BlockKey,
        may_wait: bool,
        read: impl FnOnce() -> Result<Block, RasterError>,
    ) -> Result<Arc<Block>, RasterError> {
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
                self.state().slots.remove(&key);
                Err(error)
            }
        }
    }

    fn slot(&self, key: BlockKey) -> Slot {
        let mut state = self.state();
        state.clock += 1;
        let now = state.clock;
        let entry = state.slots.entry(key).or_insert_with(|| Entry { slot: Slot::default(), bytes: 0, last_used: now });
        entry.last_used = now;
        entry.slot.clone()
    }

    /// Counts a block just read, and drops the oldest others beyond the bound.
    fn account(&self, key: BlockKey, bytes: usize) {
        let mut state = self.state();
        if let Some(entry) = state.slots.get_mut(&key) {
            let before = std::mem::replace(&mut entry.bytes, bytes);
            state.kept_bytes = state.kept_bytes + bytes - before;
        }
        while state.kept_bytes > self.capacity_bytes {
            let others = state.slots.iter().filter(|(k, e)| **k != key && e.bytes > 0);
            let Some(oldest) = others.min_by_key(|(_, e)| e.last_used).map(|(k, _)| *k) else { break };
            let dropped = state.slots.remove(&oldest).expect("its key was just found");
            state.kept_bytes -= dropped.bytes;
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use std::sync::atomic::{AtomicUsize, Ordering};

    fn block(bytes: usize) -> Block {
        Block { width_px: bytes, height_px: 1, channels: 1, data: vec![7; bytes] }
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
        // 3 pushes out 2, which is then read again.
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
        let fail = || Err(RasterError::damaged(Path::new("a.tif"), "torn"));
        assert!(cache.get((1, 0, 0, 0), true, fail).is_err());
        assert!(cache.get((1, 0, 0, 0), true, || Ok(block(10))).is_ok());
    }
}
