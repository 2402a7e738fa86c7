//! `Patch`: what makes one store of another, and nothing that is the same in both. The file format: `migrations/README.md`.

mod apply;
mod changes;
mod diff;
mod header;
mod patch_file;
mod record;

pub use apply::{Applied, ApplyRequest, apply};
pub use diff::{Difference, LayerDifference, diff, write_patch};
pub use header::{PatchHeader, PatchLayer, SealedResult};
pub use record::{InputsRecord, Malformed, Part as PatchPart, PutTile, Records, TileRecord};
