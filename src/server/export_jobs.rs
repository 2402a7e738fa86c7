//! `ExportJobs`: running and finished exports, each a file in a temporary folder that is removed with the service.

use super::dto::ExportProgress;
use super::error::ServerError;
use super::export_failure::ExportFailure;
use axum::http::StatusCode;
use overfly_core::geodesy::Geodetic;
use overfly_ingest::Remedy;
use overfly_ingest::export::ExportError;
use overfly_ingest::export::{ExportRequest, Exported, export};
use overfly_store::{Reader, StoreError};
use parking_lot::Mutex;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use tempfile::TempDir;

/// Most files that are kept; the one begun first is removed first.
const KEPT: usize = 16;

/// The exports of one store, in the order in which they were begun.
#[derive(Debug)]
pub(super) struct ExportJobs {
    folder: TempDir,
    jobs: Mutex<Vec<Arc<Job>>>,
}

/// The state of an export.
#[derive(Debug)]
pub(super) enum ExportJob {
    UnderWay(ExportProgress),
    Done { path: PathBuf, file_digest: String },
}

#[derive(Debug)]
struct Job {
    id: String,
    path: PathBuf,
    done: AtomicU64,
    total: AtomicU64,
    outcome: OnceLock<Result<Exported, ExportFailure>>,
}

impl ExportJobs {
    /// Makes a new folder for exports among the system's temporary files.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub(super) fn new() -> std::io::Result<Self> {
        let folder = tempfile::Builder::new().prefix("overfly-exports-").tempdir()?;
        Ok(Self { folder, jobs: Mutex::default() })
    }

    /// Begins an export on a thread of its own, unless the same export was begun before and did not fail.
    ///
    /// # Errors
    /// [`ServerError::Exporting`] if another one is being written.
    pub(super) fn begin(&self, store: &Arc<Reader>, request: ExportRequest) -> Result<ExportProgress, ServerError> {
        let id = export_id(store.digest(), &request);
        let mut jobs = self.jobs.lock();
        jobs.retain(|job| job.id != id || !job.is_lost());
        if let Some(job) = jobs.iter().find(|job| job.id == id) {
            return Ok(job.progress());
        }
        if jobs.iter().any(|job| job.outcome.get().is_none()) {
            return Err(ServerError::Exporting);
        }
        while jobs.len() >= KEPT {
            // A reader that has the file open can still read it.
            let _ = std::fs::remove_file(&jobs.remove(0).path);
        }
        // Something may have cleared the temporary files.
        std::fs::create_dir_all(self.folder.path()).map_err(|e| StoreError::io(self.folder.path(), e))?;
        let path = self.folder.path().join(format!("{id}.gpkg"));
        let (done, total, outcome) = (AtomicU64::new(0), AtomicU64::new(0), OnceLock::new());
        let job = Arc::new(Job { id, path, done, total, outcome });
        jobs.push(Arc::clone(&job));
        let (progress, store) = (job.progress(), Arc::clone(store));
        // A thread of its own: a runtime that shuts down would drop a task that has not begun, and the export would never end.
        std::thread::spawn(move || job.run(&store, &request));
        Ok(progress)
    }

    /// The state of an export.
    ///
    /// # Errors
    /// [`ServerError::NoExport`], or [`ServerError::Export`] with the reason of its failure.
    pub(super) fn find(&self, id: &str) -> Result<ExportJob, ServerError> {
        let mut jobs = self.jobs.lock();
        jobs.retain(|job| !matches!(job.outcome.get(), Some(Ok(_))) || job.path.exists());
        let job = jobs.iter().find(|job| job.id == id).ok_or(ServerError::NoExport)?;
        match job.outcome.get() {
            None => Ok(ExportJob::UnderWay(job.progress())),
            Some(Ok(exported)) => {
                Ok(ExportJob::Done { path: job.path.clone(), file_digest: exported.file_digest.clone() })
            }
            Some(Err(refusal)) => Err(ServerError::Export(refusal.clone())),
        }
    }
}

impl Job {
    fn run(&self, store: &Reader, request: &ExportRequest) {
        let progress = |done, total| {
            self.done.store(done, Ordering::Relaxed);
            self.total.store(total, Ordering::Relaxed);
        };
        // A panic must not leave the job running for ever.
        let outcome = catch_unwind(AssertUnwindSafe(|| export(store, request, &self.path, &progress)))
            .map(|outcome| outcome.map_err(|error| export_failure(&error, [store.path(), &self.path])))
            .unwrap_or_else(|_| Err(panicked()));
        // Only this function sets it.
        let _ = self.outcome.set(outcome);
    }

    /// Whether the export failed, or its file was removed.
    fn is_lost(&self) -> bool {
        self.outcome.get().is_some_and(|outcome| outcome.is_err() || !self.path.exists())
    }

    fn progress(&self) -> ExportProgress {
        ExportProgress {
            id: self.id.clone(),
            done: self.outcome.get().is_some(),
            tiles_done: self.done.load(Ordering::Relaxed),
            tiles: self.total.load(Ordering::Relaxed),
        }
    }
}

fn panicked() -> ExportFailure {
    let error = ServerError::Panicked;
    ExportFailure { status: error.status(), code: error.code(), detail: error.to_string() }
}

/// The failure in words that do not contain the server's own paths.
fn export_failure(error: &ExportError, paths: [&Path; 2]) -> ExportFailure {
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

/// The name of an export: equal for equal requests of the same store, however they are written.
fn export_id(digest: &str, request: &ExportRequest) -> String {
    let place = |p: &Geodetic| [p.longitude_deg(), p.latitude_deg()];
    let routes: Vec<Vec<[f64; 2]>> = request.routes.iter().map(|r| r.points().iter().map(place).collect()).collect();
    let ExportRequest { corridor_m, layers, max_bytes, jpeg_quality, .. } = request;
    let valid_until = request.valid_until.map(|date| date.to_string());
    let asked = (digest, routes, corridor_m, layers, max_bytes, jpeg_quality, valid_until);
    let text = serde_json::to_string(&asked).expect("numbers and texts serialise");
    blake3::hash(text.as_bytes()).to_hex().to_string()
}
