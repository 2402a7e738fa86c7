//! `StoreSlot`: the store that the service serves now. If its file is replaced, the new store is opened with the checks of the start.

use super::error::ServerError;
use super::limits::Limits;
use super::store_refusal::StoreRefusal;
use super::work::{Work, WorkClass};
use overfly_flight::locate::candidates::Residents;
use overfly_store::{FileStamp, Reader, StoreError};
use parking_lot::Mutex;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The shortest time between two attempts to open a store that was refused.
const RETRY: Duration = Duration::from_secs(2);

/// A file that was not written for so long is complete: a copy that is under way writes more often.
const SETTLED: Duration = Duration::from_millis(500);

/// A store that is open, with its indexes. A request uses one from beginning to end.
#[derive(Debug, Clone)]
pub(super) struct OpenStore {
    pub reader: Arc<Reader>,
    pub residents: Arc<Residents>,
    pub warnings: Arc<[String]>,
    /// When it took the place of another store; `None` for the store of the start.
    pub reopened: Option<Instant>,
}

impl OpenStore {
    /// A store with empty indexes.
    pub fn new(reader: Reader, limits: &Limits) -> Self {
        let residents = Arc::new(Residents::new(limits.index_bytes).giving(limits.tiles));
        Self { reader: Arc::new(reader), residents, warnings: Arc::new([]), reopened: None }
    }
}

/// Opens the store anew, with the checks of the start. Returns it with its warnings.
pub(super) type Reopen = dyn Fn() -> Result<(Reader, Vec<String>), StoreRefusal> + Send + Sync;

/// The store that is served now, and how to open the one that replaces it.
pub(super) struct StoreSlot {
    now: Mutex<OpenStore>,
    limits: Limits,
    reopen: Option<Arc<Reopen>>,
    /// Held by the request that opens the store.
    turn: tokio::sync::Mutex<()>,
    /// The last attempt, if it failed.
    refused: Mutex<Option<(Instant, StoreRefusal)>>,
}

impl StoreSlot {
    /// A slot with a store; without `reopen`, a store that is replaced is not served any more.
    pub fn new(store: OpenStore, limits: Limits, reopen: Option<Arc<Reopen>>) -> Self {
        Self { now: Mutex::new(store), limits, reopen, turn: tokio::sync::Mutex::default(), refused: Mutex::default() }
    }

    /// The store that was served last. Its file may have changed.
    pub fn last(&self) -> OpenStore {
        self.now.lock().clone()
    }

    /// Why the store that replaces the one served last is refused, if it is.
    pub fn refusal(&self) -> Option<StoreRefusal> {
        self.refused.lock().as_ref().map(|(_, refusal)| refusal.clone())
    }

    /// The store in the file. If the file was replaced or built anew, the new store is opened.
    ///
    /// # Errors
    /// [`StoreError::Changed`] where it is not opened anew, [`ServerError::Replaced`] where the new store is refused, and where the
    /// store is damaged.
    pub async fn current(&self, work: &Work) -> Result<OpenStore, ServerError> {
        let store = self.last();
        let reader = store.reader.clone();
        match work.run(WorkClass::Short, move || reader.check_unchanged()).await? {
            Ok(()) => {
                *self.refused.lock() = None;
                Ok(store)
            }
            Err(error) => self.replaced(&store, error, work).await,
        }
    }

    async fn replaced(&self, old: &OpenStore, error: StoreError, work: &Work) -> Result<OpenStore, ServerError> {
        let Some(reopen) = self.reopen.clone() else { return Err(error.into()) };
        let _turn = self.turn.lock().await;
        let now = self.last();
        if !Arc::ptr_eq(&now.reader, &old.reader) {
            return Ok(now);
        }
        let recent = self.refused.lock().clone().filter(|(at, _)| at.elapsed() < RETRY);
        if let Some((_, refusal)) = recent {
            return Err(ServerError::Replaced(refusal));
        }
        match open_settled(reopen, now.reader.path().to_owned(), work).await? {
            Ok((reader, warnings)) => {
                let new = OpenStore {
                    warnings: warnings.into(),
                    reopened: Some(Instant::now()),
                    ..OpenStore::new(reader, &self.limits)
                };
                tracing::info!(digest = new.reader.digest(), "the store was replaced: the new one is served");
                *self.refused.lock() = None;
                *self.now.lock() = new.clone();
                Ok(new)
            }
            Err(refusal) => {
                tracing::warn!(
                    code = refusal.code,
                    "the store was replaced, the new one is refused: {}",
                    refusal.reason
                );
                *self.refused.lock() = Some((Instant::now(), refusal.clone()));
                Err(ServerError::Replaced(refusal))
            }
        }
    }
}

type Opened = Result<(Reader, Vec<String>), StoreRefusal>;

/// Opens a store whose file is not being written: half a copy could pass for a whole store.
async fn open_settled(reopen: Arc<Reopen>, path: PathBuf, work: &Work) -> Result<Opened, ServerError> {
    let seen = stamp(path.clone(), work).await?;
    if seen.is_some_and(|seen| !seen.is_older_than(SETTLED)) {
        tokio::time::sleep(SETTLED).await;
        if stamp(path.clone(), work).await? != seen {
            return Ok(Err(being_written()));
        }
    }
    let opened = work.run(WorkClass::Query, move || reopen()).await?;
    let is_same = opened.is_err() || stamp(path, work).await? == seen;
    Ok(if is_same { opened } else { Err(being_written()) })
}

/// The stamp of a file; `None` where there is none.
async fn stamp(path: PathBuf, work: &Work) -> Result<Option<FileStamp>, ServerError> {
    work.run(WorkClass::Short, move || FileStamp::read(&path).ok()).await
}

fn being_written() -> StoreRefusal {
    StoreRefusal { code: "being_written", reason: "the file is still being written".to_owned() }
}

impl fmt::Debug for StoreSlot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("StoreSlot").field("now", &self.now).finish_non_exhaustive()
    }
}
