//! The HTTP service over one store, on the ground (preflight) or onboard.
//!
//! Handlers parse a request, make one library call and reply. Every failure becomes a problem document (`problem`). Nothing here
//! writes to the store: the state holds a `store::Reader`. On the ground, exports are written to a temporary folder of the service.
//!
//! Layers, digest and indexes are read once for each store. If the finished layers of the store change, or its file is replaced, the
//! new store is opened with the checks of the start, and served from the next request on; while it is missing or refused, every request
//! answers 503 `store_changed`. If the head of a request is
//! malformed or too large, the HTTP library answers 400, 414 or 431 without a body, before any route. A connection is closed if the
//! head of a request takes longer than 15 s, if the connection is idle for that long, or if a reader takes nothing for 30 s. While all
//! places are taken, `/healthz`, `/readyz` and candidates are answered on reserved ones. A fix is cancelled when nobody waits for it
//! any more.
//!
//! Without the feature `preflight` there are no exports: `no_exports` stands in for `exports`.

mod access;
mod address;
mod binary;
mod body;
mod candidates;
mod catalogue;
mod connections;
mod detail;
mod document;
pub(crate) mod dto;
mod entity_tag;
mod error;
mod error_response;
mod export_failure;
#[cfg(feature = "preflight")]
mod export_folder;
#[cfg(feature = "preflight")]
mod export_job;
#[cfg(feature = "preflight")]
mod export_jobs;
mod export_limits;
#[cfg(feature = "preflight")]
mod exports;
#[cfg(not(feature = "preflight"))]
#[path = "no_exports.rs"]
mod exports;
mod fix_request;
mod fixes;
mod form;
mod form_error;
mod giving_way;
mod guard;
mod health;
mod json_body;
mod json_object;
mod limits;
mod listen;
mod metered_body;
mod metrics;
mod motions;
mod no_query;
mod operations;
mod page;
mod problem;
mod problem_code;
mod public_address;
mod query;
mod range;
mod refusal;
mod remedy;
mod router;
mod served;
mod service;
mod session;
mod state;
mod store_refusal;
mod store_slot;
mod supervisor;
mod tiles;
mod token;
mod work;

pub use access::{Access, AccessError, AccessOptions};
pub use address::{Listen, ListenError};
pub use export_limits::ExportLimits;
pub use limits::Limits;
pub use listen::serve;
pub use router::router;
pub use service::Service;
pub use state::ServiceState;
pub use store_refusal::StoreRefusal;
pub use supervisor::Supervisor;
pub use token::{Token, TokenError};
