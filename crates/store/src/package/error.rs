//! `PackageError`: why a store cannot be exported, signed, patched or flown.

use crate::{StoreError, StoreRemedy};
use jiff::civil::Date;
use std::path::{Path, PathBuf};

/// Why a store cannot be exported, signed, patched or flown. The text states the fact; [`PackageError::remedy`] says what helps.
#[derive(Debug, thiserror::Error)]
pub enum PackageError {
    /// A store cannot be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A file cannot be read or written.
    #[error("{path}: {cause}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The message of the system.
        cause: std::io::Error,
    },
    /// The key file exists.
    #[error("{path}: exists, and a key is never overwritten", path = path.display())]
    KeyExists {
        /// The file.
        path: PathBuf,
    },
    /// The file is not a key.
    #[error("{path}: {reason}", path = path.display())]
    NotAKey {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The store is not signed, and a signature is required.
    #[error("{path}: not signed, and a signature is required", path = path.display())]
    Unsigned {
        /// The store.
        path: PathBuf,
    },
    /// The store is signed with another key.
    #[error("{path}: signed with the key {found}, but {required} is required", path = path.display())]
    WrongKey {
        /// The store.
        path: PathBuf,
        /// The public key that the manifest names.
        found: String,
        /// The required public key.
        required: String,
    },
    /// The export has no serial, which a signed store needs.
    #[error("{path}: it has no serial, and a signed export needs one", path = path.display())]
    NoSerial {
        /// The export.
        path: PathBuf,
    },
    /// The store was built, not exported, so it has no manifest to sign.
    #[error("{path}: not an export, and only exports are signed", path = path.display())]
    NotExported {
        /// The store.
        path: PathBuf,
    },
    /// The store is signed already.
    #[error("{path}: signed already, with the key {signer}", path = path.display())]
    AlreadySigned {
        /// The store.
        path: PathBuf,
        /// The public key of the signer.
        signer: String,
    },
    /// The manifest was altered, or the store is not the one that it describes.
    #[error("{path}: its manifest was altered: {reason}", path = path.display())]
    AlteredManifest {
        /// The store.
        path: PathBuf,
        /// What does not match.
        reason: String,
    },
    /// The seal was altered.
    #[error("{path}: its seal was altered: {reason}", path = path.display())]
    AlteredSeal {
        /// The store.
        path: PathBuf,
        /// What does not match.
        reason: String,
    },
    /// The file is not a patch.
    #[error("{path}: not a patch: {reason}", path = path.display())]
    NotAPatch {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The patch was altered.
    #[error("{path}: the patch was altered or truncated: it does not have the digest that it states", path = path.display())]
    AlteredPatch {
        /// The patch.
        path: PathBuf,
    },
    /// The patch is for another store.
    #[error("{path}: the patch is for another store: this one has the digest {found}, the patch is for {expected}", path = path.display())]
    WrongBase {
        /// The store.
        path: PathBuf,
        /// The digest of the store.
        found: String,
        /// The digest that the patch is for.
        expected: String,
    },
    /// The patch does not make the store that it states.
    #[error("{path}: the patch does not make the store that it states: {reason}", path = path.display())]
    OtherResult {
        /// The store.
        path: PathBuf,
        /// What differs.
        reason: String,
    },
    /// In place, the patch would make an export of a built map, or a map of an export.
    #[error("{path}: {found}, and the patch makes {made} of it", path = path.display())]
    OtherKind {
        /// The store.
        path: PathBuf,
        /// What the store is.
        found: &'static str,
        /// What the patch makes.
        made: &'static str,
    },
    /// Another program has opened the sealed file for writing.
    #[error(
        "{path}: another program has opened this sealed file for writing{}, so it no longer has the digest that was sealed",
        if *uses_wal { " (and left it in WAL mode)" } else { "" },
        path = path.display()
    )]
    OpenedForWriting {
        /// The store.
        path: PathBuf,
        /// Whether it left the file in WAL mode.
        uses_wal: bool,
    },
    /// The store is older than the one in use, or than the demanded serial.
    #[error("{path}: {}, and at least serial {least} is required", serial_text(*found), path = path.display())]
    OlderSerial {
        /// The store.
        path: PathBuf,
        /// Its serial, if it states one.
        found: Option<u64>,
        /// The least serial.
        least: u64,
    },
    /// The last day of the store has passed.
    #[error("{path}: was valid until {valid_until}, and today is {today}", path = path.display())]
    Expired {
        /// The store.
        path: PathBuf,
        /// The last day of the store.
        valid_until: Date,
        /// Today.
        today: Date,
    },
    /// The clock cannot be right, so that no date can be judged.
    #[error("{path}: the clock says {today}, but the store holds imagery of {newest}, so its age is unknown", path = path.display())]
    Clock {
        /// The store.
        path: PathBuf,
        /// The day of the clock.
        today: Date,
        /// The date of the newest imagery.
        newest: Date,
    },
    /// A layer is older than the policy allows.
    #[error("{path}: {what}", path = path.display())]
    Stale {
        /// The store.
        path: PathBuf,
        /// The layer, its age, and the limit.
        what: String,
    },
    /// The operating system gives no random numbers.
    #[error("the system gives no random numbers: {reason}")]
    Randomness {
        /// The message of the system.
        reason: String,
    },
}

