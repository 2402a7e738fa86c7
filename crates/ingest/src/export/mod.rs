//! Exporting what one flight needs from a store: the tiles along a corridor, sealed and signed.

mod corridor;
mod coverage;
mod cut;
mod error;
mod request;
mod selection;
mod size_reduction;
mod uncovered;

pub use corridor::{Corridor, CorridorDrift, CorridorWidth};
pub use coverage::{CorridorCoverage, CoverageStep};
pub use cut::{Exported, ExportedLevel, Preview, export, preview};
pub use error::ExportError;
pub use request::ExportRequest;
pub use uncovered::{CoverageGap, coverage_gaps, covered_share};
