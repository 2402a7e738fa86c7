//! What is described of an image, and how two descriptions are matched: keypoints with binary descriptors, and
//! structure.

pub mod keypoint;
mod structure;

pub use structure::{BORDER_PX, CHANNEL_ONE, ENERGY_ONE, Structure};
