//! `View`, the stated attitude and scale of a frame, and `Camera`, the projection that follows from a view.

use super::{Attitude, CameraDeviation, CameraError, Height, Intrinsics};
use crate::geodesy::BodyOffset;
use nalgebra::{Matrix2, Matrix3, Vector3};

/// The stated attitude and scale of a frame. Positive pitch looks ahead (towards the image's upper edge), positive roll
/// looks to the left; with both zero the camera looks straight down.
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
        /// How high it flies.
        height: Height,
        /// How far off nadir it looks.
        attitude: Attitude,
    },
}

impl View {
    /// The view of the same frame reduced in size: each of its pixels covers `reduction` x `reduction` of the stated ones.
    pub fn reduced(self, reduction: u32) -> Self {
        match self {
            Self::Nadir { gsd_m_per_px } => Self::Nadir { gsd_m_per_px: gsd_m_per_px * f64::from(reduction) },
            // Intrinsics state their own size.
            posed @ Self::Posed { .. } => posed,
        }
    }
}

/// The limit of pitch and roll: beyond it a view of flat ground cannot be compared with a map.
const MAX_OFF_NADIR_DEG: f64 = 45.0;

/// The projection between a frame and the ground: intrinsics at the frame's size, height, pitch and roll. The heading
/// is not part of the camera: ground points are offsets in the aircraft's own level axes from the nadir.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    intrinsics: Intrinsics,
    height_agl_m: f64,
    /// Pitch and roll off nadir, radians.
    tilt_rad: [f64; 2],
    /// Rows: the camera's right, down and forward axes in the aircraft's level axes (right, ahead, up).
    camera_from_body: Matrix3<f64>,
    /// Where ground offsets count from, itself an offset from the nadir: zero but for [`Camera::tilted_about_image_centre`].
    origin: BodyOffset,
}

