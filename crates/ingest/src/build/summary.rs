//! `BuildSummary`: what a build did.

use super::build_plan::BuildPlan;
use super::declare::{DeclaredSource, OverriddenCrs};
use super::error::{BuildError, Rejected};
use super::request::Request;
use overfly_store::Reader;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// What a build did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BuildSummary {
    /// The store.
    pub db: PathBuf,
    /// The layer.
    pub layer: String,
    /// Its finest zoom.
    pub base_zoom: u8,
    /// Its coarsest zoom.
    pub min_zoom: u8,
    /// Sources of the layer.
    pub sources: usize,
    /// Those of its sources that have no acquisition date.
    pub undated_sources: usize,
    /// Those of its sources whose position error nothing states.
    pub unknown_errors: usize,
    /// Those of the given sources whose own CRS the request overrides.
    pub overridden_crs: Vec<OverriddenCrs>,
    /// Tiles computed in this run.
    pub computed_tiles: usize,
    /// Tiles that stayed as they were.
    pub kept_tiles: usize,
    /// Tiles removed.
    pub removed_tiles: usize,
    /// Tiles of the layer.
    pub tiles: u64,
    /// Size of the store's file.
    pub bytes: u64,
    /// The whole-store digest, hexadecimal.
    pub digest: String,
    /// Pixels of the given sources, in millions.
    pub source_megapixels: f64,
    /// Wall-clock time, seconds.
    pub elapsed_s: f64,
    /// Sources that were left out.
    pub rejected: Vec<Rejected>,
}

/// Makes the summary of a finished build from the store.
///
/// # Errors
/// Where the store cannot be read.
pub fn summarise(
    request: &Request,
    plan: &BuildPlan,
    given: &[DeclaredSource],
    rejected: Vec<Rejected>,
    start: Instant,
) -> Result<BuildSummary, BuildError> {
    let reader = Reader::open(&request.db)?;
    let layer = reader.layer(&request.layer)?;
    Ok(BuildSummary {
        db: request.db.clone(),
        layer: layer.name.clone(),
        base_zoom: layer.base_zoom,
        min_zoom: layer.min_zoom,
        sources: plan.declaration.sources.len(),
        undated_sources: plan.undated_sources(),
        unknown_errors: plan.unknown_errors(),
        overridden_crs: given.iter().filter_map(|g| g.overridden_crs.clone()).collect(),
        computed_tiles: plan.jobs(),
        kept_tiles: plan.required.len() - plan.jobs(),
        removed_tiles: plan.obsolete,
        tiles: layer.tiles,
        bytes: reader.bytes(),
        digest: reader.digest().to_owned(),
        // Not `sum`, which is -0 for no source.
        source_megapixels: given.iter().fold(0.0, |sum, g| sum + g.pixels as f64) / 1e6,
        elapsed_s: start.elapsed().as_secs_f64(),
        rejected,
    })
}
