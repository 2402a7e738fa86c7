//! `Job`: one export, while it is being written and after it has ended.

use super::dto::{ExportEntry, ExportProgress, ExportStatus};
use super::error::ServerError;
use super::export_failure::ExportFailure;
use axum::http::StatusCode;
use overfly_ingest::Remedy;
use overfly_ingest::export::{ExportError, ExportRequest, Exported, export, preview};
use overfly_store::Reader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// One export.
#[derive(Debug)]
pub(super) struct Job {
    pub id: String,
    pub path: PathBuf,
    done: AtomicU64,
    total: AtomicU64,
    ended: OnceLock<Ended>,
}

/// How an export ended, and when.
#[derive(Debug)]
struct Ended {
    at: Instant,
    outcome: Result<Exported, ExportFailure>,
}

/// Makes room for so many bytes, or says why there is none.
pub(super) type MakeRoom<'a> = dyn Fn(u64) -> Result<(), ExportFailure> + 'a;

impl Job {
    /// An export to be written to `path`.
    pub fn new(id: String, path: PathBuf) -> Self {
        Self { id, path, done: AtomicU64::new(0), total: AtomicU64::new(0), ended: OnceLock::new() }
    }

    /// Writes the export. Room is made for its content beforehand, and for the whole file at the end.
    pub fn run(&self, store: &Reader, request: &ExportRequest, make_room: &MakeRoom<'_>) {
        // A panic must not leave the job running for ever.
        let outcome = catch_unwind(AssertUnwindSafe(|| self.write(store, request, make_room)))
            .unwrap_or_else(|_| Err(panicked()));
        // Only this function sets it.
        let _ = self.ended.set(Ended { at: Instant::now(), outcome });
    }

    fn write(
        &self,
        store: &Reader,
        request: &ExportRequest,
        make_room: &MakeRoom<'_>,
    ) -> Result<Exported, ExportFailure> {
        let paths = [store.path(), &self.path];
        let failed = |error: ExportError| export_failure(&error, paths);
        let content = preview(store, request).map_err(failed)?.bytes;
        make_room(content.min(request.max_bytes.unwrap_or(u64::MAX)))?;
        let progress = |done, total| {
            self.done.store(done, Ordering::Relaxed);
            self.total.store(total, Ordering::Relaxed);
        };
        let exported = export(store, request, &self.path, &progress).map_err(failed)?;
        make_room(exported.bytes).inspect_err(|_| self.remove_file())?;
        Ok(exported)
    }

    /// What the file holds, or why there is none; `None` while it is being written.
    pub fn outcome(&self) -> Option<&Result<Exported, ExportFailure>> {
        self.ended.get().map(|ended| &ended.outcome)
    }

    /// The time since the export ended.
    pub fn age(&self) -> Option<Duration> {
        self.ended.get().map(|ended| ended.at.elapsed())
    }

    /// Size of the finished file, bytes; 0 if there is none.
    pub fn bytes(&self) -> u64 {
        self.outcome().and_then(|outcome| outcome.as_ref().ok()).map_or(0, |exported| exported.bytes)
    }

    /// Whether the export failed, or its file was removed.
    pub fn is_lost(&self) -> bool {
        self.outcome().is_some_and(|outcome| outcome.is_err() || !self.path.exists())
    }

    /// Removes the file. A reader that has it open can still read it.
    pub fn remove_file(&self) {
        let _ = std::fs::remove_file(&self.path);
    }

    /// How much is written.
    pub fn progress(&self) -> ExportProgress {
        let done = self.outcome().is_some();
        ExportProgress {
            status: if done { ExportStatus::Done } else { ExportStatus::UnderWay },
            id: self.id.clone(),
            done,
            tiles_done: self.done.load(Ordering::Relaxed),
            tiles: self.total.load(Ordering::Relaxed),
        }
    }

    /// The export as it is listed.
    pub fn entry(&self) -> ExportEntry {
        let ExportProgress { id, done, tiles_done, tiles, .. } = self.progress();
        ExportEntry {
            id,
            done,
            tiles_done,
            tiles,
            bytes: Some(self.bytes()).filter(|bytes| *bytes > 0),
            error: self.outcome().and_then(|outcome| outcome.as_ref().err()).map(|failure| failure.code),
            age_s: self.age().map(|age| age.as_secs_f64()),
        }
    }
}

fn panicked() -> ExportFailure {
    let error = ServerError::Panicked;
    ExportFailure { status: error.status(), code: error.code(), detail: error.to_string() }
}

/// The failure in words that do not contain the server's own paths.
pub(super) fn export_failure(error: &ExportError, paths: [&Path; 2]) -> ExportFailure {
    let text = with_remedy(error);
    let named = paths.iter().find_map(|path| text.strip_prefix(&format!("{}: ", path.display())));
    let status =
        if error.is_unusable_input() { StatusCode::UNPROCESSABLE_ENTITY } else { StatusCode::INTERNAL_SERVER_ERROR };
    if status == StatusCode::INTERNAL_SERVER_ERROR {
        tracing::error!(code = error.code(), "export: {text}");
    }
    ExportFailure { status, code: error.code(), detail: named.unwrap_or(&text).to_owned() }
}

/// The error's message with its remedy, as a caller of the service can follow it.
fn with_remedy(error: &ExportError) -> String {
    let remedy = match error.remedy() {
        Some(Remedy::CheckRoute) => "check that it is the right route, and that its positions are longitude first",
        Some(Remedy::ReduceExport) => "narrow the corridor, shorten the route, or name fewer layers",
        _ => return error.to_string(),
    };
    format!("{error}; {remedy}")
}
