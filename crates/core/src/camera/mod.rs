//! The camera: from a frame to a north-up view of the ground, and back.
//!
//! The ground is taken as flat at the stated height below the camera, or as a `Relief` above and below that plane. Ground points are
//! offsets from the nadir, the point of the plane straight below the camera: in the aircraft's level axes, or east and north.

mod attitude;
mod camera_file;
mod deviation;
mod error;
mod ground_view;
mod height;
mod intrinsics;
mod pose;
mod relief;

pub use attitude::{Attitude, DEFAULT_STATED_SIGMA_DEG, DEFAULT_UNSTATED_SIGMA_DEG};
pub use camera_file::{CameraFile, MAX_ATTITUDE_SIGMA_DEG};
pub use deviation::CameraDeviation;
pub use error::CameraError;
pub use ground_view::{GroundGrid, GroundView, render, render_on_relief};
pub use height::Height;
pub use intrinsics::Intrinsics;
pub use pose::{Camera, DeviatedCamera, View};
pub use relief::Relief;
