//! `MaskedColour`: a colour image and its mask.

use super::colour::Colour;
use super::mask::Mask;

/// An 8-bit colour image and the mask of its valid pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct MaskedColour {
    /// The colours; black where `mask` is not valid.
    pub colour: Colour,
    /// Same size as `colour`.
    pub mask: Mask,
}
