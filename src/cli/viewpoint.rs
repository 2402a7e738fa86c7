//! The flags for the scale and attitude of the camera.

use crate::cli::camera_file::read_camera;
use crate::cli::failure::Failure;
use crate::cli::number::any;
use overfly_flight::locate::ViewParameters;
use std::path::PathBuf;

/// Ground sample distance, or height and camera.
#[derive(clap::Args)]
pub struct Viewpoint {
    /// Ground sample distance, metres per pixel of the (first) frame, for a camera looking straight down.
    #[arg(long, value_name = "M_PER_PX", value_parser = any, conflicts_with_all = ["height_m", "camera"])]
    gsd_m_per_px: Option<f64>,
    /// Height above ground, metres; requires --camera.
    #[arg(long, value_name = "M", value_parser = any, requires = "camera")]
    height_m: Option<f64>,
    /// The camera's intrinsics: a camera.toml.
    #[arg(long, value_name = "FILE", requires = "height_m")]
    camera: Option<PathBuf>,
    /// Pitch of the camera off nadir, degrees in [-45, 45], positive ahead.
    #[arg(long, value_name = "DEG", value_parser = any, allow_hyphen_values = true, default_value_t = 0.0, requires = "camera")]
    pitch_deg: f64,
    /// Roll of the camera off nadir, degrees in [-45, 45], positive left (right wing down).
    #[arg(long, value_name = "DEG", value_parser = any, allow_hyphen_values = true, default_value_t = 0.0, requires = "camera")]
    roll_deg: f64,
}

impl Viewpoint {
    /// The flags as the library takes them; the library checks the values.
    ///
    /// # Errors
    /// If camera.toml cannot be read or does not describe a camera.
    pub fn parameters(&self) -> Result<ViewParameters, Failure> {
        Ok(ViewParameters {
            gsd_m_per_px: self.gsd_m_per_px,
            height_m: self.height_m,
            camera: self.camera.as_deref().map(read_camera).transpose()?,
            pitch_deg: Some(self.pitch_deg),
            roll_deg: Some(self.roll_deg),
        })
    }
}
