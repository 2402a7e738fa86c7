//! From a camera frame to a north-up view of the ground, and back.
//!
//! The ground is taken as flat at the stated height below the camera. Everything is relative to the nadir, the ground
//! point straight below the camera, in metres east and north.

mod ground_view;
mod intrinsics;
mod pose;

pub use ground_view::{GroundGrid, GroundView, render};
pub use intrinsics::Intrinsics;
pub use pose::{Camera, CameraError, View};
