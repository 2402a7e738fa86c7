//! The parallel part: worker threads make tiles, the calling thread writes them, in the order of the plan. What is under
//! way is bounded, so memory is.

use super::composite::{TileFailure, compose};
use super::overview::shrink;
use super::plan::Plan;
use super::pool::Pool;
use super::{BuildError, Progress};
use overfly_core::tile::TileId;
use overfly_store::{BuiltTile, Child, StoreError, TileContent, Writer};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Tiles under way, each thread.
const IN_FLIGHT: usize = 4;
/// A transaction is committed when it is this old...
const BATCH_TIME: Duration = Duration::from_millis(500);
/// ... or holds this much.
const BATCH_BYTES: usize = 48 << 20;

/// Why the pipeline stopped.
pub enum Stop {
    /// A source cannot be read through.
    BadSource {
        /// Its index in the declaration.
        index: usize,
        /// What is wrong with it.
        error: crate::raster::RasterError,
    },
    /// The build cannot go on.
    Failed(BuildError),
}

enum Work<'a> {
    Base(TileId, &'a [usize]),
    Overview(TileId, Box<[Option<Child>; 4]>),
}

type Made = Result<(TileId, Option<TileContent>), TileFailure>;

/// Makes and puts all tiles of a plan.
///
/// # Errors
/// At the first source that cannot be read through, or where the store fails or the caller stops it. What was put so
/// far is kept.
pub fn run(
    plan: &Plan,
    pool: &Pool,
    writer: &mut Writer,
    threads: usize,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<(), Stop> {
    let threads = threads.max(1);
    let (work_in, work_out) = channel::<(usize, Work<'_>)>();
    let (made_in, made_out) = channel::<(usize, Made)>();
    let work_out = Mutex::new(work_out);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let made_in = made_in.clone();
            let work_out = &work_out;
            scope.spawn(move || work_on(work_out, &made_in, pool));
        }
        drop(made_in);
        let mut line = Line {
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
        let outcome = line.run();
        // Without work the threads end; what is still under way is dropped.
        line.work = None;
        let kept = line.writer.commit().map_err(|e| Stop::Failed(e.into()));
        outcome.and(kept)
    })
}

fn work_on(work: &Mutex<Receiver<(usize, Work<'_>)>>, made: &Sender<(usize, Made)>, pool: &Pool) {
    loop {
        let next = work.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok((number, work)) = next else { return };
        let tile = match &work {
            Work::Base(tile, _) | Work::Overview(tile, _) => *tile,
        };
        let outcome = catch_unwind(AssertUnwindSafe(|| match work {
            Work::Base(_, indices) => compose(tile, indices, pool),
            Work::Overview(_, children) => shrink(tile, &children),
        }))
        // An unanswered piece of work would stop the line for ever.
        .unwrap_or_else(|_| {
            Err(TileFailure::Store(StoreError::Encode { tile, reason: "the program has a fault here".into() }))
        })
        .map(|content| (tile, content));
        if made.send((number, outcome)).is_err() {
            return;
        }
    }
}

struct Line<'a, 'b> {
    work: Option<Sender<(usize, Work<'a>)>>,
    made: Receiver<(usize, Made)>,
    plan: &'a Plan,
    writer: &'b mut Writer,
    progress: &'b mut dyn FnMut(Progress) -> ControlFlow<()>,
    window: usize,
    done: usize,
    batch_bytes: usize,
    batch_start: Instant,
}

impl<'a> Line<'a, '_> {
    fn run(&mut self) -> Result<(), Stop> {
        let plan = self.plan;
        self.level(plan.base.len(), |_, i| {
            let (tile, indices) = &plan.base[i];
            Ok(Work::Base(*tile, indices))
        })?;
        for level in &plan.overviews {
            // A level reads the one below it, which is complete by now.
            self.level(level.len(), |writer, i| {
                let mut children = [None, None, None, None];
                for (slot, child) in children.iter_mut().zip(level[i].children().expect("an overview has children")) {
                    // A tile that is not wanted stands there until the build ends: it is no child any more.
                    if plan.wanted.contains_key(&child) {
                        *slot = writer.child(child).map_err(|e| Stop::Failed(e.into()))?;
                    }
                }
                Ok(Work::Overview(level[i], Box::new(children)))
            })?;
        }
        Ok(())
    }

    /// Feeds `count` pieces of work and puts what comes back, in their order.
    fn level(&mut self, count: usize, work: impl Fn(&Writer, usize) -> Result<Work<'a>, Stop>) -> Result<(), Stop> {
        let mut waiting: BTreeMap<usize, (TileId, Option<TileContent>)> = BTreeMap::new();
        let (mut fed, mut put) = (0, 0);
        while put < count {
            while fed < count && fed - put < self.window {
                let next = work(self.writer, fed)?;
                let sender = self.work.as_ref().expect("open until the run ends");
                sender.send((fed, next)).expect("the threads outlive the run");
                fed += 1;
            }
            let (number, outcome) = self.made.recv().expect("the threads answer every piece of work");
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
        let inputs_hash = self.plan.wanted[&tile];
        self.writer.put(&BuiltTile { tile, inputs_hash, content }).map_err(failed)?;
        self.done += 1;
        if self.batch_bytes > BATCH_BYTES || self.batch_start.elapsed() > BATCH_TIME {
            self.writer.commit().map_err(failed)?;
            (self.batch_bytes, self.batch_start) = (0, Instant::now());
        }
        let state = Progress { done: self.done, total: self.plan.jobs() };
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
