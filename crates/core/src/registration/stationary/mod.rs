//! What stands still in the image while the ground moves: a frozen video, an overlay, dust, a part of the aircraft.
//!
//! [`StillBlocks`] compares two images of one camera in image coordinates; [`StationaryMask`] collects such comparisons over a
//! flight.

mod blocks;
mod mask;

pub use blocks::StillBlocks;
pub use mask::StationaryMask;
