//! What the service takes and answers, as JSON and in /openapi.json: one file per noun, made from the libraries' own types.

mod answer;
mod candidates;
mod coverage;
#[cfg(feature = "preflight")]
mod export;
mod fix_parameters;
mod geometry;
mod hint;
mod intrinsics;
mod layer;
mod motion;
mod stable_word;
mod terrain;
mod tile_json;

pub(crate) use answer::AnswerJson;
pub(super) use candidates::CandidatesJson;
pub(super) use coverage::CoverageJson;
#[cfg(feature = "preflight")]
pub(super) use export::{ExportAnswer, ExportEntry, ExportParameters, ExportPreview, ExportProgress, ExportStatus};
pub(super) use fix_parameters::FixParametersJson;
pub(super) use layer::LayerJson;
pub(super) use motion::{MotionParameters, MotionReply};
pub(super) use terrain::TerrainJson;
pub(super) use tile_json::TileJson;
