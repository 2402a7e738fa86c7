//! `BuildEstimate`: the size and the duration of a build, estimated from a few tiles. Nothing is written.

use super::build_plan::BuildPlan;
use super::composite::{TileFailure, compose};
use super::error::{BuildError, Rejected};
use super::gather::{gather, require_work};
use super::request::Request;
use super::source_pool::SourcePool;
use overfly_store::LayerState;
use serde::Serialize;
use std::time::Instant;

/// Tiles that are made to measure.
const SAMPLES: usize = 6;
/// The time of an overview as a share of a base tile's: four tiles are decoded and one encoded, none warped or described.
const OVERVIEW_COST: f64 = 0.5;
/// Bytes of a footprint row, its index entries and its share of the R-tree.
const ROW_BYTES: usize = 700;

/// What a build would do, and its estimated size and duration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BuildEstimate {
    /// The layer.
    pub layer: String,
    /// Its finest zoom.
    pub base_zoom: u8,
    /// Its coarsest zoom.
    pub min_zoom: u8,
    /// Sources that the layer would have.
    pub sources: usize,
    /// Those of its sources that have no acquisition date.
    pub undated_sources: usize,
    /// Base tiles to compute.
    pub base_tiles: usize,
    /// Overviews to compute.
    pub overview_tiles: usize,
    /// Tiles that stay as they are.
    pub kept_tiles: usize,
    /// Tiles that would be removed.
    pub removed_tiles: usize,
    /// Bytes of the computed tiles.
    pub estimated_bytes: u64,
    /// Duration of the build, seconds.
    pub estimated_s: f64,
    /// Sources that would be left out.
    pub rejected: Vec<Rejected>,
}

/// Estimates a build and writes nothing.
///
/// # Errors
/// As [`run`](super::run), as far as that is known before the build.
pub fn dry_run(request: &Request) -> Result<BuildEstimate, BuildError> {
    request.check()?;
    let mut rejected = Vec::new();
    let given = gather(request, &mut rejected);
    let draft = LayerState::read(&request.db, &request.layer)?;
    require_work(request, &draft, &given, &rejected)?;
    let plan = BuildPlan::new(request, &draft, &given)?;
    estimate(&plan, request.threads, rejected)
}

/// Estimates a plan by making a few of its tiles.
fn estimate(plan: &BuildPlan, threads: usize, rejected: Vec<Rejected>) -> Result<BuildEstimate, BuildError> {
    let pool = SourcePool::new(plan.declaration.sources.clone());
    let step = plan.base.len().div_ceil(SAMPLES).max(1);
    let (mut made, mut bytes, start) = (0usize, 0usize, Instant::now());
    for (tile, indices) in plan.base.iter().skip(step / 2).step_by(step) {
        match compose(*tile, indices, &pool) {
            Ok(content) => {
                bytes += content.map_or(0, |c| c.image.bytes.len() + c.descriptors.map_or(0, |d| d.len()) + ROW_BYTES);
                made += 1;
            }
            // The build will report the source.
            Err(TileFailure::Source { .. }) => {}
            Err(TileFailure::Store(error)) => return Err(error.into()),
        }
    }
    let each = 1.0 / made.max(1) as f64;
    let (tile_s, tile_bytes) = (start.elapsed().as_secs_f64() * each, bytes as f64 * each);
    let base_tiles = plan.base.len();
    let overview_tiles = plan.jobs() - base_tiles;
    let work = base_tiles as f64 + OVERVIEW_COST * overview_tiles as f64;
    Ok(BuildEstimate {
        layer: plan.declaration.layer.clone(),
        base_zoom: plan.declaration.base_zoom,
        min_zoom: plan.declaration.min_zoom,
        sources: plan.declaration.sources.len(),
        undated_sources: plan.undated_sources(),
        base_tiles,
        overview_tiles,
        kept_tiles: plan.required.len() - plan.jobs(),
        removed_tiles: plan.obsolete,
        estimated_bytes: (plan.jobs() as f64 * tile_bytes) as u64,
        estimated_s: work * tile_s / threads.max(1) as f64,
        rejected,
    })
}
