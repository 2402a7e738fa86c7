//! `run`: builds a layer from its old and the given sources.

use super::build_plan::BuildPlan;
use super::declare::DeclaredSource;
use super::error::{BuildError, Rejected};
use super::gather::{gather, require_work};
use super::pipeline::{self, Progress, Stop};
use super::request::Request;
use super::source_pool::SourcePool;
use super::summary::{BuildSummary, summarise};
use overfly_core::feature::keypoint::CONTRACT;
use overfly_store::{LayerState, StoreError, Writer, clear_journal, migrate};
use std::ops::ControlFlow;
use std::time::Instant;

/// Builds a layer from its old and the given sources. `progress` is called after every tile, on the calling thread. It may
/// stop the build, which resumes when it is run again.
///
/// # Errors
/// [`BuildError`] where no given source is usable, an old source that is needed again is gone (before anything is written),
/// or the store fails. A source that cannot be read is left out and named in the summary.
///
/// # Example
/// ```
/// use overfly_ingest::build::{Request, run};
/// use std::ops::ControlFlow;
///
/// // A photo of 64 x 64 px of 10 m, its upper-left pixel centre at 500005 m east, 5205995 m north in UTM zone 14 north.
/// let folder = tempfile::tempdir()?;
/// let photo = folder.path().join("photo.png");
/// image::GrayImage::from_fn(64, 64, |x, y| image::Luma([(x * 3 + y) as u8])).save(&photo)?;
/// std::fs::write(folder.path().join("photo.pgw"), "10\n0\n0\n-10\n500005\n5205995\n")?;
///
/// let request = Request {
///     db: folder.path().join("map.gpkg"),
///     layer: "ortho".into(),
///     sources: vec![photo],
///     crs: Some(32614),
///     threads: 1,
///     ..Request::default()
/// };
/// let summary = run(&request, &mut |_progress| ControlFlow::Continue(()))?;
/// assert_eq!((summary.sources, summary.base_zoom), (1, 13));
/// assert!(summary.rejected.is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn run(
    request: &Request,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<BuildSummary, BuildError> {
    let start = Instant::now();
    request.check()?;
    let mut rejected = Vec::new();
    let mut given = gather(request, &mut rejected);
    // Where the disk cannot tell, the build ends here. Otherwise it could remove an old store as one that it made itself.
    let existed = request.db.try_exists().map_err(|e| StoreError::io(&request.db, e))?;
    let before = LayerState::read(&request.db, &request.layer)?;
    require_work(request, &before, &given, &rejected)?;
    loop {
        let inputs = LayerState::read(&request.db, &request.layer)?.inputs;
        let plan = BuildPlan::new(request, &LayerState { inputs, ..before.clone() }, &given)?;
        if plan.up_to_date {
            migrate(&request.db)?;
            clear_journal(&request.db)?;
            return summarise(request, &plan, &given, rejected, start);
        }
        let mut writer = Writer::begin(&request.db, CONTRACT, plan.declaration.clone())?;
        let pool = SourcePool::new(&plan.declaration);
        let (index, error) = match pipeline::run(&plan, &pool, &mut writer, request.threads, progress) {
            Ok(()) => {
                let finished = writer.finish(&|tile| plan.required.contains_key(&tile))?;
                if finished.is_none() {
                    remove_new(request, existed);
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
        // Without that source the layer is another function, so it is planned again. Tiles that are already right stay.
        rejected.push(Rejected::from((bad.path.as_path(), &error)));
        given.retain(|g| g.source.content_hash != bad.content_hash);
        if given.is_empty() && request.remove_sources.is_empty() {
            give_up(request, writer, &before)?;
            remove_new(request, existed);
            return Err(BuildError::NothingUsable { rejected });
        }
    }
}

/// Restores the declaration that the layer had before this run.
fn give_up(request: &Request, writer: Writer, before: &LayerState) -> Result<(), BuildError> {
    if !before.pending {
        return Ok(writer.abandon()?);
    }
    drop(writer);
    let request = Request { replace_layer: false, remove_sources: Vec::new(), zoom: None, ..request.clone() };
    let plan = BuildPlan::new(&request, before, &[])?;
    Writer::begin(&request.db, CONTRACT, plan.declaration)?;
    Ok(())
}

/// Removes a store that this run made and put nothing into.
fn remove_new(request: &Request, existed: bool) {
    if !existed {
        // An empty store does no harm.
        let _ = std::fs::remove_file(&request.db);
    }
}

fn paths(given: &[DeclaredSource]) -> String {
    let paths: Vec<_> = given.iter().map(|g| g.source.path.display().to_string()).collect();
    paths.join(", ")
}
