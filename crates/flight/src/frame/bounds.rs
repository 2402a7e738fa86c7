//! `FrameBounds`: how large a frame may be.

/// The largest frame that is decoded. The header is checked before any pixel is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameBounds {
    /// Largest width and height, pixels.
    pub edge_px: u32,
    /// Largest number of pixels.
    pub pixels: u64,
}

impl Default for FrameBounds {
    /// The frame of a survey camera of 150 megapixels.
    fn default() -> Self {
        Self { edge_px: 32_768, pixels: 150_000_000 }
    }
}

/// The largest file that is read as a frame, bytes.
pub const MAX_FILE_BYTES: u64 = 512 << 20;
