//! Orthophotos to store, in parallel, resumable.
//!
//! A layer is a function of its set of sources: a build compares what every tile was made from with what it shall be
//! made from, computes the tiles that differ, and drops those that are not wanted. So a build that was killed goes on,
//! and the order of sources and the number of threads change nothing.

mod composite;
mod declare;
mod error;
mod estimate;
mod merge;
mod outline;
mod overview;
mod pipeline;
mod plan;
mod pool;
mod recipe;
mod request;

pub use error::{BuildError, MAX_TILES, Rejected};
pub use estimate::Estimate;
pub use merge::{Conflict, MergeError, MergeRequest, Merged, MergedLayer, merge};
pub use recipe::KEYPOINTS_PER_TILE;
pub use request::Request;

use crate::raster;
use declare::Given;
use overfly_core::feature::keypoint::CONTRACT;
use overfly_store::{LayerState, Reader, StoreError, Writer, clear_journal};
use pipeline::Stop;
use plan::Plan;
use pool::Pool;
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

/// How far a build is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Progress {
    /// Tiles made.
    pub done: usize,
    /// Tiles to make.
    pub total: usize,
}

/// What a build did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The store.
    pub db: PathBuf,
    /// The layer.
    pub layer: String,
    /// Its finest zoom.
    pub base_zoom: u8,
    /// Its coarsest zoom.
    pub min_zoom: u8,
    /// Sources it is made of.
    pub sources: usize,
    /// Of these, the ones without an acquisition date.
    pub undated_sources: usize,
    /// Tiles computed in this run.
    pub computed_tiles: usize,
    /// Tiles that stayed as they were.
    pub kept_tiles: usize,
    /// Tiles dropped.
    pub removed_tiles: usize,
    /// Tiles that the layer has.
    pub tiles: u64,
    /// Size of the store.
    pub bytes: u64,
    /// The whole-store digest, hexadecimal.
    pub digest: String,
    /// Pixels of the given sources, millions.
    pub source_megapixels: f64,
    /// Wall-clock time.
    pub elapsed_s: f64,
    /// Sources left out.
    pub rejected: Vec<Rejected>,
}

/// Says what a build would do, and writes nothing.
///
/// # Errors
/// As [`run`], as far as it can be known beforehand.
pub fn dry_run(request: &Request) -> Result<Estimate, BuildError> {
    request.check()?;
    let mut rejected = Vec::new();
    let given = gather(request, &mut rejected);
    let draft = LayerState::read(&request.db, &request.layer)?;
    require_something(request, &draft, &given, &rejected)?;
    let plan = Plan::make(request, &draft, &given)?;
    estimate::estimate(&plan, request.threads, rejected)
}

/// Builds: brings the layer to what its old and given sources make of it. `progress` is called after every tile, on this
/// thread; it may stop the build, which then goes on when it is run again.
///
/// # Errors
/// Where nothing given is usable, an old source that is needed again is gone (before anything is written), or the store
/// fails. Sources that cannot be read are left out and named in the summary.
pub fn run(request: &Request, progress: &mut dyn FnMut(Progress) -> ControlFlow<()>) -> Result<Summary, BuildError> {
    let start = Instant::now();
    request.check()?;
    let mut rejected = Vec::new();
    let mut given = gather(request, &mut rejected);
    // Where the disk does not say, the build ends before it can take an old store for one of its own making.
    let existed = request.db.try_exists().map_err(|e| StoreError::io(&request.db, e))?;
    let before = LayerState::read(&request.db, &request.layer)?;
    require_something(request, &before, &given, &rejected)?;
    loop {
        let inputs = LayerState::read(&request.db, &request.layer)?.inputs;
        let plan = Plan::make(request, &LayerState { inputs, ..before.clone() }, &given)?;
        if plan.up_to_date {
            clear_journal(&request.db)?;
            return summarise(request, &plan, &given, rejected, start);
        }
        let mut writer = Writer::begin(&request.db, CONTRACT, plan.declaration.clone())?;
        let pool = Pool::new(plan.declaration.sources.clone());
        let (index, error) = match pipeline::run(&plan, &pool, &mut writer, request.threads, progress) {
            Ok(()) => {
                let finished = writer.finish(&|tile| plan.wanted.contains_key(&tile))?;
                if finished.is_none() {
                    clear_new(request, existed);
                    return Err(BuildError::NothingValid { paths: paths(&given), zoom: plan.declaration.base_zoom });
                }
                return summarise(request, &plan, &given, rejected, start);
            }
            Err(Stop::Failed(error)) => return Err(error),
            Err(Stop::BadSource { index, error }) => (index, error),
        };
        let bad = pool.source(index);
        if !given.iter().any(|g| g.source.content_hash == bad.content_hash) {
            let how = format!("cannot be read: {error}");
            return Err(BuildError::SourceGone { path: bad.path.clone(), layer: request.layer.clone(), how });
        }
        // Without that source the layer is another function: plan again. What is already right stays.
        rejected.push(Rejected::raster(&bad.path, &error));
        given.retain(|g| g.source.content_hash != bad.content_hash);
        if given.is_empty() && request.remove_sources.is_empty() {
            give_up(request, writer, &before)?;
            clear_new(request, existed);
            return Err(BuildError::NothingUsable { rejected });
        }
    }
}

