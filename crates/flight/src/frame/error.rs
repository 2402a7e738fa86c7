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
    /// Not a PNG, JPEG or WebP image, or one of a kind that is not read.
    #[error("{name} is not a readable PNG, JPEG or WebP image: {reason}")]
    NotAnImage {
        /// Name of the file or form field.
        name: String,
        /// The decoder's message.
        reason: String,
    },
    /// An image whose file does not decode exactly: bytes are missing or were changed. Its pixels may stand beside their place.
    #[error(
        "{name} is damaged: {reason}; a damaged image can give a wrong position, so read it again from where it was written"
    )]
    Damaged {
        /// Name of the file or form field.
        name: String,
        /// What the decoder found.
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
            Self::Damaged { .. } => "image_damaged",
            Self::TooLarge { .. } => "image_too_large",
        }
    }
}

/// Why bytes give no image; [`Fault::named`] adds the name of the file.
#[derive(Debug)]
pub(super) enum Fault {
    NotAnImage(String),
    Damaged(String),
    TooLarge(String),
}

impl Fault {
    /// The fault of bytes that do not decode exactly.
    pub fn damaged(reason: impl std::fmt::Display) -> Self {
        Self::Damaged(reason.to_string())
    }

    /// The error of the file or form field of this name, which was read within these bounds.
    pub fn named(self, name: &str, FrameBounds { edge_px, pixels }: FrameBounds) -> FrameError {
        let name = name.into();
        match self {
            Self::NotAnImage(reason) => FrameError::NotAnImage { name, reason },
            Self::Damaged(reason) => FrameError::Damaged { name, reason },
            Self::TooLarge(found) => {
                FrameError::TooLarge { name, found, limit: format!("{pixels} pixels, {edge_px} a side") }
            }
        }
    }
}
