//! `RasterError`: why a source cannot be used. Every message names the file and, where one is known, the remedy.

use crate::crs::CrsError;
use std::path::{Path, PathBuf};

/// Why a source cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RasterError {
    /// The operating system says no.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's own words.
        source: std::io::Error,
    },
    /// A folder without one orthophoto in it.
    #[error("{}: no orthophoto in this folder (looked for {looked_for})", path.display())]
    NothingFound {
        /// The folder.
        path: PathBuf,
        /// Extensions.
        looked_for: String,
    },
    /// A pipe, a device, a socket.
    #[error("{}: no regular file but a pipe or a device; copy what it gives to a file first", path.display())]
    NoRegularFile {
        /// What was named.
        path: PathBuf,
    },
    /// Not a format that is read here.
    #[error("{}: not a GeoTIFF, PNG or JPEG ({reason}); convert it with gdal_translate -of COG, or build overfly with --features gdal", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What was seen.
        reason: String,
    },
    /// The file contradicts itself or ends early.
    #[error("{}: damaged: {reason}; fetch it again, or see what gdalinfo -checksum says", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A valid file of a kind that is not read here.
    #[error("{}: {reason}; convert it with {remedy}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not read.
        reason: String,
        /// What makes it readable.
        remedy: &'static str,
    },
    /// More memory than a source may take.
    #[error("{}: {reason}; convert it with gdal_translate -of COG, which is read by blocks", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What is too large, with the limit.
        reason: String,
    },
    /// Nothing says where the image lies.
    #[error("{}: no georeference: {missing}", path.display())]
    NoGeoreference {
        /// The file.
        path: PathBuf,
        /// What was looked for, and the remedy.
        missing: String,
    },
    /// What says where it lies makes no sense.
    #[error("{}: its georeference is unusable: {reason}", path.display())]
    BadGeoreference {
        /// The file, or the side file that says so.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Coordinates without a system.
    #[error("{}: states no coordinate reference system{detail}; pass it with --crs EPSG", path.display())]
    NoCrs {
        /// The file.
        path: PathBuf,
        /// What was seen instead; starts with a separator.
        detail: String,
    },
    /// A system that cannot be projected.
    #[error("{}: {source}", path.display())]
    Crs {
        /// The file.
        path: PathBuf,
        /// Which, why, remedy.
        source: CrsError,
    },
    /// More than 8 bits, and nothing says what is black and what white.
    #[error("{}: its samples are {samples}; say which values are shown as black and white with --stretch LO,HI (gdalinfo -stats shows their range)", path.display())]
    NeedsStretch {
        /// The file.
        path: PathBuf,
        /// "16-bit unsigned", ...
        samples: String,
    },
    /// A stretch that stretches nothing.
    #[error("{}: the stretch {low},{high} is not two finite numbers, the lower first", path.display())]
    BadStretch {
        /// The file.
        path: PathBuf,
        /// Shown as 0.
        low: f64,
        /// Shown as 255.
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

    pub(super) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.into(), source }
    }

    pub(super) fn damaged(path: &Path, reason: impl Into<String>) -> Self {
        Self::Damaged { path: path.into(), reason: reason.into() }
    }

    pub(super) fn bad_georeference(path: &Path, reason: impl Into<String>) -> Self {
        Self::BadGeoreference { path: path.into(), reason: reason.into() }
    }

    pub(super) fn crs(path: &Path, source: CrsError) -> Self {
        Self::Crs { path: path.into(), source }
    }
}

/// Runs a third party's decoder on bytes that may be hostile: a panic in it is a damaged file, not a dead program.
pub(super) fn guarded<T>(path: &Path, work: impl FnOnce() -> Result<T, RasterError>) -> Result<T, RasterError> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err(RasterError::damaged(path, "its contents made the decoder fail")))
}
