//! `SourcePool`: the orthophotos of a build, opened on demand in an LRU cache. Their decoded blocks share one bounded cache.

use super::declare::open_options;
use crate::raster::{BlockCache, Orthophoto, RasterError};
use lru::LruCache;
use overfly_core::pixels::MaskedColour;
use overfly_core::tile::TileId;
use overfly_store::{Declaration, Source};
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};

/// The most orthophotos that are open at once.
const MAX_OPEN: NonZeroUsize = NonZeroUsize::new(32).expect("32 is not 0");

/// The orthophotos of a build.
pub struct SourcePool {
    sources: Vec<Source>,
    heights: bool,
    open: Mutex<LruCache<usize, Arc<Orthophoto>>>,
    blocks: Arc<BlockCache>,
}

impl SourcePool {
    /// Makes a pool of the sources of a layer and opens none.
    pub fn new(declaration: &Declaration) -> Self {
        let (sources, heights) = (declaration.sources.clone(), declaration.terrain.is_some());
        Self { sources, heights, open: Mutex::new(LruCache::new(MAX_OPEN)), blocks: Arc::default() }
    }

    /// Whether the sources are heights and not imagery.
    pub fn holds_heights(&self) -> bool {
        self.heights
    }

    /// The declaration of a source.
    pub fn source(&self, index: usize) -> &Source {
        &self.sources[index]
    }

    /// Warps a source to a tile (`Orthophoto::warp`). A decoder that panics on damaged data counts as an error.
    ///
    /// # Errors
    /// [`RasterError`] where the source cannot be read.
    pub fn warp(&self, index: usize, tile: TileId) -> Result<Option<MaskedColour>, RasterError> {
        catch_unwind(AssertUnwindSafe(|| self.open(index)?.warp(tile))).unwrap_or_else(|_| {
            let path = self.sources[index].path.clone();
            Err(RasterError::Damaged { path, reason: format!("its decoder failed at tile {tile}") })
        })
    }

    fn open(&self, index: usize) -> Result<Arc<Orthophoto>, RasterError> {
        // Opening reads headers only, so other threads wait for it rather than open the source as well.
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(photo) = open.get(&index) {
            return Ok(Arc::clone(photo));
        }
        let source = &self.sources[index];
        let mut options = open_options(source.crs_epsg, source.stretch, self.heights);
        options.cache = Some(Arc::clone(&self.blocks));
        let photo = Arc::new(Orthophoto::open(&source.path, &options)?);
        open.put(index, Arc::clone(&photo));
        Ok(photo)
    }
}
