//! `Residents`: the indexes that a service keeps in memory, within a bound.
//!
//! Measured by `cargo bench --bench candidates` on 2 shared cores of a Xeon, 102,400 footprints of one level:
//!
//! | tiles met | filter, SQLite | filter, rstar | whole answer, SQLite | whole answer, rstar |
//! |---|---|---|---|---|
//! | 9 | 15 us | 0.7 us | 45 us | 31 us |
//! | 61 | 119 us | 2.0 us | 278 us | 147 us |
//! | 2,899 | 6.6 ms | 0.045 ms | 15.4 ms | 6.6 ms |
//!
//! Reading the footprints takes 74 ms and indexing them 26 ms. So a service, which answers many queries, keeps indexes; a single
//! query from the command line goes to SQLite, which answers before an index is built. The tests compare both. An index is never
//! evicted: two levels that do not fit together would be built again for every query.

use super::candidate_tiles::Candidates;
use super::error::CandidatesError;
use super::index::ResidentIndex;
use super::query::{CandidateQuery, MAX_TILES};
use super::ranking::rank;
use super::search::{bounded, candidates, prepare};
use super::search_cost::SearchCost;
use overfly_store::{Layer, Reader};
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// What one footprint takes in memory, with its place in the tree, bytes (measured on the benchmark's, rounded up).
const FOOTPRINT_BYTES: u64 = 320;

/// An answer that could have more tiles than these is large: some megabytes while it is made.
const LARGE: u64 = 2_000;

/// Indexes by layer and zoom, made when first asked for. Of one store: it must be the same at every call.
#[derive(Debug)]
pub struct Residents {
    limit_bytes: u64,
    most_tiles: u64,
    /// Held while an answer of many tiles is made: one at a time.
    large: Mutex<()>,
    held: Mutex<HashMap<(String, u8), Arc<ResidentIndex>>>,
}

impl Residents {
    /// None yet. What does not fit into `limit_bytes` together is answered from the store instead.
    pub fn new(limit_bytes: u64) -> Self {
        Self { limit_bytes, most_tiles: MAX_TILES, large: Mutex::default(), held: Mutex::default() }
    }

    /// The same, refusing questions that could meet more tiles than these.
    pub fn giving(self, most_tiles: u64) -> Self {
        Self { most_tiles: most_tiles.min(MAX_TILES), ..self }
    }

    /// Answers a question as [`candidates`] does, from memory where the layer's level fits.
    ///
    /// # Errors
    /// As [`candidates`].
    pub fn candidates(&self, store: &Reader, query: &CandidateQuery) -> Result<Candidates, CandidatesError> {
        let (layer, zoom, region) = prepare(store, query)?;
        let tiles = bounded(&region.mercator_bounds(), zoom, layer, self.most_tiles)?;
        let _alone = (tiles > LARGE).then(|| self.large.lock().unwrap_or_else(|poisoned| poisoned.into_inner()));
        let Some(index) = self.index(store, layer, zoom)? else { return candidates(store, query) };
        let met = index.footprints_in(&region.mercator_bounds());
        let cost = SearchCost::new(layer, zoom, query.centre, query.image);
        Ok(rank(&layer.name, met.into_iter(), &region, query.max_tiles, &cost))
    }

    /// The index of a level, made if need be; `None` where it does not fit.
    fn index(&self, store: &Reader, layer: &Layer, zoom: u8) -> Result<Option<Arc<ResidentIndex>>, CandidatesError> {
        let mut held = self.held.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let key = (layer.name.clone(), zoom);
        if let Some(index) = held.get(&key) {
            return Ok(Some(index.clone()));
        }
        let used: u64 = held.values().map(|index| index.len() as u64).sum();
        let more = if zoom == layer.base_zoom { layer.base_tiles } else { layer.tiles - layer.base_tiles };
        if (used + more).saturating_mul(FOOTPRINT_BYTES) > self.limit_bytes {
            return Ok(None);
        }
        let index = Arc::new(ResidentIndex::new(store.footprints(layer, zoom)?));
        held.insert(key, index.clone());
        Ok(Some(index))
    }
}