impl Camera {
    /// Makes the camera of a frame of this size under the stated view.
    ///
    /// # Errors
    /// [`CameraError`] where a size, length or angle is out of its range, or where the frame has another aspect than the
    /// stated intrinsics.
    pub fn new(view: &View, width_px: u32, height_px: u32) -> Result<Self, CameraError> {
        match view {
            View::Nadir { gsd_m_per_px } => {
                positive("gsd_m_per_px", *gsd_m_per_px)?;
                let intrinsics = Intrinsics::centred(width_px, height_px, 1.0 / gsd_m_per_px);
                intrinsics.check()?;
                Ok(Self {
                    intrinsics,
                    height_agl_m: 1.0,
                    tilt_rad: [0.0; 2],
                    camera_from_body: camera_from_body(0.0, 0.0),
                    origin: BodyOffset::default(),
                })
            }
            View::Posed { intrinsics, height, attitude } => {
                intrinsics.check()?;
                let height_agl_m = height.above_ground_m().ok_or(CameraError::NoGround)?;
                positive("height_m", height_agl_m)?;
                let [pitch_rad, roll_rad] = attitude.assumed_rad();
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
                    height_agl_m,
                    tilt_rad: [pitch_rad, roll_rad],
                    camera_from_body: camera_from_body(pitch_rad, roll_rad),
                    origin: BodyOffset::default(),
                })
            }
        }
    }

    /// The same camera at a height multiplied by `ratio`.
    pub fn at_height_ratio(&self, ratio: f64) -> Self {
        let BodyOffset { right_m, ahead_m } = self.origin;
        let origin = BodyOffset { right_m: right_m * ratio, ahead_m: ahead_m * ratio };
        Self { height_agl_m: self.height_agl_m * ratio, origin, ..self.clone() }
    }

    /// The same camera with more pitch and roll, radians, turned about the ground point in the middle of its image: that point keeps its
    /// offset, so ground offsets count from where the nadir was, not from where it is. `None` where it sees the horizon.
    pub fn tilted_about_image_centre(&self, [pitch_rad, roll_rad]: [f64; 2]) -> Option<Self> {
        let tilt_rad = [self.tilt_rad[0] + pitch_rad, self.tilt_rad[1] + roll_rad];
        let tilted = Self { tilt_rad, camera_from_body: camera_from_body(tilt_rad[0], tilt_rad[1]), ..self.clone() };
        let (before, after) = (self.image_centre_in_body()?, tilted.image_centre_in_body()?);
        let origin = BodyOffset {
            right_m: self.origin.right_m + after.right_m - before.right_m,
            ahead_m: self.origin.ahead_m + after.ahead_m - before.ahead_m,
        };
        Some(Self { origin, ..tilted })
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

    /// The frame position, pixels, of a ground point given by its offset from the nadir; `None` behind the camera or
    /// outside the lens model.
    pub fn frame_from_body(&self, ground: BodyOffset) -> Option<[f64; 2]> {
        self.frame_from_ground(ground, 0.0)
    }

    /// As [`Camera::frame_from_body`], for a point `rise_m` above the reference; also `None` at and above the camera's height.
    #[inline]
    pub fn frame_from_ground(&self, ground: BodyOffset, rise_m: f64) -> Option<[f64; 2]> {
        let (right_m, ahead_m) = (ground.right_m + self.origin.right_m, ground.ahead_m + self.origin.ahead_m);
        let p = self.camera_from_body * Vector3::new(right_m, ahead_m, rise_m - self.height_agl_m);
        (p.z > 1e-9 * self.height_agl_m).then(|| self.intrinsics.frame_from_ray([p.x / p.z, p.y / p.z])).flatten()
    }

    /// The ground point at a frame position, pixels, as an offset from the nadir; `None` above the horizon.
    pub fn body_from_frame(&self, pixel: [f64; 2]) -> Option<BodyOffset> {
        let [x, y] = self.intrinsics.ray_from_frame(pixel);
        let ray = self.camera_from_body.transpose() * Vector3::new(x, y, 1.0);
        (ray.z < -1e-6).then(|| BodyOffset {
            right_m: -ray.x / ray.z * self.height_agl_m - self.origin.right_m,
            ahead_m: -ray.y / ray.z * self.height_agl_m - self.origin.ahead_m,
        })
    }

    /// The height above the reference, metres.
    pub fn height_agl_m(&self) -> f64 {
        self.height_agl_m
    }

    /// The ray (x / z, y / z) of a frame position, pixels, in the camera's axes right, down and forward.
    pub fn ray_from_frame(&self, pixel: [f64; 2]) -> [f64; 2] {
        self.intrinsics.ray_from_frame(pixel)
    }

    /// A camera that differs from this one in height, pitch and roll.
    pub fn deviated(&self, deviation: &CameraDeviation) -> DeviatedCamera {
        let [pitch_rad, roll_rad] = self.tilt_rad;
        let camera_from_body = camera_from_body(pitch_rad + deviation.pitch_rad, roll_rad + deviation.roll_rad);
        let height_m = self.height_agl_m * deviation.log_height.exp();
        DeviatedCamera { body_from_camera: camera_from_body.transpose(), height_m }
    }

    /// The ground point in the middle of the image, as an offset from the nadir; `None` above the horizon.
    pub fn image_centre_in_body(&self) -> Option<BodyOffset> {
        let (w, h) = self.frame_size_px();
        self.body_from_frame([f64::from(w) / 2.0, f64::from(h) / 2.0])
    }

    /// How the ground point at a frame position, pixels, moves with the camera's tilt, metres per radian: the columns are the
    /// derivatives of (right, ahead) with respect to pitch and roll; `None` above the horizon. Straight down, at the middle of an
    /// image, that is the height on each axis.
    pub fn body_per_tilt(&self, pixel: [f64; 2]) -> Option<Matrix2<f64>> {
        let [x, y] = self.intrinsics.ray_from_frame(pixel);
        let ray = self.camera_from_body.transpose() * Vector3::new(x, y, 1.0);
        // Pitch turns the ray about the right axis, roll about the camera's ahead axis.
        let ahead = -self.camera_from_body.row(1).transpose();
        let moved = [Vector3::x().cross(&ray), ahead.cross(&ray)].map(|turned| {
            [0, 1].map(|axis| -(turned[axis] * ray.z - ray[axis] * turned.z) / (ray.z * ray.z) * self.height_agl_m)
        });
        (ray.z < -1e-6).then(|| Matrix2::from_columns(&moved.map(Into::into)))
    }

    /// [`Camera::body_per_tilt`] in the middle of the image.
    pub fn image_centre_per_tilt(&self) -> Option<Matrix2<f64>> {
        let (w, h) = self.frame_size_px();
        self.body_per_tilt([f64::from(w) / 2.0, f64::from(h) / 2.0])
    }

    /// The frame's corners on the ground, as offsets from the nadir, clockwise from the upper left; `None` where a corner
    /// looks above the horizon.
    pub fn footprint_in_body(&self) -> Option<[BodyOffset; 4]> {
        self.footprint_at_rise(0.0)
    }

    /// As [`Camera::footprint_in_body`], on ground `rise_m` above the reference; at most the camera's height.
    pub fn footprint_at_rise(&self, rise_m: f64) -> Option<[BodyOffset; 4]> {
        let (w, h) = self.frame_size_px();
        let (w, h) = (f64::from(w), f64::from(h));
        let share = (1.0 - rise_m / self.height_agl_m).max(0.0);
        // The nadir keeps its place: it lies at minus the origin.
        let scaled = |offset_m: f64, origin_m: f64| (offset_m + origin_m) * share - origin_m;
        let corner = |x, y| {
            let BodyOffset { right_m, ahead_m } = self.body_from_frame([x, y])?;
            let (right_m, ahead_m) = (scaled(right_m, self.origin.right_m), scaled(ahead_m, self.origin.ahead_m));
            Some(BodyOffset { right_m, ahead_m })
        };
        Some([corner(0.0, 0.0)?, corner(w, 0.0)?, corner(w, h)?, corner(0.0, h)?])
    }
}

