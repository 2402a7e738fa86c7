//! `Estimate`: what a build would take, from a few tiles made and thrown away. Nothing is written.

use super::composite::{TileFailure, compose};
use super::plan::Plan;
use super::pool::Pool;
use super::{BuildError, Rejected};
use serde::Serialize;
use std::time::Instant;

/// Tiles made to measure.
const SAMPLES: usize = 6;
/// Of a base tile's time, what an overview takes: four are decoded, one encoded, none warped or described.
const OVERVIEW_COST: f64 = 0.5;

/// What a build would take.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// The layer.
    pub layer: String,
    /// Its finest zoom.
    pub base_zoom: u8,
    /// Its coarsest zoom.
    pub min_zoom: u8,
    /// Sources it would have.
    pub sources: usize,
    /// Of these, the ones without an acquisition date.
    pub undated_sources: usize,
    /// Base tiles to compute.
    pub base_tiles: usize,
    /// Overviews to compute.
    pub overview_tiles: usize,
    /// Tiles that stay as they are.
    pub kept_tiles: usize,
    /// Tiles that would go away.
    pub removed_tiles: usize,
    /// Bytes that the computed tiles would take.
    pub estimated_bytes: u64,
    /// Seconds it would take.
    pub estimated_s: f64,
    /// Sources that would be left out.
    pub rejected: Vec<Rejected>,
}

/// Estimates a plan by making a few of its tiles.
///
/// # Errors
/// Where a tile cannot be encoded.
pub fn estimate(plan: &Plan, threads: usize, rejected: Vec<Rejected>) -> Result<Estimate, BuildError> {
    let pool = Pool::new(plan.declaration.sources.clone());
    let step = plan.base.len().div_ceil(SAMPLES).max(1);
    let (mut made, mut bytes, start) = (0usize, 0usize, Instant::now());
    for (tile, indices) in plan.base.iter().skip(step / 2).step_by(step) {
        match compose(*tile, indices, &pool) {
            Ok(content) => {
                bytes += content.map_or(0, |c| c.image.bytes.len() + c.descriptors.map_or(0, |d| d.len()) + ROW_BYTES);
                made += 1;
            }
            // The build will name it.
            Err(TileFailure::Source { .. }) => {}
            Err(TileFailure::Store(error)) => return Err(error.into()),
        }
    }
    let each = 1.0 / made.max(1) as f64;
    let (tile_s, tile_bytes) = (start.elapsed().as_secs_f64() * each, bytes as f64 * each);
    let base_tiles = plan.base.len();
    let overview_tiles = plan.jobs() - base_tiles;
    let work = base_tiles as f64 + OVERVIEW_COST * overview_tiles as f64;
    Ok(Estimate {
        layer: plan.declaration.layer.clone(),
        base_zoom: plan.declaration.base_zoom,
        min_zoom: plan.declaration.min_zoom,
        sources: plan.declaration.sources.len(),
        undated_sources: plan.undated_sources(),
        base_tiles,
        overview_tiles,
        kept_tiles: plan.wanted.len() - plan.jobs(),
        removed_tiles: plan.unwanted,
        estimated_bytes: (plan.jobs() as f64 * tile_bytes) as u64,
        estimated_s: work * tile_s / threads.max(1) as f64,
        rejected,
    })
}

/// A footprint row, its index entries and its share of the R-tree.
const ROW_BYTES: usize = 700;
