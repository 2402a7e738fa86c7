//! Camera frames: image files and bytes to gray images, within a bound on memory.

mod bounds;
mod decode;
mod error;
mod large;

pub use bounds::{FrameBounds, MAX_FILE_BYTES};
pub use decode::{decode_frame, decode_frame_within, read_colour_frame, read_frame};
pub use error::FrameError;
pub use large::{ReducedFrame, read_large_frame, read_large_frame_within};
