//! Why nothing can be exported, signed, or flown.

use super::Date;
use crate::StoreError;
use std::path::{Path, PathBuf};

/// Why nothing can be exported, signed, or flown.
#[derive(Debug, thiserror::Error)]
pub enum PackageError {
    /// A store cannot be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A file cannot be read or written.
    #[error("{path}: {cause}", path = path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A key is never overwritten.
    #[error("{path}: exists, and a key is never overwritten: choose another name", path = path.display())]
    KeyExists {
        /// The file.
        path: PathBuf,
    },
    /// Not a key.
    #[error("{path}: {reason}; `overfly keygen --out KEY` makes KEY (PKCS#8 PEM, to sign) and KEY.pub (SPKI PEM, to verify), both Ed25519", path = path.display())]
    NotAKey {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A signature is required and there is none.
    #[error("{path}: is not signed, and a signature is required: export it with `overfly export --sign KEY`", path = path.display())]
    Unsigned {
        /// The store.
        path: PathBuf,
    },
    /// Signed by somebody else.
    #[error("{path}: signed with the key {found}, required is {required}: is it the right store, and the right key?", path = path.display())]
    WrongKey {
        /// The store.
        path: PathBuf,
        /// The public key that its manifest names.
        found: String,
        /// The one required.
        required: String,
    },
    /// The manifest, or what it says of the store's content, was altered.
    #[error("{path}: its manifest was altered: {reason}; restore the store from a copy, or export it anew", path = path.display())]
    AlteredManifest {
        /// The store.
        path: PathBuf,
        /// What does not agree.
        reason: String,
    },
    /// The seal was altered.
    #[error("{path}: its seal was altered: {reason}; restore the store from a copy, or export it anew", path = path.display())]
    AlteredSeal {
        /// The store.
        path: PathBuf,
        /// What does not agree.
        reason: String,
    },
    /// A file that is no patch.
    #[error("{path}: not a patch: {reason}; `overfly diff OLD NEW --out PATCH` makes one", path = path.display())]
    NotAPatch {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A patch that is not what was written.
    #[error("{path}: the patch was altered or cut short: it does not have the digest that it states; copy it again, or make it anew", path = path.display())]
    AlteredPatch {
        /// The patch.
        path: PathBuf,
    },
    /// A patch for another store.
    #[error("{path}: the patch is for another store: this one's digest is {found}, the patch is for {expected}; make a patch from this one", path = path.display())]
    WrongBase {
        /// The store.
        path: PathBuf,
        /// Its digest.
        found: String,
        /// That of the store that the patch is for.
        expected: String,
    },
    /// A patch that does not lead where it says.
    #[error("{path}: the patch does not make of it what it states: {reason}; the store is as it was: copy the new store whole", path = path.display())]
    OtherResult {
        /// The store.
        path: PathBuf,
        /// What is other.
        reason: String,
    },
    /// Past its date.
    #[error("{path}: was valid until {valid_until}, and it is {today}: export it anew", path = path.display())]
    Expired {
        /// The store.
        path: PathBuf,
        /// Its last day.
        valid_until: Date,
        /// This day.
        today: Date,
    },
    /// The clock cannot be right, so no date can be judged.
    #[error("{path}: the clock says {today}, and the store holds imagery of {newest}: set the clock; until then nobody can say whether the store is too old", path = path.display())]
    Clock {
        /// The store.
        path: PathBuf,
        /// What the clock says.
        today: Date,
        /// The newest imagery.
        newest: Date,
    },
    /// A layer older than the policy allows.
    #[error("{path}: {what}: build it from newer imagery, or change --stale-after-days", path = path.display())]
    Stale {
        /// The store.
        path: PathBuf,
        /// Which layer, how old, and the policy.
        what: String,
    },
    /// The operating system gives no randomness.
    #[error("the system gives no random numbers: {reason}")]
    Randomness {
        /// What it says.
        reason: String,
    },
}

impl PackageError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Store(e) => e.code(),
            Self::Io { .. } => "io",
            Self::KeyExists { .. } => "key_exists",
            Self::NotAKey { .. } => "not_a_key",
            Self::Unsigned { .. } => "unsigned_store",
            Self::WrongKey { .. } => "wrong_key",
            Self::AlteredManifest { .. } => "altered_manifest",
            Self::AlteredSeal { .. } => "altered_seal",
            Self::NotAPatch { .. } => "not_a_patch",
            Self::AlteredPatch { .. } => "altered_patch",
            Self::WrongBase { .. } => "wrong_base",
            Self::OtherResult { .. } => "other_result",
            Self::Expired { .. } => "expired_store",
            Self::Clock { .. } => "clock_implausible",
            Self::Stale { .. } => "stale_layer",
            Self::Randomness { .. } => "randomness",
        }
    }

    /// Whether what was given is at fault, and not the work on it: exit code 2.
    pub fn is_unusable_input(&self) -> bool {
        match self {
            Self::Store(e) => e.is_unusable_input(),
            Self::Io { .. } | Self::Randomness { .. } => false,
            _ => true,
        }
    }

    /// Names what the system reports about `path`, in the store's words where it has any.
    pub(super) fn io(path: &Path, cause: std::io::Error) -> Self {
        match StoreError::io(path, cause) {
            StoreError::Io { path, source } => Self::Io { path, cause: source },
            named => Self::Store(named),
        }
    }
}
