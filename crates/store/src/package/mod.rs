//! What an aircraft takes along: the part of a store that one flight needs, its manifest, seal and signature; their
//! verification, on the ground and onboard; and patches, which make a new store of an old one.
//!
//! Pure, without files: `date`, `freshness`, `manifest`, `seal`. The rest reads and writes files.

mod date;
mod digest;
mod error;
mod freshness;
mod key;
mod manifest;
mod onboard;
mod patch;
mod seal;
mod sealed_file;
mod verify;

pub use date::Date;
pub use digest::file_digest;
pub use error::PackageError;
pub use freshness::{Finding, StalePolicy, freshness};
pub use key::{PublicKey, SecretKey, generate};
pub use manifest::{Dropped, Manifest, ManifestLayer, ManifestRoute};
pub use onboard::{Onboard, open_onboard};
pub use patch::{
    Applied, ApplyRequest, Difference, InputsRecord, LayerDifference, Malformed, PatchHeader, PatchLayer, PatchPart,
    PutTile, Records, SealedResult, TileRecord, apply, diff, write_patch,
};
pub use seal::{SEAL_LEN, Seal};
pub use sealed_file::{read_seal, write_seal};
pub use verify::{PackageVerification, Problem, Verify, verify_package};
