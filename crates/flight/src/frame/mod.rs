//! Camera frames: image files and bytes to gray images, within a bound on memory. A file that does not decode
//! exactly is refused, because pixels beside their place can give a wrong position.

mod bounds;
mod decode;
mod error;
mod format;
mod jpeg;
mod large;
mod png;
mod webp;

pub use bounds::{FrameBounds, MAX_FILE_BYTES};
pub use decode::{decode_frame, decode_frame_within, read_colour_frame, read_frame};
pub use error::FrameError;
pub use large::{ReducedFrame, read_large_frame, read_large_frame_within};
