//! `FlightImage`: one image with the sensors' readings, and the odometry step from one image to the next.
//!
//! Images are rectified to a level view before they are registered: between two views of different tilt no similarity holds.

use super::measurements::{OdometryStep, SensorReading, SensorSigmas};
use nalgebra::Matrix2;
use overfly_core::camera::{Attitude, Camera, CameraError, Height, Intrinsics, View};
use overfly_core::geodesy::{BodyOffset, wrap_turn_rad};
use overfly_core::pixels::Gray;
use overfly_core::registration::relative::{Motion, MotionAnswer, MotionPrior, register};
use std::sync::Arc;

/// One image of a flight.
#[derive(Debug, Clone)]
pub struct FlightImage {
    /// The pixels.
    pub gray: Arc<Gray>,
    /// When the image was taken, seconds.
    pub time_s: f64,
    /// The readings of compass and altimeter.
    pub reading: SensorReading,
    /// The camera's intrinsics.
    pub intrinsics: Intrinsics,
    /// How far off nadir the camera looks.
    pub attitude: Attitude,
}

/// Lower bound on one standard deviation of a displacement, as a share of its length: ground is not flat.
const STEP_SIGMA_SHARE: f64 = 0.003;
/// One standard deviation of the ground's slope under an image, per axis. Between two viewpoints that are a share of the height
/// apart, a slope stretches the image by that share of itself, along the displacement only; a similarity takes half of this for
/// turn (slope across the displacement) or for climb (slope along it). On the synthetic flight over hills, this explains the
/// errors of turns: 0.2 degrees where brightness alone claims 0.01.
const SLOPE_SIGMA: f64 = 0.025;
/// Time constant of the attitude's error, seconds: it is nearly constant over a few images.
const ATTITUDE_TIME_S: f64 = 60.0;
/// The gate on turn and climb, in standard deviations of the sensors' readings.
const GATE_SIGMAS: f64 = 5.0;

impl FlightImage {
    /// The camera's view from a height, metres above ground.
    pub fn view(&self, height_agl_m: f64) -> View {
        View::Posed {
            intrinsics: self.intrinsics.clone(),
            height: Height::AboveGround(height_agl_m),
            attitude: self.attitude,
        }
    }

    /// The camera at a height, metres above ground.
    ///
    /// # Errors
    /// [`CameraError`] where intrinsics, height, pitch or roll are out of range.
    pub fn camera(&self, height_agl_m: f64) -> Result<Camera, CameraError> {
        let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Camera::new(&self.view(height_agl_m), size(self.gray.width_px()), size(self.gray.height_px()))
    }

    /// One standard deviation per axis of the point that the stated attitude puts straight below the camera, as a ratio of the
    /// height. The error is nearly the same from image to image.
    pub fn tilt_sigma_ratio(&self) -> f64 {
        let square_cosine: f64 = self.attitude.assumed_rad().iter().map(|angle| angle.cos().powi(2)).product();
        self.attitude.sigma_rad / if square_cosine > 0.1 { square_cosine } else { 0.1 }
    }

    /// One standard deviation per axis of how far that point has moved by itself in a time, and in a turn, as a ratio of the
    /// height: the attitude's error is a Gauss-Markov process, and turns with the aircraft.
    pub fn sway_sigma_ratio(&self, elapsed_s: f64, turn_rad: f64) -> f64 {
        let changed = (2.0 * (1.0 - (-elapsed_s / ATTITUDE_TIME_S).exp())).sqrt();
        let turned = if turn_rad.is_finite() { 2.0 * (turn_rad / 2.0).sin() } else { 2.0 };
        self.tilt_sigma_ratio() * changed.hypot(turned)
    }

    /// The odometry step from this image to a later one by relative registration; `None` where the images cannot be registered
    /// or where one is tilted too far off nadir.
    ///
    /// # Errors
    /// As [`FlightImage::camera`].
    pub fn step_to(&self, next: &Self) -> Result<Option<OdometryStep>, CameraError> {
        let (Some(own), Some(others)) = (LevelView::new(self)?, LevelView::new(next)?) else { return Ok(None) };
        let MotionAnswer::Motion(motion) = register(&own.gray, &others.gray, &MotionPrior::default()) else {
            return Ok(None);
        };
        Ok(Some(step(&motion, &own, &others, self.attitude.sigma_rad.max(next.attitude.sigma_rad))))
    }

