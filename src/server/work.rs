//! `Work`: blocking jobs off the event loop, so many at once, so long at most.

use super::error::ServerError;
use super::limits::Limits;
use overfly_flight::locate::CancellationToken;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// How heavy a job is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Load {
    /// Reads the store: milliseconds, rarely a second.
    Question,
    /// Decodes and registers images.
    Registration,
}

/// Cancels a job when it is dropped: when the time limit is reached or the caller is gone.
struct CancelOnDrop(CancellationToken);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

/// The places at the work bench.
#[derive(Debug, Clone)]
pub(super) struct Work {
    questions: Arc<Semaphore>,
    registrations: Arc<Semaphore>,
    uploads: Arc<Semaphore>,
    /// In KiB.
    uploads_room: Arc<Semaphore>,
    time: Duration,
}

impl Work {
    pub(super) fn new(limits: &Limits) -> Self {
        let places = |n: usize| Arc::new(Semaphore::new(n.max(1)));
        Self {
            questions: places(limits.questions),
            registrations: places(limits.registrations),
            uploads: places(limits.uploads),
            uploads_room: places(kib(limits.uploads_bytes) as usize),
            time: limits.answer_time,
        }
    }

    /// Runs a job on a blocking thread once a place is free.
    ///
    /// # Errors
    /// As [`Work::run_cancellable`].
    pub(super) async fn run<T: Send + 'static>(
        &self,
        load: Load,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ServerError> {
        self.run_cancellable(load, move |_| job()).await
    }

    /// As [`Work::run`]; the job's token is cancelled when the time limit is reached or the caller is gone. The job keeps its place
    /// until it ends.
    ///
    /// # Errors
    /// [`ServerError::TimeLimit`] where waiting and working take too long, [`ServerError::Panicked`] where it panics.
    pub(super) async fn run_cancellable<T: Send + 'static>(
        &self,
        load: Load,
        job: impl FnOnce(&CancellationToken) -> T + Send + 'static,
    ) -> Result<T, ServerError> {
        let cancellation = CancellationToken::new();
        let _cancel_on_drop = CancelOnDrop(cancellation.clone());
        let places = match load {
            Load::Question => &self.questions,
            Load::Registration => &self.registrations,
        };
        let outcome = tokio::time::timeout(self.time, async {
            let place = places.clone().acquire_owned().await.expect("the semaphore is never closed");
            tokio::task::spawn_blocking(move || {
                let _place = place;
                job(&cancellation)
            })
            .await
        });
        match outcome.await {
            Err(_) => Err(ServerError::TimeLimit { limit_s: self.time.as_secs_f64() }),
            Ok(Err(_)) => Err(ServerError::Panicked),
            Ok(Ok(answer)) => Ok(answer),
        }
    }

    /// A place to hold an upload of at most so many bytes in memory.
    ///
    /// # Errors
    /// [`ServerError::Busy`] where all are taken.
    pub(super) fn upload(&self, bytes: usize) -> Result<Upload, ServerError> {
        let busy = |_| ServerError::Busy;
        let place = self.uploads.clone().try_acquire_owned().map_err(busy)?;
        let room = self.uploads_room.clone().try_acquire_many_owned(kib(bytes)).map_err(busy)?;
        Ok(Upload { _place: place, _room: room })
    }
}

/// A place for an upload; free again when dropped.
#[derive(Debug)]
pub(super) struct Upload {
    _place: OwnedSemaphorePermit,
    _room: OwnedSemaphorePermit,
}

fn kib(bytes: usize) -> u32 {
    u32::try_from(bytes / 1024).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uploads_are_held_within_their_bytes_and_their_number() {
        let work = Work::new(&Limits { uploads: 3, uploads_bytes: 100 << 10, ..Limits::default() });
        let first = work.upload(60 << 10).unwrap();
        assert!(matches!(work.upload(60 << 10), Err(ServerError::Busy)));
        let second = work.upload(40 << 10).unwrap();
        drop((first, second));
        let few: Vec<_> = (0..3).map(|_| work.upload(10).unwrap()).collect();
        assert!(matches!(work.upload(10), Err(ServerError::Busy)), "three are held: {}", few.len());
    }
}
