//! How the camera looked: `View` as stated, `Camera` with its heading fixed.

use super::Intrinsics;
use nalgebra::{Matrix3, Vector3};

/// Why a stated view cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// A length or size that must be positive is not.
    #[error("{name} = {value} must be a positive number")]
    NotPositive {
        /// Its name as callers spell it.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// A value is NaN or infinite.
    #[error("{name} = {value} is not a finite number")]
    NotFinite {
        /// Its name as callers spell it.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// The camera looks at or above the horizon with some of its pixels.
    #[error(
        "pitch_deg = {pitch_deg:.1}, roll_deg = {roll_deg:.1} is too far off nadir; at most {limit_deg} degrees each"
    )]
    TooFarOffNadir {
        /// Stated pitch, degrees.
        pitch_deg: f64,
        /// Stated roll, degrees.
        roll_deg: f64,
        /// The bound, degrees.
        limit_deg: f64,
    },
    /// The frame is not the camera's whole image.
    #[error(
        "the frame is {width_px} x {height_px} px but the camera is {expected_width_px} x {expected_height_px} px; state the intrinsics of the frame itself"
    )]
    OtherAspect {
        /// Columns of the frame.
        width_px: u32,
        /// Rows of the frame.
        height_px: u32,
        /// Columns of the camera.
        expected_width_px: u32,
        /// Rows of the camera.
        expected_height_px: u32,
    },
}

impl CameraError {
    /// A stable word for scripts and HTTP.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NotPositive { .. } | Self::NotFinite { .. } => "bad_camera",
            Self::TooFarOffNadir { .. } => "too_far_off_nadir",
            Self::OtherAspect { .. } => "camera_does_not_fit_frame",
        }
    }
}

/// What is known of how the camera looked when a frame was taken. Positive pitch looks ahead (towards the image's
/// upper edge), positive roll looks to the left; both zero is straight down.
#[derive(Debug, Clone, PartialEq)]
pub enum View {
    /// Straight down with square pixels: ground metres per pixel of the frame.
    Nadir {
        /// Ground sample distance, metres per pixel.
        gsd_m_per_px: f64,
    },
    /// A calibrated camera at a height.
    Posed {
        /// Intrinsics; a frame of another size with the same aspect is scaled.
        intrinsics: Intrinsics,
        /// Height above ground, metres.
        height_agl_m: f64,
        /// Pitch off nadir, radians.
        pitch_rad: f64,
        /// Roll off nadir, radians.
        roll_rad: f64,
    },
}

impl View {
    /// The view of a frame whose pixels are each `reduction` x `reduction` of those that this is stated for.
    pub fn reduced(self, reduction: u32) -> Self {
        match self {
            Self::Nadir { gsd_m_per_px } => Self::Nadir { gsd_m_per_px: gsd_m_per_px * f64::from(reduction) },
            // Intrinsics state their own size.
            posed @ Self::Posed { .. } => posed,
        }
    }
}

/// Pitch and roll beyond this are refused: the flat ground seen so obliquely is no map.
const MAX_OFF_NADIR_DEG: f64 = 45.0;

/// A camera over flat ground: intrinsics for the frame at hand, height, and attitude except for the heading.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    intrinsics: Intrinsics,
    height_agl_m: f64,
    /// Rows: the camera's right, down and forward axes in the level frame (right, ahead, up) of heading zero.
    camera_from_level: Matrix3<f64>,
}

impl Camera {
    /// The camera that took a frame of this size under the stated view.
    ///
    /// # Errors
    /// Sizes, heights or angles that no camera over the ground can have.
    pub fn new(view: &View, width_px: u32, height_px: u32) -> Result<Self, CameraError> {
        match view {
            View::Nadir { gsd_m_per_px } => {
                positive("gsd_m_per_px", *gsd_m_per_px)?;
                let intrinsics = Intrinsics::centred(width_px, height_px, 1.0 / gsd_m_per_px);
                intrinsics.check()?;
                Ok(Self { intrinsics, height_agl_m: 1.0, camera_from_level: camera_from_level(0.0, 0.0) })
            }
            View::Posed { intrinsics, height_agl_m, pitch_rad, roll_rad } => {
                intrinsics.check()?;
                positive("height_m", *height_agl_m)?;
                let limit_rad = MAX_OFF_NADIR_DEG.to_radians();
                if !(pitch_rad.abs() <= limit_rad && roll_rad.abs() <= limit_rad) {
                    return Err(CameraError::TooFarOffNadir {
                        pitch_deg: pitch_rad.to_degrees(),
                        roll_deg: roll_rad.to_degrees(),
                        limit_deg: MAX_OFF_NADIR_DEG,
                    });
                }
                Ok(Self {
                    intrinsics: intrinsics.scaled_to(width_px, height_px)?,
                    height_agl_m: *height_agl_m,
                    camera_from_level: camera_from_level(*pitch_rad, *roll_rad),
                })
            }
        }
    }

    /// The same camera at a height multiplied by `ratio`.
    pub fn at_height_ratio(&self, ratio: f64) -> Self {
        Self { height_agl_m: self.height_agl_m * ratio, ..self.clone() }
    }

