//! The parallel part of a build: worker threads make tiles, and the calling thread writes them in the order of the plan. The
//! number of tiles under way is bounded, and so is the memory.

use super::build_plan::BuildPlan;
use super::composite::{TileFailure, compose};
use super::error::BuildError;
use super::overview::shrink;
use super::source_pool::SourcePool;
use overfly_core::tile::TileId;
use overfly_store::{BuiltTile, Child, StoreError, TileContent, Writer};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Tiles under way per thread.
const IN_FLIGHT: usize = 4;
/// A transaction is committed at this age...
const BATCH_TIME: Duration = Duration::from_millis(500);
/// ... or this size.
const BATCH_BYTES: usize = 48 << 20;

/// The progress of a build.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Progress {
    /// Tiles made.
    pub done: usize,
    /// Tiles to make.
    pub total: usize,
    /// Levels by which the base zoom is finer than the finest source.
    pub finer_by: u8,
    /// Levels by which the base zoom is coarser than the layer has been.
    pub coarser_by: u8,
}

/// Why the pipeline stopped.
pub enum Stop {
    /// A source cannot be read.
    BadSource {
        /// The source's index in the declaration.
        index: usize,
        /// Why.
        error: crate::raster::RasterError,
    },
    /// The build cannot go on.
    Failed(BuildError),
}

/// A tile to make.
enum TileJob<'a> {
    Base(TileId, &'a [usize]),
    Overview(TileId, Box<[Option<Child>; 4]>),
}

type Made = Result<(TileId, Option<TileContent>), TileFailure>;

/// Makes and writes all tiles of a plan.
///
/// # Errors
/// [`Stop`] at the first source that cannot be read, where the store fails, or where the caller stops the build. Tiles
/// written so far are kept.
pub fn run(
    plan: &BuildPlan,
    pool: &SourcePool,
    writer: &mut Writer,
    threads: usize,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<(), Stop> {
    let threads = threads.max(1);
    let (work_in, work_out) = channel::<(usize, TileJob<'_>)>();
    let (made_in, made_out) = channel::<(usize, Made)>();
    let work_out = Mutex::new(work_out);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let made_in = made_in.clone();
            let work_out = &work_out;
            scope.spawn(move || make_tiles(work_out, &made_in, pool));
        }
        drop(made_in);
        let mut pipeline = Pipeline {
            work: Some(work_in),
            made: made_out,
            plan,
            writer,
            progress,
            window: threads * IN_FLIGHT,
            done: 0,
            batch_bytes: 0,
            batch_start: Instant::now(),
        };
        let outcome = pipeline.run();
        // The closed channel ends the threads; tiles still under way are dropped.
        pipeline.work = None;
        let kept = pipeline.writer.commit().map_err(|e| Stop::Failed(e.into()));
        outcome.and(kept)
    })
}

/// A worker thread: makes the tiles of jobs until their channel is closed.
fn make_tiles(work: &Mutex<Receiver<(usize, TileJob<'_>)>>, made: &Sender<(usize, Made)>, pool: &SourcePool) {
    loop {
        let next = work.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok((number, work)) = next else { return };
        let tile = match &work {
            TileJob::Base(tile, _) | TileJob::Overview(tile, _) => *tile,
        };
        let outcome = catch_unwind(AssertUnwindSafe(|| match work {
            TileJob::Base(_, indices) => compose(tile, indices, pool),
            TileJob::Overview(_, children) => shrink(tile, &children),
        }))
        // A job without an answer would block the pipeline for ever.
        .unwrap_or_else(|_| {
            Err(TileFailure::Store(StoreError::Encode { tile, reason: "making the tile panicked".into() }))
        })
        .map(|content| (tile, content));
        if made.send((number, outcome)).is_err() {
            return;
        }
    }
}

/// The calling thread's side: it hands out jobs and writes tiles.
struct Pipeline<'a, 'b> {
    work: Option<Sender<(usize, TileJob<'a>)>>,
    made: Receiver<(usize, Made)>,
    plan: &'a BuildPlan,
    writer: &'b mut Writer,
    progress: &'b mut dyn FnMut(Progress) -> ControlFlow<()>,
    window: usize,
    done: usize,
    batch_bytes: usize,
    batch_start: Instant,
}

impl<'a> Pipeline<'a, '_> {
    fn run(&mut self) -> Result<(), Stop> {
        let plan = self.plan;
        self.level(plan.base.len(), |_, i| {
            let (tile, indices) = &plan.base[i];
            Ok(TileJob::Base(*tile, indices))
        })?;
        for level in &plan.overviews {
            // A level reads the one below it, which is complete now.
            self.level(level.len(), |writer, i| {
                let mut children = [None, None, None, None];
                for (slot, child) in children.iter_mut().zip(level[i].children().expect("an overview has children")) {
                    // Obsolete tiles stay in the store until the build ends, and are no children any more.
                    if plan.required.contains_key(&child) {
                        *slot = writer.child(child).map_err(|e| Stop::Failed(e.into()))?;
                    }
                }
                Ok(TileJob::Overview(level[i], Box::new(children)))
            })?;
        }
        Ok(())
    }

    /// Hands out `count` jobs and writes their tiles in the order of the jobs.
    fn level(&mut self, count: usize, job: impl Fn(&Writer, usize) -> Result<TileJob<'a>, Stop>) -> Result<(), Stop> {
        let mut waiting: BTreeMap<usize, (TileId, Option<TileContent>)> = BTreeMap::new();
        let (mut fed, mut put) = (0, 0);
        while put < count {
            while fed < count && fed - put < self.window {
                let next = job(self.writer, fed)?;
                let sender = self.work.as_ref().expect("open until the run ends");
                sender.send((fed, next)).expect("the threads outlive the run");
                fed += 1;
            }
            let (number, outcome) = self.made.recv().expect("the threads answer every job");
            waiting.insert(number, outcome.map_err(stop)?);
            while let Some((tile, content)) = waiting.remove(&put) {
                put += 1;
                self.put(tile, content)?;
            }
        }
        Ok(())
    }

    fn put(&mut self, tile: TileId, content: Option<TileContent>) -> Result<(), Stop> {
        let failed = |e: StoreError| Stop::Failed(e.into());
        self.batch_bytes += content.as_ref().map_or(0, |c| c.image.bytes.len());
        let inputs_hash = self.plan.required[&tile];
        self.writer.put(&BuiltTile { tile, inputs_hash, content }).map_err(failed)?;
        self.done += 1;
        if self.batch_bytes > BATCH_BYTES || self.batch_start.elapsed() > BATCH_TIME {
            self.writer.commit().map_err(failed)?;
            (self.batch_bytes, self.batch_start) = (0, Instant::now());
        }
        let BuildPlan { finer_by, coarser_by, .. } = *self.plan;
        let state = Progress { done: self.done, total: self.plan.jobs(), finer_by, coarser_by };
        match (self.progress)(state) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Stop::Failed(BuildError::Cancelled)),
        }
    }
}

fn stop(failure: TileFailure) -> Stop {
    match failure {
        TileFailure::Source { index, error } => Stop::BadSource { index, error },
        TileFailure::Store(error) => Stop::Failed(error.into()),
    }
}
