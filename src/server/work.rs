//! `Work`: blocking jobs off the event loop, so many at once, so long at most.

use super::error::ServerError;
use super::state::Limits;
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

/// The places at the work bench.
#[derive(Debug, Clone)]
pub(super) struct Work {
    questions: Arc<Semaphore>,
    registrations: Arc<Semaphore>,
    uploads: Arc<Semaphore>,
    time: Duration,
}

impl Work {
    pub(super) fn new(limits: &Limits) -> Self {
        let places = |n: usize| Arc::new(Semaphore::new(n.max(1)));
        Self {
            questions: places(limits.questions),
            registrations: places(limits.registrations),
            uploads: places(limits.uploads),
            time: limits.answer_time,
        }
    }

    /// Runs a job on a blocking thread once a place is free.
    ///
    /// # Errors
    /// [`ServerError::TimeLimit`] where waiting and working take too long (the job itself runs on and keeps its place
    /// until it ends), [`ServerError::Panicked`] where it panics.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        load: Load,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ServerError> {
        let places = match load {
            Load::Question => &self.questions,
            Load::Registration => &self.registrations,
        };
        let outcome = tokio::time::timeout(self.time, async {
            let place = places.clone().acquire_owned().await.expect("the semaphore is never closed");
            tokio::task::spawn_blocking(move || {
                let _place = place;
                job()
            })
            .await
        });
        match outcome.await {
            Err(_) => Err(ServerError::TimeLimit { limit_s: self.time.as_secs_f64() }),
            Ok(Err(_)) => Err(ServerError::Panicked),
            Ok(Ok(answer)) => Ok(answer),
        }
    }

    /// A place to hold an upload in memory.
    ///
    /// # Errors
    /// [`ServerError::Busy`] where all are taken.
    pub(super) fn upload(&self) -> Result<OwnedSemaphorePermit, ServerError> {
        self.uploads.clone().try_acquire_owned().map_err(|_| ServerError::Busy)
    }
}
