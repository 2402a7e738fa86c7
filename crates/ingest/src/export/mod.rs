//! What one flight needs, cut out of a store: the tiles along a corridor, sealed and signed.

mod corridor;
mod coverage;
mod cut;
mod error;
mod request;
mod selection;
mod size_reduction;

pub use corridor::{Corridor, Drift, Width};
pub use coverage::{Coverage, CoverageStep};
pub use cut::{Exported, Part, Preview, export, preview};
pub use error::ExportError;
pub use request::ExportRequest;
