//! `RasterError`: why a source cannot be used. Every message names the file.

use crate::crs::CrsError;
use crate::remedy::Remedy;
use std::path::{Path, PathBuf};

/// Why a source cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RasterError {
    /// The operating system cannot read it.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// A folder that holds no orthophoto.
    #[error("{}: no orthophoto in this folder (looked for {looked_for})", path.display())]
    NothingFound {
        /// The folder.
        path: PathBuf,
        /// The extensions that were looked for.
        looked_for: String,
    },
    /// A pipe, a device or a socket.
    #[error("{}: not a regular file but a pipe or a device", path.display())]
    NoRegularFile {
        /// The path given.
        path: PathBuf,
    },
    /// The format is not supported.
    #[error("{}: not a GeoTIFF, PNG or JPEG ({reason})", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What the file holds instead.
        reason: String,
    },
    /// The file contradicts itself or is truncated.
    #[error("{}: damaged: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A valid file that uses an unsupported feature of its format.
    #[error("{}: {reason}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not supported.
        reason: String,
        /// What the user can do.
        remedy: Remedy,
    },
    /// Reading the source would take too much memory.
    #[error("{}: {reason}", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What is too large, with the limit.
        reason: String,
    },
    /// The source states no position.
    #[error("{}: no georeference: it has neither tags nor a world file that place it", path.display())]
    NoGeoreference {
        /// The file.
        path: PathBuf,
    },
    /// The position that the source states is impossible.
    #[error("{}: its georeference is unusable: {reason}", path.display())]
    BadGeoreference {
        /// The file, or the side file that holds the georeference.
        path: PathBuf,
        /// What is wrong.
        reason: String,
        /// What the user can do, where that is known.
        remedy: Option<Remedy>,
    },
    /// The source has coordinates and no coordinate reference system.
    #[error("{}: states no coordinate reference system{detail}", path.display())]
    NoCrs {
        /// The file.
        path: PathBuf,
        /// What the file states instead; starts with a separator.
        detail: String,
    },
    /// The coordinate reference system cannot be projected.
    #[error("{}: {source}", path.display())]
    Crs {
        /// The file.
        path: PathBuf,
        /// Which system, and why.
        source: CrsError,
    },
    /// Samples of more than 8 bits, without values for black and white.
    #[error("{}: its samples are {samples}, and no values are stated for black and white", path.display())]
    NeedsStretch {
        /// The file.
        path: PathBuf,
        /// "16-bit unsigned", ...
        samples: String,
    },
    /// A stretch whose bounds are not finite or not in order.
    #[error("{}: the stretch {low},{high} is not two finite numbers, the lower first", path.display())]
    BadStretch {
        /// The file.
        path: PathBuf,
        /// The value shown as 0.
        low: f64,
        /// The value shown as 255.
        high: f64,
    },
}

impl RasterError {
    /// A stable word for programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Io { .. } => "source_io",
            Self::NothingFound { .. } => "source_nothing_found",
            Self::NoRegularFile { .. } => "source_no_regular_file",
            Self::Format { .. } => "source_format",
            Self::Damaged { .. } => "source_damaged",
            Self::Unsupported { .. } => "source_unsupported",
            Self::TooLarge { .. } => "source_too_large",
            Self::NoGeoreference { .. } => "source_no_georeference",
            Self::BadGeoreference { .. } => "source_bad_georeference",
            Self::NoCrs { .. } => "source_no_crs",
            Self::Crs { source, .. } => source.code(),
            Self::NeedsStretch { .. } => "source_needs_stretch",
            Self::BadStretch { .. } => "source_bad_stretch",
        }
    }

    /// What the user can do, where that is known.
    pub fn remedy(&self) -> Option<Remedy> {
        match self {
            Self::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => Some(Remedy::CheckPath),
            Self::NothingFound { .. } => Some(Remedy::NameSources),
            Self::Io { .. } | Self::BadStretch { .. } => None,
            Self::NoRegularFile { .. } => Some(Remedy::CopyToFile),
            Self::Format { .. } => Some(Remedy::ConvertToCogOrUseGdal),
            Self::Damaged { .. } => Some(Remedy::FetchAgain),
            Self::Unsupported { remedy, .. } => Some(remedy.clone()),
            Self::TooLarge { .. } => Some(Remedy::ConvertToCog),
            Self::NoGeoreference { .. } => Some(Remedy::WriteGeoreference),
            Self::BadGeoreference { remedy, .. } => remedy.clone(),
            Self::NoCrs { .. } => Some(Remedy::StateCrs),
            Self::Crs { source, .. } => source.remedy(),
            Self::NeedsStretch { .. } => Some(Remedy::StateStretch),
        }
    }

    pub(super) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.into(), source }
    }

    pub(super) fn damaged(path: &Path, reason: impl Into<String>) -> Self {
        Self::Damaged { path: path.into(), reason: reason.into() }
    }

    pub(super) fn bad_georeference(path: &Path, reason: impl Into<String>, remedy: Option<Remedy>) -> Self {
        Self::BadGeoreference { path: path.into(), reason: reason.into(), remedy }
    }

    pub(super) fn crs(path: &Path, source: CrsError) -> Self {
        Self::Crs { path: path.into(), source }
    }
}

/// Runs a decoder of another crate on bytes that may be hostile. A panic in it becomes [`RasterError::Damaged`].
pub(super) fn guarded<T>(path: &Path, work: impl FnOnce() -> Result<T, RasterError>) -> Result<T, RasterError> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err(RasterError::damaged(path, "its contents made the decoder fail")))
}
