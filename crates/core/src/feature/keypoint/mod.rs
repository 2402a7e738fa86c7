//! Keypoints with 256-bit binary descriptors.

mod blob;
mod describe;
mod descriptor;
mod detector;
mod distinctiveness;
mod frame;
mod keypoints;
mod matching;
mod patches;
mod response;
#[cfg(test)]
mod test_images;

pub use blob::{from_blob, to_blob};
pub use describe::{CONTRACT, describe};
pub use distinctiveness::distinctiveness;
pub use frame::{KeypointOptions, describe_frame};
pub use keypoints::{Keypoint, Keypoints};
pub use matching::{Correspondence, Neighbours, hamming, match_mutual, neighbours};
