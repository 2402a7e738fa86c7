//! The HTTP service over one store: preflight and onboard routers.
//!
//! Handlers parse, make one library call, reply. Every failure becomes a problem+json document in `problem`. Nothing
//! here writes: the state holds a `store::Reader`.

mod candidates;
mod catalogue;
mod error;
mod fix_parameters;
mod fixes;
mod form;
mod frame;
mod listen;
mod metrics;
mod motions;
mod operations;
mod page;
mod problem;
mod query;
mod router;
mod state;
mod tiles;
mod work;

pub use fix_parameters::FixParameters;
pub use listen::{Listen, ListenError, serve};
pub use motions::{MotionParameters, MotionReply};
pub use problem::Problem;
pub use router::router;
pub use state::{Limits, Service, ServiceState};
