//! Relative registration: the motion between two frames.
//!
//! Keypoints find the motion under any rotation ([`consensus`]). The brightness of the ground that both frames see then makes
//! the motion exact, and confirms it ([`alignment`]). A motion with a rival is none (`repetition`). [`register()`] does all three.

pub mod alignment;
mod binomial;
mod block_sums;
pub mod consensus;
mod keypoint_match;
mod keypoint_observations;
mod motion;
mod normal_equations;
mod parallax;
mod register;
mod repetition;
mod still_pixels;
mod template;
#[cfg(test)]
mod tests;

pub use keypoint_match::KeypointMatch;
pub use motion::{Motion, MotionAnswer, MotionPrior, NoMotionReason};
pub use register::{MOST_EDGE_PX, QUICK, RATIO, SCALE_BOUNDS, accepted, register};
