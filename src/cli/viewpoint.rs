//! The flags that say how the camera looked.

use super::Failure;
use super::number::{positive, tilt_deg};
use overfly::camera::View;
use overfly::trial::read_camera;
use std::path::PathBuf;

/// Ground sample distance, or height and camera.
#[derive(clap::Args)]
pub struct Viewpoint {
    /// Ground sample distance of the frame, for a camera looking straight down.
    #[arg(long, value_parser = positive, conflicts_with_all = ["height_m", "camera"])]
    gsd_m_per_px: Option<f64>,
    /// Height above ground.
    #[arg(long, value_parser = positive, requires = "camera")]
    height_m: Option<f64>,
    /// Intrinsics: camera.toml.
    #[arg(long, value_name = "FILE", requires = "height_m")]
    camera: Option<PathBuf>,
    /// Camera off nadir, positive ahead.
    #[arg(long, value_parser = tilt_deg, default_value_t = 0.0, requires = "camera")]
    pitch_deg: f64,
    /// Camera off nadir, positive left (right wing down).
    #[arg(long, value_parser = tilt_deg, default_value_t = 0.0, requires = "camera")]
    roll_deg: f64,
}

impl Viewpoint {
    /// How the camera looked; `None` where nothing was said.
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
