//! Plain images: gray, colour, mask. No georeference, no file formats.
//!
//! Pixel (0, 0) is the upper-left corner; the first pixel's centre is (0.5, 0.5).

mod colour;
mod gray;
mod mask;
mod mask_outline;
mod masked_colour;
mod shrink;

pub use colour::Colour;
pub use gray::Gray;
pub use mask::Mask;
pub use mask_outline::{MaskOutline, OUTLINE_CELL_PX};
pub use masked_colour::MaskedColour;
