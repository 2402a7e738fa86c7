//! The flags for the scale and attitude of the camera.

use crate::cli::camera_file::read_camera;
use crate::cli::failure::Failure;
use crate::cli::number::{positive, tilt_deg};
use overfly_core::camera::View;
use std::path::PathBuf;

/// Ground sample distance, or height and camera.
#[derive(clap::Args)]
pub struct Viewpoint {
    /// Ground sample distance, metres per pixel of the (first) frame, for a camera looking straight down.
    #[arg(long, value_name = "M_PER_PX", value_parser = positive, conflicts_with_all = ["height_m", "camera"])]
    gsd_m_per_px: Option<f64>,
    /// Height above ground, metres; requires --camera.
    #[arg(long, value_name = "M", value_parser = positive, requires = "camera")]
    height_m: Option<f64>,
    /// The camera's intrinsics: a camera.toml.
    #[arg(long, value_name = "FILE", requires = "height_m")]
    camera: Option<PathBuf>,
    /// Pitch of the camera off nadir, degrees, positive ahead.
    #[arg(long, value_name = "DEG", value_parser = tilt_deg, default_value_t = 0.0, requires = "camera")]
    pitch_deg: f64,
    /// Roll of the camera off nadir, degrees, positive left (right wing down).
    #[arg(long, value_name = "DEG", value_parser = tilt_deg, default_value_t = 0.0, requires = "camera")]
    roll_deg: f64,
}

impl Viewpoint {
    /// The camera's view; `None` if no scale is given.
    ///
    /// # Errors
    /// If camera.toml cannot be read or does not describe a camera.
    pub fn view(&self) -> Result<Option<View>, Failure> {
        match (self.gsd_m_per_px, self.height_m, &self.camera) {
            (Some(gsd_m_per_px), ..) => Ok(Some(View::Nadir { gsd_m_per_px })),
            (None, Some(height_agl_m), Some(camera)) => Ok(Some(View::Posed {
                intrinsics: read_camera(camera)?,
                height_agl_m,
                pitch_rad: self.pitch_deg.to_radians(),
                roll_rad: self.roll_deg.to_radians(),
            })),
            _ => Ok(None),
        }
    }
}
