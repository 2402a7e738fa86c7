//! `Image`: one image with what was sensed when it was taken, and the step from one to the next.

use super::{Sensed, SensorSigmas, Step};
use crate::camera::{Camera, CameraError, Intrinsics, View};
use crate::pixels::Gray;
use crate::registration::relative::{Motion, MotionAnswer, MotionPrior, register};
use nalgebra::Matrix2;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// One image of a flight.
#[derive(Debug, Clone)]
pub struct Image {
    /// Its pixels.
    pub gray: Arc<Gray>,
    /// When it was taken, seconds.
    pub time_s: f64,
    /// What compass and altimeter said.
    pub sensed: Sensed,
    /// The camera.
    pub intrinsics: Intrinsics,
    /// Off nadir, radians, positive ahead.
    pub pitch_rad: f64,
    /// Off nadir, radians, positive left.
    pub roll_rad: f64,
}

/// A step is not told better than this, in parts of its length: ground is not flat.
const STEP_SHARE: f64 = 0.003;
/// Nor turn and growth better than this.
const LEAST_TURN_SIGMA: f64 = 5e-4;
/// A turn or climb that contradicts the sensors by more than so many of their standard deviations is no motion.
const GATE_SIGMAS: f64 = 5.0;

impl Image {
    /// How the camera looked from a height, metres.
    pub fn view(&self, height_agl_m: f64) -> View {
        View::Posed {
            intrinsics: self.intrinsics.clone(),
            height_agl_m,
            pitch_rad: self.pitch_rad,
            roll_rad: self.roll_rad,
        }
    }

    /// The camera at a height, metres.
    ///
    /// # Errors
    /// Where camera, height or angles are none that a camera over the ground can have.
    pub fn camera(&self, height_agl_m: f64) -> Result<Camera, CameraError> {
        let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Camera::new(&self.view(height_agl_m), size(self.gray.width_px()), size(self.gray.height_px()))
    }

    /// The step from this image to a later one by relative registration; `None` where they cannot be registered, or where the
    /// motion contradicts the sensors.
    ///
    /// # Errors
    /// As [`Image::camera`].
    pub fn step_to(&self, next: &Self, sigmas: &SensorSigmas) -> Result<Option<Step>, CameraError> {
        let (own, others) = (self.camera(1.0)?, next.camera(1.0)?);
        let MotionAnswer::Motion(motion) = register(&self.gray, &next.gray, &MotionPrior::default()) else {
            return Ok(None);
        };
        Ok(step(&motion, &own, &others).filter(|step| self.agrees(next, step, sigmas)))
    }

    fn agrees(&self, next: &Self, step: &Step, sigmas: &SensorSigmas) -> bool {
        let turned = next.sensed.heading_rad - self.sensed.heading_rad - step.turn_rad;
        let climbed = (next.sensed.height_m / self.sensed.height_m).ln() - step.log_climb;
        let bound = |sigma: f64| GATE_SIGMAS * 2f64.sqrt() * sigma + 0.02;
        ((turned + PI).rem_euclid(TAU) - PI).abs() <= bound(sigmas.heading_noise_rad)
            && climbed.abs() <= bound(sigmas.height_noise_ratio)
    }
}

/// Of a motion between images of two cameras, each a metre above ground: where the later nadir lies from the earlier.
fn step(motion: &Motion, own: &Camera, others: &Camera) -> Option<Step> {
    let [x, y] = others.frame_from_level(0.0, 0.0)?;
    let [row_x, row_y] = motion.a_from_b;
    let in_own = [row_x[0] * x + row_x[1] * y + row_x[2], row_y[0] * x + row_y[1] * y + row_y[2]];
    let per_height = own.level_from_frame(in_own)?;
    let gsd = own.gsd_m_per_px();
    let [[xx, xy], [yx, yy]] = motion.covariance_px2;
    let length = per_height[0].hypot(per_height[1]);
    // Rows run down, ahead is up.
    let registered = Matrix2::new(xx, -xy, -yx, yy) * gsd * gsd;
    let covariance = registered + Matrix2::identity() * (STEP_SHARE * length).powi(2);
    let (w, h) = own.frame_size_px();
    let lever_px = f64::from(w).hypot(f64::from(h)) / 8.0;
    let sigma = ((xx + yy) / 2.0).sqrt() / lever_px;
    let sigma = sigma.hypot(LEAST_TURN_SIGMA);
    Some(Step {
        per_height,
        covariance,
        turn_rad: motion.rotation_deg.to_radians(),
        turn_sigma_rad: sigma,
        log_climb: motion.scale.ln(),
        climb_sigma: sigma,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(heading_deg: f64, pitch_deg: f64) -> Image {
        Image {
            gray: Arc::new(Gray::filled(400, 300, 0.0)),
            time_s: 0.0,
            sensed: Sensed { heading_rad: f64::to_radians(heading_deg), height_m: 500.0 },
            intrinsics: Intrinsics::centred(400, 300, 500.0),
            pitch_rad: f64::to_radians(pitch_deg),
            roll_rad: 0.0,
        }
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
            inliers: 50,
            matches: 60,
            log10_false_alarms: -60.0,
        }
    }

    #[test]
    fn up_the_image_is_ahead_and_tilt_is_taken_out() {
        let level = image(0.0, 0.0).camera(1.0).unwrap();
        let found = step(&motion(0.0, -100.0, 0.0), &level, &level).unwrap();
        assert!((found.per_height[0]).abs() < 1e-12 && (found.per_height[1] - 0.2).abs() < 1e-12);
        // The camera tilts ahead between two images of one place: the picture moves, the aircraft does not.
        let ahead = image(0.0, 2.0).camera(1.0).unwrap();
        let shift_px = 500.0 * 2f64.to_radians().tan();
        let found = step(&motion(0.0, -shift_px, 0.0), &level, &ahead).unwrap();
        assert!(found.per_height[1].abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_turn_that_the_compass_denies_is_no_motion() {
        let sigmas = SensorSigmas {
            heading_offset_rad: 0.05,
            heading_noise_rad: 0.02,
            height_offset_ratio: 0.03,
            height_noise_ratio: 0.01,
        };
        let camera = image(0.0, 0.0).camera(1.0).unwrap();
        let turned = step(&motion(0.0, -50.0, 30.0), &camera, &camera).unwrap();
        assert!(image(10.0, 0.0).agrees(&image(41.0, 0.0), &turned, &sigmas));
        assert!(image(350.0, 0.0).agrees(&image(19.0, 0.0), &turned, &sigmas));
        assert!(!image(10.0, 0.0).agrees(&image(20.0, 0.0), &turned, &sigmas));
    }
}
