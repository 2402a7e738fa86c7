//! `CameraFile`: the keys of a `camera.toml`. Reading the file is for others.

use super::{CameraError, Intrinsics};
use serde::Deserialize;

/// A camera as `camera.toml` describes it: its intrinsics, and how exactly its attitude is known.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// Columns of the sensor.
    pub width_px: u32,
    /// Rows of the sensor.
    pub height_px: u32,
    /// Focal length, pixels.
    pub focal_length_px: f64,
    /// Principal point, pixels from the image's corner.
    pub principal_point_px: [f64; 2],
    /// The coefficients k1, k2, p1, p2, k3 of OpenCV's model.
    #[serde(default)]
    pub distortion: [f64; 5],
    /// One standard deviation of the pitch and of the roll of its frames, degrees in [0, 20], where the file states one.
    pub attitude_sigma_deg: Option<f64>,
}

impl CameraFile {
    /// The intrinsics.
    pub fn intrinsics(&self) -> Intrinsics {
        Intrinsics {
            width_px: self.width_px,
            height_px: self.height_px,
            focal_length_px: self.focal_length_px,
            principal_point_px: self.principal_point_px,
            distortion: self.distortion,
        }
    }

    /// Checks that the values describe a camera.
    ///
    /// # Errors
    /// As [`Intrinsics::check`], and for a standard deviation of the attitude out of range.
    pub fn check(&self) -> Result<(), CameraError> {
        self.intrinsics().check()?;
        match self.attitude_sigma_deg {
            Some(sigma_deg) if !(0.0..=MAX_ATTITUDE_SIGMA_DEG).contains(&sigma_deg) => {
                Err(CameraError::AttitudeSigma { sigma_deg, limit_deg: MAX_ATTITUDE_SIGMA_DEG })
            }
            _ => Ok(()),
        }
    }
}

/// The largest standard deviation of an attitude, degrees.
pub const MAX_ATTITUDE_SIGMA_DEG: f64 = 20.0;

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: &str = "width_px = 8\nheight_px = 6\nfocal_length_px = 10.0\nprincipal_point_px = [4.0, 3.0]\n";

    #[test]
    fn the_attitude_is_optional_and_checked() {
        let read = |more: &str| toml::from_str::<CameraFile>(&format!("{CAMERA}{more}")).unwrap();
        assert_eq!(read("").attitude_sigma_deg, None);
        assert!(read("").check().is_ok() && read("attitude_sigma_deg = 0").check().is_ok());
        assert!(read("attitude_sigma_deg = 20.5").check().is_err());
        assert!(read("attitude_sigma_deg = nan").check().is_err());
        assert!(toml::from_str::<CameraFile>(&format!("{CAMERA}attitude = 2")).is_err());
    }
}