/// A camera's height and axes, without its lens.
#[derive(Debug, Clone, Copy)]
pub struct DeviatedCamera {
    body_from_camera: Matrix3<f64>,
    height_m: f64,
}

impl DeviatedCamera {
    /// The point of a ray (x / z, y / z) on ground `rise_m` above the reference, as an offset from the nadir; `None` above the horizon.
    pub fn body_from_ray(&self, [x, y]: [f64; 2], rise_m: f64) -> Option<BodyOffset> {
        let ray = self.body_from_camera * Vector3::new(x, y, 1.0);
        let drop_m = self.height_m - rise_m;
        (ray.z < -1e-6).then(|| BodyOffset { right_m: -ray.x / ray.z * drop_m, ahead_m: -ray.y / ray.z * drop_m })
    }
}

/// The camera's axes right, down and forward as rows in (right, ahead, up): pitch about the right axis, then roll about
/// the new ahead axis.
fn camera_from_body(pitch_rad: f64, roll_rad: f64) -> Matrix3<f64> {
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
            height: Height::AboveGround(1000.0),
            attitude: Attitude::exact(pitch_deg.to_radians(), roll_deg.to_radians()),
        };
        Camera::new(&view, 400, 300).unwrap()
    }

    #[test]
    fn straight_down_the_upper_edge_is_ahead() {
        let ground = posed(0.0, 0.0).body_from_frame([200.0, 0.0]).unwrap();
        assert!(ground.right_m.abs() < 1e-9 && (ground.ahead_m - 300.0).abs() < 1e-9);
    }

    #[test]
    fn positive_pitch_looks_ahead_and_positive_roll_looks_left() {
        let aside_m = 1000.0 * 10f64.to_radians().tan();
        let pitched = posed(10.0, 0.0).image_centre_in_body().unwrap();
        assert!((pitched.ahead_m - aside_m).abs() < 1e-6 && pitched.right_m.abs() < 1e-9);
        let rolled = posed(0.0, 10.0).image_centre_in_body().unwrap();
        assert!((rolled.right_m + aside_m).abs() < 1e-6 && rolled.ahead_m.abs() < 1e-9);
    }

    #[test]
    fn the_ground_moves_with_the_tilt_as_differences_say() {
        let step_deg = 1e-4f64;
        for pixel in [[200.0, 150.0], [10.0, 20.0], [390.0, 280.0]] {
            let slopes = posed(7.0, -4.0).body_per_tilt(pixel).unwrap();
            let at = |pitch_deg, roll_deg| {
                let ground = posed(pitch_deg, roll_deg).body_from_frame(pixel).unwrap();
                nalgebra::Vector2::new(ground.right_m, ground.ahead_m)
            };
            let pitch = (at(7.0 + step_deg, -4.0) - at(7.0 - step_deg, -4.0)) / (2.0 * step_deg.to_radians());
            let roll = (at(7.0, -4.0 + step_deg) - at(7.0, -4.0 - step_deg)) / (2.0 * step_deg.to_radians());
            assert!((slopes.column(0) - pitch).norm() < 1e-3 && (slopes.column(1) - roll).norm() < 1e-3, "{pixel:?}");
        }
        // Straight down the height: pitch moves the middle ahead, roll to the left.
        let level = posed(0.0, 0.0).body_per_tilt([200.0, 150.0]).unwrap();
        assert!((level - Matrix2::new(0.0, -1000.0, 1000.0, 0.0)).norm() < 1e-9);
    }

    #[test]
    fn tilted_about_its_image_centre_a_camera_is_the_other_one_from_elsewhere() {
        let other = posed(10.0, -6.0).at_height_ratio(1.1);
        let tilted = posed(7.0, -4.0).tilted_about_image_centre([3f64.to_radians(), -2f64.to_radians()]).unwrap();
        let tilted = tilted.at_height_ratio(1.1);
        let stated = posed(7.0, -4.0).at_height_ratio(1.1).image_centre_in_body().unwrap();
        let centre = tilted.image_centre_in_body().unwrap();
        assert!((centre.right_m - stated.right_m).hypot(centre.ahead_m - stated.ahead_m) < 1e-9);
        let own = other.image_centre_in_body().unwrap();
        for pixel in [[10.0, 20.0], [390.0, 280.0]] {
            let (a, b) = (tilted.body_from_frame(pixel).unwrap(), other.body_from_frame(pixel).unwrap());
            assert!((a.right_m - centre.right_m - b.right_m + own.right_m).abs() < 1e-9);
            let back = tilted.frame_from_body(a).unwrap();
            assert!((back[0] - pixel[0]).hypot(back[1] - pixel[1]) < 1e-9);
        }
    }

    #[test]
    fn ground_and_frame_are_inverse() {
        let camera = posed(7.0, -4.0);
        for pixel in [[10.0, 20.0], [390.0, 280.0], [200.0, 150.0]] {
            let back = camera.frame_from_body(camera.body_from_frame(pixel).unwrap()).unwrap();
            assert!((back[0] - pixel[0]).hypot(back[1] - pixel[1]) < 1e-9);
        }
    }
}
