//! Exported stores: manifest, seal and signature, their verification on the ground and onboard, and patches between stores.
//!
//! `date`, `freshness`, `manifest` and `seal` do not touch files.

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
mod serial;
mod sign;
mod verify;

pub use date::{acquisition_day, days_between, parse_date, utc_day};
pub use digest::file_digest;
pub use error::PackageError;
pub use freshness::{Finding, StalePolicy, check_freshness, is_future, require_past_imagery};
pub use jiff::civil::Date;
pub use key::{PublicKey, SecretKey, generate};
pub use manifest::{Dropped, Manifest, ManifestLayer, ManifestRoute};
pub use onboard::{Onboard, open_onboard};
pub use patch::{
    Applied, ApplyRequest, Difference, InputsRecord, LayerDifference, MalformedPatch, PatchBlob, PatchHeader,
    PatchLayer, PutTile, Records, SealedResult, TileRecord, apply, diff, write_patch,
};
pub use seal::{SEAL_LEN, Seal};
pub use sealed_file::{read_seal, write_seal};
pub use serial::{require_serial, stated_serial};
pub use sign::{Signed, sign};
pub use verify::{PackageVerification, VerifyOptions, verify_package};
