//! `FrameError`: why a frame cannot be read.

use super::bounds::FrameBounds;
use std::path::PathBuf;

/// Why a frame cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// The file cannot be read.
    #[error("{path}: {cause}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The cause.
        cause: std::io::Error,
    },
    /// Not a valid PNG, JPEG or WebP image.
    #[error("{name} is not a readable PNG, JPEG or WebP image: {reason}")]
    NotAnImage {
        /// Name of the file or form field.
        name: String,
        /// The decoder's message.
        reason: String,
    },
    /// The image, or the size that its header states, exceeds the bounds.
    #[error("{name} is too large: {found}; at most {limit} are accepted")]
    TooLarge {
        /// Name of the file or form field.
        name: String,
        /// The size found.
        found: String,
        /// The size accepted.
        limit: String,
    },
}

impl FrameError {
    /// The stable error code for scripts and HTTP.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "image_unreadable",
            Self::NotAnImage { .. } => "not_an_image",
            Self::TooLarge { .. } => "image_too_large",
        }
    }
}

/// The error of bytes that are not a valid image.
pub(super) fn not_an_image(name: &str, cause: impl std::fmt::Display) -> FrameError {
    FrameError::NotAnImage { name: name.into(), reason: cause.to_string() }
}

/// The error of a frame that exceeds its bounds.
pub(super) fn too_large(name: &str, found: String, FrameBounds { edge_px, pixels }: FrameBounds) -> FrameError {
    FrameError::TooLarge { name: name.into(), found, limit: format!("{pixels} pixels, {edge_px} a side") }
}