fn serial_text(found: Option<u64>) -> String {
    found.map_or("it has no serial".into(), |serial| format!("it has serial {serial}"))
}

impl PackageError {
    /// Returns a stable code word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Store(e) => e.code(),
            Self::Io { .. } => "io",
            Self::KeyExists { .. } => "key_exists",
            Self::NotAKey { .. } => "not_a_key",
            Self::Unsigned { .. } => "unsigned_store",
            Self::WrongKey { .. } => "wrong_key",
            Self::NotExported { .. } => "not_exported",
            Self::NoSerial { .. } => "no_serial",
            Self::AlreadySigned { .. } => "already_signed",
            Self::AlteredManifest { .. } => "altered_manifest",
            Self::AlteredSeal { .. } => "altered_seal",
            Self::NotAPatch { .. } => "not_a_patch",
            Self::AlteredPatch { .. } => "altered_patch",
            Self::WrongBase { .. } => "wrong_base",
            Self::OtherResult { .. } => "other_result",
            Self::OtherKind { .. } => "in_the_way",
            Self::Expired { .. } => "expired_store",
            Self::OlderSerial { .. } => "older_serial",
            Self::OpenedForWriting { .. } => "opened_for_writing",
            Self::Clock { .. } => "clock_implausible",
            Self::Stale { .. } => "stale_layer",
            Self::Randomness { .. } => "randomness",
        }
    }

    /// Whether the input is at fault (exit code 2), and not the work on it.
    pub fn is_unusable_input(&self) -> bool {
        match self {
            Self::Store(e) => e.is_unusable_input(),
            Self::Io { .. } | Self::Randomness { .. } => false,
            _ => true,
        }
    }

    /// Returns what helps against this error, if anything is known to.
    pub fn remedy(&self) -> Option<StoreRemedy> {
        Some(match self {
            Self::Store(error) => return error.remedy(),
            Self::KeyExists { .. } => StoreRemedy::ChooseOtherName,
            Self::NotAKey { .. } => StoreRemedy::GenerateKey,
            Self::Unsigned { .. } | Self::NotExported { .. } => StoreRemedy::ExportSigned,
            Self::WrongKey { .. } => StoreRemedy::CheckStoreAndKey,
            Self::AlteredManifest { .. } | Self::AlteredSeal { .. } => StoreRemedy::RestoreOrExportAgain,
            Self::NotAPatch { .. } => StoreRemedy::MakePatch,
            Self::AlteredPatch { .. } => StoreRemedy::CopyPatchAgain,
            Self::WrongBase { .. } => StoreRemedy::MakePatchFromThisStore,
            Self::OtherResult { .. } => StoreRemedy::CopyStore,
            Self::Expired { .. } => StoreRemedy::ExportAgain,
            Self::NoSerial { .. } => StoreRemedy::ExportWithSerial,
            Self::OlderSerial { .. } => StoreRemedy::CopyNewestStore,
            Self::OpenedForWriting { .. } => StoreRemedy::CopyAgain,
            Self::Clock { .. } => StoreRemedy::SetClock,
            Self::Stale { .. } => StoreRemedy::UseNewerImageryOrPolicy,
            Self::OtherKind { .. } => StoreRemedy::StateOut,
            Self::AlreadySigned { .. } | Self::Io { .. } | Self::Randomness { .. } => return None,
        })
    }

    /// Makes the error for a failure of the system with `path`.
    pub(super) fn io(path: &Path, cause: std::io::Error) -> Self {
        match StoreError::io(path, cause) {
            StoreError::Io { path, source } => Self::Io { path, cause: source },
            named => Self::Store(named),
        }
    }
}
