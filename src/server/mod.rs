//! The HTTP service over one store: preflight and onboard routers.
//!
//! Handlers parse, make one library call, reply. Every failure becomes a problem+json document in `problem`. Nothing
//! here writes to the store: the state holds a `store::Reader`. On the ground exports are written, to a temporary folder
//! of the service's own.
//!
//! Layers, digest and indexes are read once, at the start. A store whose finished layers change afterwards (or whose file
//! is replaced or removed) is answered from no more: 503 `store_changed` until the service is started again. A request
//! whose head is malformed or too large is refused by the HTTP library before any route, with a bare 400, 414 or 431; a
//! head that does not arrive within 15 s, or a connection idle for as long, is closed. A fix that nobody waits for any
//! more stops at its next piece of work.

//!
//! Without the feature `preflight` there are no exports: `no_exports` stands in for `exports`.

mod candidates;
mod catalogue;
mod connections;
mod detail;
pub(crate) mod dto;
mod entity_tag;
mod error;
mod error_response;
mod export_failure;
#[cfg(feature = "preflight")]
mod export_jobs;
#[cfg(feature = "preflight")]
mod exports;
#[cfg(not(feature = "preflight"))]
#[path = "no_exports.rs"]
mod exports;
mod fix_parameters;
mod fixes;
mod form;
mod form_error;
mod health;
mod limits;
mod listen;
mod metrics;
mod motions;
mod no_query;
mod operations;
mod page;
mod problem;
mod query;
mod range;
mod router;
mod service;
mod state;
mod supervisor;
mod tiles;
mod work;

pub use limits::Limits;
pub use listen::{Listen, ListenError, serve};
pub use router::router;
pub use service::Service;
pub use state::ServiceState;
pub use supervisor::Supervisor;
