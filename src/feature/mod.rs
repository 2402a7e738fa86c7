//! What is described of an image, and how two descriptions are matched: keypoints with binary descriptors, and
//! structural channels.

pub mod keypoint;