    /// The same camera for the frame resized to another number of pixels.
    pub fn resized(&self, width_px: usize, height_px: usize) -> Self {
        let (sx, sy) = (
            width_px as f64 / f64::from(self.intrinsics.width_px),
            height_px as f64 / f64::from(self.intrinsics.height_px),
        );
        let [cx, cy] = self.intrinsics.principal_point_px;
        let intrinsics = Intrinsics {
            width_px: width_px as u32,
            height_px: height_px as u32,
            focal_length_px: self.intrinsics.focal_length_px * (sx * sy).sqrt(),
            principal_point_px: [cx * sx, cy * sy],
            distortion: self.intrinsics.distortion,
        };
        Self { intrinsics, ..self.clone() }
    }

    /// Columns and rows of the frame.
    pub fn frame_size_px(&self) -> (u32, u32) {
        (self.intrinsics.width_px, self.intrinsics.height_px)
    }

    /// Ground sample distance straight below, metres per pixel: height over focal length.
    pub fn gsd_m_per_px(&self) -> f64 {
        self.height_agl_m / self.intrinsics.focal_length_px
    }

    /// Where a ground point, metres right of and ahead of the nadir, falls on the frame, pixels; `None` behind the
    /// camera or outside the lens model.
    pub fn frame_from_level(&self, right_m: f64, ahead_m: f64) -> Option<[f64; 2]> {
        let p = self.camera_from_level * Vector3::new(right_m, ahead_m, -self.height_agl_m);
        (p.z > 1e-9 * self.height_agl_m).then(|| self.intrinsics.frame_from_ray([p.x / p.z, p.y / p.z])).flatten()
    }

    /// The ground point seen by a frame pixel, metres right of and ahead of the nadir; `None` above the horizon.
    pub fn level_from_frame(&self, pixel: [f64; 2]) -> Option<[f64; 2]> {
        let [x, y] = self.intrinsics.ray_from_frame(pixel);
        let ray = self.camera_from_level.transpose() * Vector3::new(x, y, 1.0);
        (ray.z < -1e-6).then(|| [-ray.x / ray.z * self.height_agl_m, -ray.y / ray.z * self.height_agl_m])
    }

    /// The ground point in the middle of the image, metres right of and ahead of the nadir.
    pub fn image_centre_in_level(&self) -> Option<[f64; 2]> {
        let (w, h) = self.frame_size_px();
        self.level_from_frame([f64::from(w) / 2.0, f64::from(h) / 2.0])
    }

    /// The frame's corners on the ground, metres right and ahead, clockwise from the upper left; `None` where one
    /// looks above the horizon.
    pub fn footprint_in_level(&self) -> Option<[[f64; 2]; 4]> {
        let (w, h) = self.frame_size_px();
        let (w, h) = (f64::from(w), f64::from(h));
        let corner = |x, y| self.level_from_frame([x, y]);
        Some([corner(0.0, 0.0)?, corner(w, 0.0)?, corner(w, h)?, corner(0.0, h)?])
    }
}

/// Rows right, down, forward of the camera in (right, ahead, up): pitch about the right axis, then roll about the
/// new ahead axis.
fn camera_from_level(pitch_rad: f64, roll_rad: f64) -> Matrix3<f64> {
    let (sp, cp) = pitch_rad.sin_cos();
    let (sr, cr) = roll_rad.sin_cos();
    let right = Vector3::x();
    let ahead = Vector3::new(0.0, cp, sp);
    let forward = Vector3::new(0.0, sp, -cp);
    let rolled_forward = forward * cr - right * sr;
    let rolled_right = right * cr + forward * sr;
    Matrix3::from_rows(&[rolled_right.transpose(), (-ahead).transpose(), rolled_forward.transpose()])
}

fn positive(name: &'static str, value: f64) -> Result<(), CameraError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(CameraError::NotPositive { name, value }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn posed(pitch_deg: f64, roll_deg: f64) -> Camera {
        let view = View::Posed {
            intrinsics: Intrinsics::centred(400, 300, 500.0),
            height_agl_m: 1000.0,
            pitch_rad: f64::to_radians(pitch_deg),
            roll_rad: f64::to_radians(roll_deg),
        };
        Camera::new(&view, 400, 300).unwrap()
    }

    #[test]
    fn straight_down_the_upper_edge_is_ahead() {
        let ground = posed(0.0, 0.0).level_from_frame([200.0, 0.0]).unwrap();
        assert!((ground[0]).abs() < 1e-9 && (ground[1] - 300.0).abs() < 1e-9);
    }

    #[test]
    fn positive_pitch_looks_ahead_and_positive_roll_looks_left() {
        let pitched = posed(10.0, 0.0).image_centre_in_level().unwrap();
        assert!((pitched[1] - 1000.0 * 10f64.to_radians().tan()).abs() < 1e-6 && pitched[0].abs() < 1e-9);
        let rolled = posed(0.0, 10.0).image_centre_in_level().unwrap();
        assert!((rolled[0] + 1000.0 * 10f64.to_radians().tan()).abs() < 1e-6 && rolled[1].abs() < 1e-9);
    }

    #[test]
    fn ground_and_frame_are_inverse() {
        let camera = posed(7.0, -4.0);
        for pixel in [[10.0, 20.0], [390.0, 280.0], [200.0, 150.0]] {
            let [right_m, ahead_m] = camera.level_from_frame(pixel).unwrap();
            let back = camera.frame_from_level(right_m, ahead_m).unwrap();
            assert!((back[0] - pixel[0]).hypot(back[1] - pixel[1]) < 1e-9);
        }
    }
}
