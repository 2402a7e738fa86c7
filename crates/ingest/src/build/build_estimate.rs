//! `BuildEstimate`: the size and the duration of a build, estimated from a few tiles. Nothing is written.

use super::build_plan::BuildPlan;
use super::declare::OverriddenCrs;
use super::error::{BuildError, Rejected};
use super::gather::{gather, require_work};
use super::request::Request;
use super::sample::{LevelSample, sample};
use super::source_pool::SourcePool;
use overfly_store::{EMPTY_STORE_BYTES, LayerState, stored_bytes};
use serde::Serialize;

/// What a build would do, and its estimated size and duration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BuildEstimate {
    /// The layer.
    pub layer: String,
    /// Its finest zoom.
    pub base_zoom: u8,
    /// Its coarsest zoom.
    pub min_zoom: u8,
    /// Levels by which its finest zoom is finer than the finest source.
    pub finer_by: u8,
    /// Levels by which its finest zoom is coarser than the layer has been: they would be removed.
    pub coarser_by: u8,
    /// Sources that the layer would have.
    pub sources: usize,
    /// Those of its sources that have no acquisition date.
    pub undated_sources: usize,
    /// Those of its sources whose position error nothing states.
    pub unknown_errors: usize,
    /// Those of the given sources whose own CRS the request overrides.
    pub overridden_crs: Vec<OverriddenCrs>,
    /// Base tiles to compute.
    pub base_tiles: usize,
    /// Overviews to compute.
    pub overview_tiles: usize,
    /// Tiles that stay as they are.
    pub kept_tiles: usize,
    /// Tiles that would be removed.
    pub removed_tiles: usize,
    /// Bytes that the computed tiles, and a new store, take in the file.
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
    let overridden_crs = given.iter().filter_map(|g| g.overridden_crs.clone()).collect();
    let estimated = estimate(&plan, request, !request.db.exists(), rejected)?;
    Ok(BuildEstimate { overridden_crs, ..estimated })
}

/// Estimates a plan by making a few of its tiles.
fn estimate(
    plan: &BuildPlan,
    request: &Request,
    is_new: bool,
    rejected: Vec<Rejected>,
) -> Result<BuildEstimate, BuildError> {
    let pool = SourcePool::new(&plan.declaration);
    let samples = sample(plan, &pool)?;
    let base_tiles = plan.base.len();
    let overview_tiles = plan.jobs() - base_tiles;
    let overviews = samples.get(1).copied().unwrap_or_default();
    let work_s = base_tiles as f64 * samples[0].tile_s() + overview_tiles as f64 * overviews.tile_s();
    let content = content_bytes(plan, &samples);
    let tiles_bytes = stored_bytes(content as u64, plan.jobs() as u64, base_tiles as u64);
    Ok(BuildEstimate {
        layer: plan.declaration.layer.clone(),
        base_zoom: plan.declaration.base_zoom,
        min_zoom: plan.declaration.min_zoom,
        finer_by: plan.finer_by,
        coarser_by: plan.coarser_by,
        sources: plan.declaration.sources.len(),
        undated_sources: plan.undated_sources(),
        unknown_errors: plan.unknown_errors(),
        overridden_crs: Vec::new(),
        base_tiles,
        overview_tiles,
        kept_tiles: plan.required.len() - plan.jobs(),
        removed_tiles: plan.obsolete,
        estimated_bytes: tiles_bytes + if is_new { EMPTY_STORE_BYTES } else { 0 },
        estimated_s: work_s / request.threads.max(1) as f64,
        rejected,
    })
}

/// The bytes of the content of all tiles of a plan: measured levels by the mean of their tiles, coarser ones by the bytes per valid
/// pixel of the coarsest measured level.
fn content_bytes(plan: &BuildPlan, samples: &[LevelSample]) -> f64 {
    let counts: Vec<usize> = std::iter::once(plan.base.len()).chain(plan.overviews.iter().map(Vec::len)).collect();
    let last = samples.len() - 1;
    let coarsest = samples[last];
    let per_valid = coarsest.bytes as f64 / coarsest.valid.max(f64::MIN_POSITIVE);
    let bytes = |(level, &tiles): (usize, &usize)| match samples.get(level) {
        Some(sample) => tiles as f64 * sample.tile_bytes(),
        None => {
            let valid = coarsest.valid_fraction() * counts[last] as f64 / 4f64.powi((level - last) as i32);
            valid.min(tiles as f64) * per_valid
        }
    };
    counts.iter().enumerate().map(bytes).sum()
}
