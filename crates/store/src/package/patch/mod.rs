//! Patches: the difference between two stores as a file. `migrations/README.md` documents the format.

mod apply;
mod changes;
mod diff;
mod header;
mod patch_file;
mod record;

pub use apply::{Applied, ApplyRequest, apply};
pub use diff::{Difference, LayerDifference, diff, write_patch};
pub use header::{PatchHeader, PatchLayer, SealedResult};
pub use record::{InputsRecord, MalformedPatch, PatchBlob, PutTile, Records, TileRecord};
