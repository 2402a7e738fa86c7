//! `ServiceState`: the state that all handlers share.

use super::access::Access;
use super::limits::Limits;
use super::metrics::Metrics;
use super::service::Service;
use super::work::Work;
use overfly_flight::locate::candidates::Residents;
use overfly_store::Reader;
use std::sync::Arc;

/// A store opened for reading, and the limits of the service. Cheap to clone.
#[derive(Debug, Clone)]
pub struct ServiceState {
    pub(super) store: Arc<Reader>,
    pub(super) residents: Arc<Residents>,
    pub(super) service: Service,
    pub(super) limits: Limits,
    pub(super) work: Work,
    pub(super) metrics: Metrics,
    pub(super) warnings: Arc<[String]>,
    pub(super) access: Arc<Access>,
}

impl ServiceState {
    /// The state of a service over `store`.
    pub fn new(store: Reader, service: Service, limits: Limits) -> Self {
        let (work, metrics) = (Work::new(&limits), Metrics::new());
        let residents = Arc::new(Residents::new(limits.index_bytes).giving(limits.tiles));
        let store = Arc::new(store);
        Self { store, residents, service, limits, work, metrics, warnings: Arc::new([]), access: Arc::default() }
    }

    /// The same state with warnings, which every health report includes.
    pub fn with_warnings(self, warnings: Vec<String>) -> Self {
        Self { warnings: warnings.into(), ..self }
    }

    /// The same state, to be used only by whom `access` admits.
    pub fn with_access(self, access: Access) -> Self {
        Self { access: Arc::new(access), ..self }
    }
}
