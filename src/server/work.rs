//! `Work`: runs blocking jobs off the event loop, with limits on their number and on their time.

use super::error::ServerError;
use super::giving_way::{GivingWay, OptionalWork};
use super::limits::Limits;
use overfly_flight::locate::CancellationToken;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// A class of work, with a concurrency limit of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WorkClass {
    /// Takes milliseconds whatever is asked: candidates, and the check that the file is the one that was opened. Its places are its
    /// own, so that neither tiles nor coverage can delay an aircraft's search.
    Short,
    /// Reads the store: takes milliseconds, rarely a second.
    Query,
    /// Parses a large body, or selects the tiles of an export.
    #[cfg(feature = "preflight")]
    Parsing,
    /// Decodes and registers images.
    Registration,
}

/// Most short jobs at the same time.
const SHORT: usize = 4;

/// Cancels a job when it is dropped: when the time limit is reached or the caller is gone.
struct CancelOnDrop(CancellationToken);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

/// Concurrency limits per class of work.
#[derive(Debug, Clone)]
pub(super) struct Work {
    short: Arc<Semaphore>,
    questions: Arc<Semaphore>,
    #[cfg(feature = "preflight")]
    parsing: Arc<Semaphore>,
    registrations: Arc<Semaphore>,
    way: GivingWay,
    uploads: Arc<Semaphore>,
    /// Memory for uploads, KiB.
    uploads_room: Arc<Semaphore>,
    time: Duration,
}

impl Work {
    pub(super) fn new(limits: &Limits) -> Self {
        let places = |n: usize| Arc::new(Semaphore::new(n.max(1)));
        Self {
            short: places(SHORT),
            questions: places(limits.questions),
            #[cfg(feature = "preflight")]
            parsing: places(1),
            registrations: places(limits.registrations),
            way: GivingWay::default(),
            uploads: places(limits.uploads),
            uploads_room: places(kib(limits.uploads_bytes) as usize),
            time: limits.answer_time,
        }
    }

    /// Runs a job on a blocking thread, once its class has a free place.
    ///
    /// # Errors
    /// As [`Work::run_cancellable`].
    pub(super) async fn run<T: Send + 'static>(
        &self,
        class: WorkClass,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ServerError> {
        self.run_cancellable(class, move |_| job()).await
    }

    /// As [`Work::run`]; the job's token is cancelled when the time limit is reached or the caller is gone. The job keeps its place
    /// until it ends.
    ///
    /// # Errors
    /// [`ServerError::TimeLimit`] if waiting and working take too long, [`ServerError::Panicked`] if the job panics.
    pub(super) async fn run_cancellable<T: Send + 'static>(
        &self,
        class: WorkClass,
        job: impl FnOnce(&CancellationToken) -> T + Send + 'static,
    ) -> Result<T, ServerError> {
        let cancellation = CancellationToken::new();
        let _cancel_on_drop = CancelOnDrop(cancellation.clone());
        let places = match class {
            WorkClass::Short => &self.short,
            WorkClass::Query => &self.questions,
            #[cfg(feature = "preflight")]
            WorkClass::Parsing => &self.parsing,
            WorkClass::Registration => &self.registrations,
        };
        let outcome = tokio::time::timeout(self.time, async {
            let place = match places.clone().try_acquire_owned() {
                Ok(place) => place,
                Err(_) => {
                    let _waiting = (class == WorkClass::Registration).then(|| self.way.wait());
                    places.clone().acquire_owned().await.expect("the semaphore is never closed")
                }
            };
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

    /// Begins a part of a registration's work that can be left out: its token is cancelled when another registration waits for the
    /// place, and with `cancellation`.
    pub(super) fn begin_optional(&self, cancellation: &CancellationToken) -> OptionalWork {
        self.way.begin_optional(cancellation)
    }

    /// Begins an upload of about `bytes`. Memory is reserved as they arrive, a place when all have arrived: a slow client must not
    /// stop others.
    ///
    /// # Errors
    /// [`ServerError::Busy`] if too many uploads are in progress, or too large ones.
    pub(super) fn begin_upload(&self, bytes: usize) -> Result<ArrivingUpload, ServerError> {
        let has_room = self.uploads_room.available_permits() >= kib(bytes) as usize;
        if !has_room || self.uploads.available_permits() == 0 {
            return Err(ServerError::Busy);
        }
        let (places, all_room) = (self.uploads.clone(), self.uploads_room.clone());
        Ok(ArrivingUpload { places, all_room, room: None, bytes: 0 })
    }
}

/// Memory for an upload of which a part has arrived; released when dropped.
#[derive(Debug)]
pub(super) struct ArrivingUpload {
    places: Arc<Semaphore>,
    all_room: Arc<Semaphore>,
    room: Option<OwnedSemaphorePermit>,
    bytes: usize,
}

impl ArrivingUpload {
    /// Reserves memory for further bytes.
    ///
    /// # Errors
    /// [`ServerError::Busy`] if there is no more.
    pub(super) fn grow(&mut self, bytes: usize) -> Result<(), ServerError> {
        self.bytes += bytes;
        let held = self.room.as_ref().map_or(0, OwnedSemaphorePermit::num_permits);
        let more = (kib(self.bytes) as usize).saturating_sub(held);
        let more = self.all_room.clone().try_acquire_many_owned(kib(more * 1024)).map_err(|_| ServerError::Busy)?;
        match &mut self.room {
            Some(room) => room.merge(more),
            room => *room = Some(more),
        }
        Ok(())
    }

    /// The upload, all of which has arrived.
    ///
    /// # Errors
    /// [`ServerError::Busy`] if too many others are in memory.
    pub(super) fn finish(self) -> Result<Upload, ServerError> {
        let place = self.places.try_acquire_owned().map_err(|_| ServerError::Busy)?;
        Ok(Upload { _place: place, _room: self.room })
    }
}

/// Reserved memory for an upload; released when dropped.
#[derive(Debug)]
pub(super) struct Upload {
    _place: OwnedSemaphorePermit,
    _room: Option<OwnedSemaphorePermit>,
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
        let upload = |bytes: usize| {
            let mut arriving = work.begin_upload(bytes)?;
            arriving.grow(bytes)?;
            arriving.finish()
        };
        let first = upload(60 << 10).unwrap();
        assert!(matches!(upload(60 << 10), Err(ServerError::Busy)));
        let second = upload(40 << 10).unwrap();
        drop((first, second));
        let few: Vec<_> = (0..3).map(|_| upload(10).unwrap()).collect();
        assert!(matches!(upload(10), Err(ServerError::Busy)), "three are held: {}", few.len());
    }

    #[test]
    fn an_upload_holds_what_has_arrived_of_it_and_no_place() {
        let work = Work::new(&Limits { uploads: 3, uploads_bytes: 100 << 10, ..Limits::default() });
        let mut slow: Vec<_> = (0..50).map(|_| work.begin_upload(90 << 10).unwrap()).collect();
        slow.iter_mut().for_each(|upload| upload.grow(1024).unwrap());
        assert!(work.begin_upload(50 << 10).is_ok() && matches!(work.begin_upload(51 << 10), Err(ServerError::Busy)));
        slow[0].grow(20 << 10).unwrap();
        slow[0].grow(20 << 10).unwrap();
        assert!(matches!(slow[0].grow(20 << 10), Err(ServerError::Busy)), "41 of 51 KiB are held");
        drop(slow);
        assert!(work.begin_upload(100 << 10).is_ok(), "all is released");
    }
}
