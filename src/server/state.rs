//! `ServiceState`: what every handler shares.

use super::error::ServerError;
use super::export_jobs::ExportJobs;
use super::metrics::Metrics;
use super::work::Work;
use crate::locate::candidates::Residents;
use crate::pixels::Gray;
use crate::raster::{FrameBounds, decode_frame_within};
use crate::store::Reader;
use std::sync::Arc;
use std::time::Duration;

/// Where the service runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Service {
    /// On the ground.
    Preflight,
    /// On the aircraft: no route that writes exists.
    Onboard,
}

/// Bounds on what one request may cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest request body, bytes.
    pub body_bytes: usize,
    /// Longest wait for a request's body.
    pub body_time: Duration,
    /// Longest wait for an answer.
    pub answer_time: Duration,
    /// Longest edge of an uploaded image, pixels.
    pub image_edge_px: u32,
    /// Most pixels of an uploaded image.
    pub image_px: u64,
    /// Uploads read at once.
    pub uploads: usize,
    /// Images decoded and registered at once; each takes about 10 bytes a pixel.
    pub registrations: usize,
    /// Other questions answered at once.
    pub questions: usize,
    /// Threads of one registration.
    pub threads: usize,
    /// Memory for indexes of footprints, bytes; what does not fit is answered from the file.
    pub index_bytes: u64,
}

impl Limits {
    /// The camera frame in `bytes`, the form's part `part`.
    pub(super) fn frame(&self, part: &'static str, bytes: &[u8]) -> Result<Gray, ServerError> {
        let bounds = FrameBounds { edge_px: self.image_edge_px, pixels: self.image_px };
        decode_frame_within(bytes, part, bounds).map_err(|error| ServerError::Frame { part, error })
    }
}

impl Default for Limits {
    fn default() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            body_bytes: 48 << 20,
            body_time: Duration::from_secs(30),
            answer_time: Duration::from_secs(60),
            image_edge_px: 20_000,
            image_px: 64_000_000,
            uploads: 8,
            registrations: 2,
            questions: 4 * cores,
            threads: cores,
            index_bytes: 256 << 20,
        }
    }
}

/// A store opened for reading, and the bounds under which it is asked. Cheap to clone.
#[derive(Debug, Clone)]
pub struct ServiceState {
    pub(super) store: Arc<Reader>,
    pub(super) residents: Arc<Residents>,
    pub(super) service: Service,
    pub(super) limits: Limits,
    pub(super) work: Work,
    pub(super) metrics: Metrics,
    pub(super) warnings: Arc<[String]>,
    /// On the ground.
    pub(super) exports: Option<Arc<ExportJobs>>,
}

impl ServiceState {
    /// The state of a service over `store`. On the ground it gets a temporary folder for exports; where none can be made,
    /// there are no exports, and the log says so.
    pub fn new(store: Reader, service: Service, limits: Limits) -> Self {
        let (work, metrics) = (Work::new(&limits), Metrics::new());
        let residents = Arc::new(Residents::new(limits.index_bytes));
        let exports = match service {
            Service::Onboard => None,
            Service::Preflight => ExportJobs::new()
                .inspect_err(|e| tracing::warn!("no exports over HTTP: no temporary folder can be made: {e}"))
                .ok(),
        };
        let (store, exports) = (Arc::new(store), exports.map(Arc::new));
        Self { store, residents, service, limits, work, metrics, warnings: Arc::new([]), exports }
    }

    /// The same with something to warn of in every statement of its health.
    pub fn with_warnings(self, warnings: Vec<String>) -> Self {
        Self { warnings: warnings.into(), ..self }
    }
}