    /// Whether the compass shows the turn of a step; without two readings, it does not.
    pub fn agrees_with_compass(&self, next: &Self, step: &OdometryStep, sigmas: &SensorSigmas) -> bool {
        let turned = self.turn_by_compass_rad(next) - step.turn_rad;
        wrap_turn_rad(turned).abs() <= bound(sigmas.heading_noise_rad)
    }

    /// The turn to a later image by the compass, radians; not finite without two readings.
    pub fn turn_by_compass_rad(&self, next: &Self) -> f64 {
        next.reading.heading_rad - self.reading.heading_rad
    }

    /// Whether the climb contradicts the altimeter. The scale of a motion is known from many keypoints, so the altimeter is
    /// taken to be wrong.
    pub fn contradicts_altimeter(&self, next: &Self, step: &OdometryStep, sigmas: &SensorSigmas) -> bool {
        let climbed = (next.reading.height_m / self.reading.height_m).ln() - step.log_climb;
        climbed.abs() > bound(sigmas.height_noise_ratio)
    }
}

/// The gate on the difference of two readings of this noise.
fn bound(sigma: f64) -> f64 {
    GATE_SIGMAS * 2f64.sqrt() * sigma + 0.02
}

/// An image rectified to the view of a camera that looks straight down.
struct LevelView {
    gray: Gray,
    /// The nadir, pixels from the image's corner; may lie outside the image.
    nadir_px: [f64; 2],
    /// Ground sample distance at a height of one metre, metres per pixel.
    per_height: f64,
}

/// Relative registration compares at most this edge (square root of the area), so a level view need not be larger.
const MAX_EDGE_PX: f64 = 720.0;

impl LevelView {
    /// Rectifies an image; `None` where the camera sees the horizon or is tilted too far off nadir.
    fn new(image: &FlightImage) -> Result<Option<Self>, CameraError> {
        let camera = match image.camera(1.0) {
            Err(CameraError::TooFarOffNadir { .. }) => return Ok(None),
            camera => camera?,
        };
        let edge_px = ((image.gray.width_px() * image.gray.height_px()) as f64).sqrt();
        let factor = (edge_px / MAX_EDGE_PX).ceil() as usize;
        let gray = if factor > 1 { image.gray.binned(factor) } else { Gray::clone(&image.gray) };
        let camera = camera.resized(gray.width_px(), gray.height_px());
        if image.attitude.assumed_rad() != [0.0; 2] || image.intrinsics.distortion != [0.0; 5] {
            return Ok(Self::rectified(&gray, &camera));
        }
        let per_height = camera.gsd_m_per_px();
        Ok(camera.frame_from_body(BodyOffset::default()).map(|nadir_px| Self { gray, nadir_px, per_height }))
    }

    /// The largest upright rectangle within the camera's footprint, at the resolution of the nadir.
    fn rectified(gray: &Gray, camera: &Camera) -> Option<Self> {
        let [upper_left, upper_right, lower_right, lower_left] = camera.footprint_in_body()?;
        let left = upper_left.right_m.max(lower_left.right_m);
        let right = upper_right.right_m.min(lower_right.right_m);
        let far = upper_left.ahead_m.min(upper_right.ahead_m);
        let near = lower_left.ahead_m.max(lower_right.ahead_m);
        let per_height = camera.gsd_m_per_px();
        let (width, height) = (((right - left) / per_height).floor(), ((far - near) / per_height).floor());
        if !(width >= 1.0 && height >= 1.0) {
            return None;
        }
        let (width, height) = (width as usize, height as usize);
        let value = |i: usize| {
            let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            let ground = BodyOffset { right_m: left + x * per_height, ahead_m: far - y * per_height };
            camera.frame_from_body(ground).map_or(0.0, |[x, y]| gray.sample(x, y))
        };
        let values = (0..width * height).map(value).collect();
        let nadir_px = [-left / per_height, far / per_height];
        Some(Self { gray: Gray::from_values(width, height, values)?, nadir_px, per_height })
    }
}

