//! `Pool`: the orthophotos of a build, opened when needed, the longest unused closed again;
//! their decoded blocks share one bounded cache.

use super::declare::open_options;
use crate::raster::{BlockCache, Orthophoto, RasterError};
use overfly_core::pixels::MaskedColour;
use overfly_core::tile::TileId;
use overfly_store::Source;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};

/// Opened at once.
const OPEN: usize = 32;

/// The orthophotos of a build.
pub struct Pool {
    sources: Vec<Source>,
    open: Mutex<Vec<(usize, Arc<Orthophoto>)>>,
    cache: Arc<BlockCache>,
}

impl Pool {
    /// Of declared sources; none is opened yet.
    pub fn new(sources: Vec<Source>) -> Self {
        Self { sources, open: Mutex::new(Vec::new()), cache: Arc::default() }
    }

    /// What is declared of one.
    pub fn source(&self, index: usize) -> &Source {
        &self.sources[index]
    }

    /// One of them seen through a tile (`Orthophoto::warp`). A decoder that panics on damaged data counts as an error.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub fn warp(&self, index: usize, tile: TileId) -> Result<Option<MaskedColour>, RasterError> {
        catch_unwind(AssertUnwindSafe(|| self.open(index)?.warp(tile))).unwrap_or_else(|_| {
            let path = self.sources[index].path.clone();
            Err(RasterError::Damaged { path, reason: format!("its decoder gave up at tile {tile}") })
        })
    }

    /// One of them, opened.
    ///
    /// # Errors
    /// Where it cannot be opened.
    fn open(&self, index: usize) -> Result<Arc<Orthophoto>, RasterError> {
        // Opening reads headers only: other threads wait for it rather than open it as well.
        let mut open = self.open.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some(at) = open.iter().position(|(i, _)| *i == index) {
            let entry = open.remove(at);
            let photo = Arc::clone(&entry.1);
            open.push(entry);
            return Ok(photo);
        }
        let source = &self.sources[index];
        let mut options = open_options(source.crs_epsg, source.stretch);
        options.cache = Some(Arc::clone(&self.cache));
        let photo = Arc::new(Orthophoto::open(&source.path, &options)?);
        if open.len() == OPEN {
            open.remove(0);
        }
        open.push((index, Arc::clone(&photo)));
        Ok(photo)
    }
}
