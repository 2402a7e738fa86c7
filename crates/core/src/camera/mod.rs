//! The camera: from a frame to a north-up view of the ground, and back.
//!
//! The ground is taken as flat at the stated height below the camera. Ground points are offsets from the nadir, the
//! ground point straight below the camera: in the aircraft's level axes, or east and north.

mod attitude;
mod camera_file;
mod deviation;
mod error;
mod ground_view;
mod intrinsics;
mod pose;

pub use attitude::{Attitude, DEFAULT_STATED_SIGMA_DEG, DEFAULT_UNSTATED_SIGMA_DEG};
pub use camera_file::{CameraFile, MAX_ATTITUDE_SIGMA_DEG};
pub use deviation::CameraDeviation;
pub use error::CameraError;
pub use ground_view::{GroundGrid, GroundView, render};
pub use intrinsics::Intrinsics;
pub use pose::{Camera, DeviatedCamera, View};