/// The odometry step of a motion between two level views: the offset of the later nadir from the earlier. `attitude_sigma_rad`: one
/// standard deviation of pitch and roll, by which the views may not be level.
fn step(motion: &Motion, own: &LevelView, others: &LevelView, attitude_sigma_rad: f64) -> OdometryStep {
    let [x, y] = others.nadir_px;
    let [row_x, row_y] = motion.a_from_b;
    let in_own = [row_x[0] * x + row_x[1] * y + row_x[2], row_y[0] * x + row_y[1] * y + row_y[2]];
    let gsd = own.per_height;
    // Rows run down, ahead is up.
    let per_height = [(in_own[0] - own.nadir_px[0]) * gsd, (own.nadir_px[1] - in_own[1]) * gsd];
    let [[xx, xy], [yx, yy]] = motion.covariance_px2;
    let length = per_height[0].hypot(per_height[1]);
    let registered = Matrix2::new(xx, -xy, -yx, yy) * gsd * gsd;
    let covariance = registered + Matrix2::identity() * (STEP_SIGMA_SHARE * length).powi(2);
    // Between two views that lean by t the ground in both grows and turns by t times the distance over the height, as each shows it in
    // another place; on a slope by half of that.
    let slope_sigma = (SLOPE_SIGMA / 2.0).hypot(attitude_sigma_rad) * length;
    OdometryStep {
        per_height,
        covariance,
        turn_rad: motion.rotation_deg.to_radians(),
        turn_sigma_rad: motion.rotation_sigma_deg.to_radians().hypot(slope_sigma),
        // Both views are scaled to one metre of height: the size of b's pixels in a's pixels is the ratio of the heights.
        log_climb: (motion.scale * own.per_height / others.per_height).ln(),
        climb_sigma: motion.scale_sigma_ratio.hypot(slope_sigma),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(heading_deg: f64, pitch_deg: f64) -> FlightImage {
        FlightImage {
            gray: Arc::new(Gray::filled(400, 300, 0.0)),
            time_s: 0.0,
            reading: SensorReading { heading_rad: f64::to_radians(heading_deg), height_m: 500.0 },
            intrinsics: Intrinsics::centred(400, 300, 500.0),
            attitude: Attitude::exact(pitch_deg.to_radians(), 0.0),
        }
    }

    fn level(width: usize, height: usize) -> LevelView {
        let nadir_px = [width as f64 / 2.0, height as f64 / 2.0];
        LevelView { gray: Gray::filled(width, height, 0.0), nadir_px, per_height: 0.002 }
    }

    fn motion(dx: f64, dy: f64, rotation_deg: f64) -> Motion {
        let (sin, cos) = f64::to_radians(rotation_deg).sin_cos();
        let centre = [200.0, 150.0];
        let t =
            [centre[0] + dx - cos * centre[0] + sin * centre[1], centre[1] + dy - sin * centre[0] - cos * centre[1]];
        Motion {
            a_from_b: [[cos, -sin, t[0]], [sin, cos, t[1]]],
            rotation_deg,
            scale: 1.0,
            displacement_px: [dx, dy],
            covariance_px2: [[0.01, 0.0], [0.0, 0.01]],
            rotation_sigma_deg: 0.05,
            scale_sigma_ratio: 0.001,
            inliers: 50,
            matches: 60,
            log10_false_alarms: -60.0,
        }
    }

    #[test]
    fn up_the_image_is_ahead() {
        let found = step(&motion(0.0, -100.0, 0.0), &level(400, 300), &level(400, 300), 0.0);
        assert!((found.per_height[0]).abs() < 1e-12 && (found.per_height[1] - 0.2).abs() < 1e-12);
    }

    /// Views taken as level lean alike: each shows the common ground at another place, where it is larger and turned.
    #[test]
    fn a_lean_that_nobody_states_shows_in_the_sigmas_of_the_step() {
        let lean_rad = 8f64.to_radians();
        let (camera, level_camera) = [lean_rad, 0.0]
            .map(|pitch_rad| {
                let view = View::Posed {
                    intrinsics: image(0.0, 0.0).intrinsics,
                    height: Height::AboveGround(1.0),
                    attitude: Attitude::exact(pitch_rad, 0.0),
                };
                Camera::new(&view, 400, 300).unwrap()
            })
            .into();
        // Two points of the ground between both images, 0.2 heights apart, as each camera sees them.
        let gap_px = |camera: &Camera, back: f64| {
            let [a, b] = [-0.02, 0.02]
                .map(|right_m| camera.frame_from_body(BodyOffset { right_m, ahead_m: 0.2 - back }).unwrap());
            b[0] - a[0]
        };
        let growth = |camera: &Camera| (gap_px(camera, 0.2) / gap_px(camera, 0.0)).ln();
        assert!(growth(&level_camera).abs() < 1e-9);
        let found = step(&motion(0.0, -100.0, 0.0), &level(400, 300), &level(400, 300), lean_rad);
        let share = growth(&camera).abs() / found.climb_sigma;
        assert!((0.7..1.4).contains(&share), "the growth is one of the stated sigmas: {share}");
    }

    /// A pattern on the ground seen by a tilted camera.
    fn tilted(pitch_deg: f64, roll_deg: f64) -> FlightImage {
        let attitude = Attitude::exact(pitch_deg.to_radians(), roll_deg.to_radians());
        let blank = FlightImage { attitude, ..image(0.0, 0.0) };
        let camera = blank.camera(1.0).unwrap();
        let bright = |i: usize| {
            let pixel = [(i % 400) as f64 + 0.5, (i / 400) as f64 + 0.5];
            let BodyOffset { right_m: right, ahead_m: ahead } = camera.body_from_frame(pixel).unwrap();
            (128.0 + 60.0 * ((31.0 * right).sin() + (23.0 * ahead + 9.0 * right).cos())) as f32
        };
        let gray = Gray::from_values(400, 300, (0..120_000).map(bright).collect()).unwrap();
        FlightImage { gray: Arc::new(gray), ..blank }
    }

    #[test]
    fn an_image_tilted_too_far_gives_no_step_and_no_error() {
        assert_eq!(tilted(0.0, 0.0).step_to(&image(0.0, 60.0)).unwrap(), None);
    }

    #[test]
    fn a_level_view_has_no_tilt() {
        let nadir = LevelView::new(&tilted(0.0, 0.0)).unwrap().unwrap();
        let oblique = LevelView::new(&tilted(2.0, -3.0)).unwrap().unwrap();
        // The same ground at the same distance from the nadir.
        for (dx, dy) in [(0.0, 0.0), (100.0, 60.0), (-90.0, -80.0)] {
            let at = |l: &LevelView| l.gray.sample(l.nadir_px[0] + dx, l.nadir_px[1] + dy);
            assert!((at(&nadir) - at(&oblique)).abs() < 1.0, "{dx} {dy}: {} {}", at(&nadir), at(&oblique));
        }
    }

    #[test]
    fn a_turn_is_compared_with_the_compass() {
        let sigmas = SensorSigmas {
            heading_offset_rad: 0.05,
            heading_noise_rad: 0.02,
            height_offset_ratio: 0.03,
            height_noise_ratio: 0.01,
        };
        let turned = step(&motion(0.0, -50.0, 30.0), &level(400, 300), &level(400, 300), 0.0);
        assert!(image(10.0, 0.0).agrees_with_compass(&image(41.0, 0.0), &turned, &sigmas));
        assert!(image(350.0, 0.0).agrees_with_compass(&image(19.0, 0.0), &turned, &sigmas));
        assert!(!image(10.0, 0.0).agrees_with_compass(&image(20.0, 0.0), &turned, &sigmas));
    }
}
