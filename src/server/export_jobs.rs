//! `ExportJobs`: running and finished exports, each a file in a temporary folder that is removed with the service.

use super::dto::{ExportEntry, ExportProgress};
use super::error::ServerError;
use super::export_failure::ExportFailure;
use super::export_folder::ExportFolder;
use super::export_job::Job;
use super::export_limits::ExportLimits;
use axum::http::StatusCode;
use overfly_core::geodesy::Geodetic;
use overfly_ingest::export::ExportRequest;
use overfly_store::{Reader, StoreError};
use parking_lot::Mutex;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// How often exports that are too old are looked for.
const TIDY: Duration = Duration::from_secs(60);

/// The exports of one store, in the order in which they were begun.
#[derive(Debug)]
pub(super) struct ExportJobs {
    folder: ExportFolder,
    limits: ExportLimits,
    jobs: Mutex<Vec<Arc<Job>>>,
}

/// The state of an export.
#[derive(Debug)]
pub(super) enum ExportJob {
    UnderWay(ExportProgress),
    Done { path: PathBuf, file_digest: String },
}

impl ExportJobs {
    /// Makes a new folder for exports among the system's temporary files, and removes what killed services left there. Exports that
    /// become too old are removed until the jobs are dropped.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub(super) fn new(limits: ExportLimits) -> std::io::Result<Arc<Self>> {
        let folder = ExportFolder::within(&std::env::temp_dir())?;
        let jobs = Arc::new(Self { folder, limits, jobs: Mutex::default() });
        let weak = Arc::downgrade(&jobs);
        std::thread::spawn(move || {
            loop {
                std::thread::sleep(TIDY);
                match weak.upgrade() {
                    Some(jobs) => jobs.remove_old(&mut jobs.jobs.lock()),
                    None => return,
                }
            }
        });
        Ok(jobs)
    }

    /// Begins an export on a thread of its own, unless the same export was begun before and did not fail.
    ///
    /// # Errors
    /// [`ServerError::Exporting`] if another one is being written.
    pub(super) fn begin(
        self: &Arc<Self>,
        store: &Arc<Reader>,
        request: ExportRequest,
    ) -> Result<ExportProgress, ServerError> {
        let id = export_id(store.digest(), &request);
        let mut jobs = self.jobs.lock();
        jobs.retain(|job| job.id != id || !job.is_lost());
        self.remove_old(&mut jobs);
        if let Some(job) = jobs.iter().find(|job| job.id == id) {
            return Ok(job.progress());
        }
        if jobs.iter().any(|job| job.outcome().is_none()) {
            return Err(ServerError::Exporting);
        }
        while jobs.len() >= self.limits.count.max(1) {
            jobs.remove(0).remove_file();
        }
        let folder = self.folder.path().map_err(|e| StoreError::io(&std::env::temp_dir(), e))?;
        let path = folder.join(format!("{id}.gpkg"));
        let job = Arc::new(Job::new(id, path));
        jobs.push(Arc::clone(&job));
        let (progress, store, all) = (job.progress(), Arc::clone(store), Arc::downgrade(self));
        // A thread of its own: a runtime that shuts down would drop a task that has not begun, and the export would never end.
        std::thread::spawn(move || {
            let make_room = |bytes| all.upgrade().map_or(Ok(()), |all| all.make_room(bytes));
            job.run(&store, &request, &make_room);
        });
        Ok(progress)
    }

    /// The state of an export.
    ///
    /// # Errors
    /// [`ServerError::NoExport`], or [`ServerError::Export`] with the reason of its failure.
    pub(super) fn find(&self, id: &str) -> Result<ExportJob, ServerError> {
        let mut jobs = self.jobs.lock();
        self.remove_old(&mut jobs);
        let job = jobs.iter().find(|job| job.id == id).ok_or(ServerError::NoExport)?;
        match job.outcome() {
            None => Ok(ExportJob::UnderWay(job.progress())),
            Some(Ok(exported)) => {
                Ok(ExportJob::Done { path: job.path.clone(), file_digest: exported.file_digest.clone() })
            }
            Some(Err(refusal)) => Err(ServerError::Export(refusal.clone())),
        }
    }

    /// All exports, the one begun first first.
    pub(super) fn list(&self) -> Vec<ExportEntry> {
        let mut jobs = self.jobs.lock();
        self.remove_old(&mut jobs);
        jobs.iter().map(|job| job.entry()).collect()
    }

    /// Removes an export and its file.
    ///
    /// # Errors
    /// [`ServerError::NoExport`]; [`ServerError::ExportUnderWay`] while it is being written.
    pub(super) fn delete(&self, id: &str) -> Result<(), ServerError> {
        let mut jobs = self.jobs.lock();
        let at = jobs.iter().position(|job| job.id == id).ok_or(ServerError::NoExport)?;
        if jobs[at].outcome().is_none() {
            return Err(ServerError::ExportUnderWay);
        }
        jobs.remove(at).remove_file();
        Ok(())
    }

    /// Removes exports that are too old, and forgets those whose files are gone.
    fn remove_old(&self, jobs: &mut Vec<Arc<Job>>) {
        jobs.retain(|job| {
            let is_old = job.age().is_some_and(|age| age > self.limits.age);
            if is_old {
                job.remove_file();
            }
            let is_gone = matches!(job.outcome(), Some(Ok(_))) && !job.path.exists();
            !(is_old || is_gone)
        });
    }

    /// Removes finished exports, oldest first, until `bytes` more may be held.
    fn make_room(&self, bytes: u64) -> Result<(), ExportFailure> {
        let most = self.limits.bytes;
        if bytes > most {
            let detail = format!(
                "the export has {bytes} bytes, more than the {most} that the service keeps; narrow the corridor, shorten the \
                 route, name fewer layers, or state `max_bytes`"
            );
            return Err(ExportFailure { status: StatusCode::UNPROCESSABLE_ENTITY, code: "export_too_large", detail });
        }
        let mut jobs = self.jobs.lock();
        while jobs.iter().map(|job| job.bytes()).sum::<u64>() > most - bytes {
            let Some(at) = jobs.iter().position(|job| job.bytes() > 0) else { break };
            jobs.remove(at).remove_file();
        }
        Ok(())
    }
}

/// The name of an export: equal for equal requests of the same store, however they are written.
fn export_id(digest: &str, request: &ExportRequest) -> String {
    let place = |p: &Geodetic| [p.longitude_deg(), p.latitude_deg()];
    let routes: Vec<Vec<[f64; 2]>> = request.routes.iter().map(|r| r.points().iter().map(place).collect()).collect();
    let ExportRequest { corridor_m, layers, max_bytes, jpeg_quality, name, serial, .. } = request;
    let valid_until = request.valid_until.map(|date| date.to_string());
    let asked = (digest, routes, corridor_m, layers, max_bytes, jpeg_quality, valid_until, name, serial);
    let text = serde_json::to_string(&asked).expect("numbers and texts serialise");
    blake3::hash(text.as_bytes()).to_hex().to_string()
}