/// Leaves the layer declared as it was before this run.
fn give_up(request: &Request, writer: Writer, before: &LayerState) -> Result<(), BuildError> {
    if !before.pending {
        return Ok(writer.abandon()?);
    }
    drop(writer);
    let request = Request { replace_layer: false, remove_sources: Vec::new(), zoom: None, ..request.clone() };
    let plan = Plan::make(&request, before, &[])?;
    Writer::begin(&request.db, CONTRACT, plan.declaration)?;
    Ok(())
}

/// Takes a store away that this run made and could put nothing into.
fn clear_new(request: &Request, existed: bool) {
    if !existed {
        // An empty store is no harm, only untidy.
        let _ = std::fs::remove_file(&request.db);
    }
}

fn paths(given: &[Given]) -> String {
    let paths: Vec<_> = given.iter().map(|g| g.source.path.display().to_string()).collect();
    paths.join(", ")
}

/// Finds and declares the given sources; what is not usable goes to `rejected`.
fn gather(request: &Request, rejected: &mut Vec<Rejected>) -> Vec<Given> {
    let mut given: Vec<Given> = Vec::new();
    for path in &request.sources {
        let found = match raster::find_sources(std::slice::from_ref(path)) {
            Ok(found) => found,
            Err(error) => {
                rejected.push(Rejected::raster(path, &error));
                continue;
            }
        };
        rejected.extend(found.unreadable.iter().map(|(path, error)| Rejected::raster(path, error)));
        for file in found.files {
            match declare::declare(&file, request) {
                Ok(one) => {
                    given.retain(|g| g.source.content_hash != one.source.content_hash);
                    given.push(one);
                }
                Err(bad) => rejected.push(bad),
            }
        }
    }
    given
}

fn require_something(
    request: &Request,
    draft: &LayerState,
    given: &[Given],
    rejected: &[Rejected],
) -> Result<(), BuildError> {
    if !given.is_empty() {
        return Ok(());
    }
    if !rejected.is_empty() {
        return Err(BuildError::NothingUsable { rejected: rejected.to_vec() });
    }
    let goes_on = draft.pending && !request.replace_layer;
    if goes_on || !request.remove_sources.is_empty() { Ok(()) } else { Err(BuildError::NoSources) }
}

fn summarise(
    request: &Request,
    plan: &Plan,
    given: &[Given],
    rejected: Vec<Rejected>,
    start: Instant,
) -> Result<Summary, BuildError> {
    let reader = Reader::open(&request.db)?;
    let layer = reader.layer(&request.layer)?;
    Ok(Summary {
        db: request.db.clone(),
        layer: layer.name.clone(),
        base_zoom: layer.base_zoom,
        min_zoom: layer.min_zoom,
        sources: plan.declaration.sources.len(),
        undated_sources: plan.undated_sources(),
        computed_tiles: plan.jobs(),
        kept_tiles: plan.wanted.len() - plan.jobs(),
        removed_tiles: plan.unwanted,
        tiles: layer.tiles,
        bytes: reader.bytes(),
        digest: reader.digest().to_owned(),
        // Not `sum`: of nothing that is -0.
        source_megapixels: given.iter().fold(0.0, |sum, g| sum + g.pixels as f64) / 1e6,
        elapsed_s: start.elapsed().as_secs_f64(),
        rejected,
    })
}
