//! Plain images: gray, colour, mask. No georeference, no file formats.
//!
//! Pixel (0, 0) is the upper-left corner; the first pixel's centre is (0.5, 0.5).

mod colour;
mod gray;
mod mask;
mod shrink;

pub use colour::Colour;
pub use gray::Gray;
pub use mask::Mask;

/// An 8-bit colour image and which of its pixels are real.
#[derive(Debug, Clone, PartialEq)]
pub struct MaskedColour {
    /// The colours; where `mask` says no, black.
    pub colour: Colour,
    /// Same size as `colour`.
    pub mask: Mask,
}
