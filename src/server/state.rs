//! `ServiceState`: the state that all handlers share.

use super::access::Access;
use super::limits::Limits;
use super::metrics::Metrics;
use super::service::Service;
use super::store_refusal::StoreRefusal;
use super::store_slot::{OpenStore, StoreSlot};
use super::work::Work;
use overfly_store::Reader;
use std::sync::Arc;

/// A store opened for reading, and the limits of the service. Cheap to clone.
#[derive(Debug, Clone)]
pub struct ServiceState {
    /// The store of this request; of the start, outside requests.
    pub(super) store: OpenStore,
    pub(super) slot: Arc<StoreSlot>,
    pub(super) service: Service,
    pub(super) limits: Limits,
    pub(super) work: Work,
    pub(super) metrics: Metrics,
    pub(super) access: Arc<Access>,
}

impl ServiceState {
    /// The state of a service over `store`.
    pub fn new(store: Reader, service: Service, limits: Limits) -> Self {
        let (work, metrics) = (Work::new(&limits), Metrics::new());
        let store = OpenStore::new(store, &limits);
        let slot = Arc::new(StoreSlot::new(store.clone(), limits, None));
        Self { store, slot, service, limits, work, metrics, access: Arc::default() }
    }

    /// The same state with warnings, which every health report includes.
    pub fn with_warnings(self, warnings: Vec<String>) -> Self {
        let store = OpenStore { warnings: warnings.into(), ..self.store };
        let slot = Arc::new(StoreSlot::new(store.clone(), self.limits, None));
        Self { store, slot, ..self }
    }

    /// The same state, which opens the store anew with `reopen` when its file was replaced or built anew. `reopen` returns the store
    /// and its warnings, after the checks of the start. Without it, a store that was replaced is not served any more.
    pub fn with_reopening(
        self,
        reopen: impl Fn() -> Result<(Reader, Vec<String>), StoreRefusal> + Send + Sync + 'static,
    ) -> Self {
        let slot = Arc::new(StoreSlot::new(self.store.clone(), self.limits, Some(Arc::new(reopen))));
        Self { slot, ..self }
    }

    /// The same state, to be used only by whom `access` admits.
    pub fn with_access(self, access: Access) -> Self {
        Self { access: Arc::new(access), ..self }
    }
}
