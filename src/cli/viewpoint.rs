//! The flags for the scale and attitude of the camera.

use crate::cli::camera_file::read_camera;
use crate::cli::failure::Failure;
use crate::cli::number::{any, metres};
use overfly_flight::locate::ViewParameters;
use std::path::PathBuf;

/// Ground sample distance, or height and camera.
#[derive(clap::Args)]
pub struct Viewpoint {
    /// Ground sample distance, metres per pixel of the (first) frame, for a camera looking straight down.
    #[arg(long, value_name = "M_PER_PX", value_parser = any, conflicts_with_all = ["height_m", "camera"])]
    gsd_m_per_px: Option<f64>,
    /// Height above ground, metres; requires --camera.
    #[arg(long, value_name = "M", value_parser = metres, requires = "camera")]
    height_m: Option<f64>,
    /// The camera's intrinsics: a camera.toml.
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Pitch of the camera off nadir, degrees in [-45, 45], positive ahead.
    #[arg(long, value_name = "DEG", value_parser = any, allow_hyphen_values = true, requires = "camera")]
    pitch_deg: Option<f64>,
    /// Roll of the camera off nadir, degrees in [-45, 45], positive left (right wing down).
    #[arg(long, value_name = "DEG", value_parser = any, allow_hyphen_values = true, requires = "camera")]
    roll_deg: Option<f64>,
    /// One standard deviation of pitch and of roll, degrees in [0, 20] [default: camera.toml's, else 2 if both are stated, else 5].
    #[arg(long, value_name = "DEG", value_parser = any, requires = "camera")]
    attitude_sigma_deg: Option<f64>,
}

impl Viewpoint {
    /// The flags as the library takes them; the library checks the values.
    ///
    /// # Errors
    /// If camera.toml cannot be read or does not describe a camera.
    pub fn parameters(&self) -> Result<ViewParameters, Failure> {
        let camera = self.camera.as_deref().map(read_camera).transpose()?;
        Ok(ViewParameters {
            gsd_m_per_px: self.gsd_m_per_px,
            height_m: self.height_m,
            attitude_sigma_deg: self.attitude_sigma_deg.or(camera.as_ref().and_then(|c| c.attitude_sigma_deg)),
            camera: camera.map(|camera| camera.intrinsics()),
            pitch_deg: self.pitch_deg,
            roll_deg: self.roll_deg,
            ..ViewParameters::default()
        })
    }
}
