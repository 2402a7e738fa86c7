//! `Sample`: tiles of a plan, made to measure their bytes and their time.

use super::build_plan::BuildPlan;
use super::composite::{TileFailure, compose};
use super::error::BuildError;
use super::overview::shrink;
use super::source_pool::SourcePool;
use overfly_core::tile::TileId;
use overfly_store::{Child, TileContent};
use std::collections::BTreeMap;
use std::time::Instant;

/// Most overview levels that are measured; coarser ones have few tiles.
const MEASURED_OVERVIEWS: usize = 2;
/// About as many base tiles are made, in whole blocks below one overview.
const BASE_TILES: usize = 48;

/// What was measured of the tiles of one level.
#[derive(Debug, Clone, Copy, Default)]
pub struct LevelSample {
    /// Tiles made, empty ones included.
    pub tiles: usize,
    /// Bytes of their imagery, descriptors and cells.
    pub bytes: usize,
    /// Sum of their shares of valid pixels.
    pub valid: f64,
    /// The time they took, seconds.
    pub seconds: f64,
}

impl LevelSample {
    fn add(&mut self, content: Option<&TileContent>, seconds: f64) {
        let bytes = |c: &TileContent| {
            [Some(&c.image.bytes), c.cells.as_ref(), c.descriptors.as_ref()]
                .into_iter()
                .flatten()
                .map(Vec::len)
                .sum::<usize>()
        };
        self.tiles += 1;
        self.bytes += content.map_or(0, bytes);
        self.valid += content.map_or(0.0, |c| c.valid_fraction);
        self.seconds += seconds;
    }

    /// Seconds of a tile.
    pub fn tile_s(&self) -> f64 {
        self.seconds / self.tiles.max(1) as f64
    }

    /// Bytes of a tile.
    pub fn tile_bytes(&self) -> f64 {
        self.bytes as f64 / self.tiles.max(1) as f64
    }

    /// The mean share of valid pixels.
    pub fn valid_fraction(&self) -> f64 {
        self.valid / self.tiles.max(1) as f64
    }
}

/// Returns what was measured of the base level, then of the overviews, finest first: at most three levels.
///
/// # Errors
/// Where a tile cannot be encoded. A source that cannot be read is left to the build to report.
pub fn sample(plan: &BuildPlan, pool: &SourcePool) -> Result<Vec<LevelSample>, BuildError> {
    let levels = plan.overviews.len().min(MEASURED_OVERVIEWS);
    let above = |tile: &TileId| (0..levels).fold(*tile, |tile, _| tile.parent().unwrap_or(tile));
    let blocks: Vec<_> = plan.base.chunk_by(|a, b| above(&a.0) == above(&b.0)).collect();
    let taken = (BASE_TILES * blocks.len() / plan.base.len().max(1)).clamp(1, blocks.len().max(1));
    let step = blocks.len().div_ceil(taken).max(1);
    let mut samples = vec![LevelSample::default(); levels + 1];
    for block in blocks.into_iter().skip(step / 2).step_by(step) {
        let mut made: BTreeMap<TileId, TileContent> = BTreeMap::new();
        for (tile, indices) in block {
            let start = Instant::now();
            let Some(content) = attempt(compose(*tile, indices, pool))? else { continue };
            samples[0].add(content.as_ref(), start.elapsed().as_secs_f64());
            made.extend(content.map(|content| (*tile, content)));
        }
        for level in &mut samples[1..] {
            made = overviews(&made, level)?;
        }
    }
    Ok(samples)
}

/// The outcome of a tile: `None` where a source cannot be read.
fn attempt(outcome: Result<Option<TileContent>, TileFailure>) -> Result<Option<Option<TileContent>>, BuildError> {
    match outcome {
        Ok(content) => Ok(Some(content)),
        Err(TileFailure::Source { .. }) => Ok(None),
        Err(TileFailure::Store(error)) => Err(error.into()),
    }
}

/// Makes the overviews above tiles, and measures them.
fn overviews(
    below: &BTreeMap<TileId, TileContent>,
    level: &mut LevelSample,
) -> Result<BTreeMap<TileId, TileContent>, BuildError> {
    let mut parents: Vec<TileId> = below.keys().filter_map(|tile| tile.parent()).collect();
    parents.sort();
    parents.dedup();
    let mut made = BTreeMap::new();
    for parent in parents {
        let start = Instant::now();
        let children = parent.children().expect("a parent has children").map(|child| below.get(&child).map(as_child));
        let Some(content) = attempt(shrink(parent, &children))? else { continue };
        level.add(content.as_ref(), start.elapsed().as_secs_f64());
        made.extend(content.map(|content| (parent, content)));
    }
    Ok(made)
}

fn as_child(content: &TileContent) -> Child {
    Child {
        image: content.image.bytes.clone(),
        sources: content.sources.clone(),
        acquired: content.acquired.clone(),
        horizontal_error_m: content.horizontal_error_m,
    }
}
