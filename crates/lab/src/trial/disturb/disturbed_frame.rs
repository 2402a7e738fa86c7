//! `DisturbedFrame`: one disturbed frame, what is stated of it, and its truth.

use super::kind::DisturbanceKind;
use super::pixel_disturbance::pixels;
use super::virtual_camera::VirtualCamera;
use overfly_core::camera::{Attitude, Camera, CameraDeviation, CameraError, Height, Intrinsics, View};
use overfly_core::geodesy::{BodyFrame, BodyOffset, Geodetic, LocalFrame};
use overfly_core::pixels::Gray;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Tilts of the kind `tilt`, degrees; frames take turns.
const TILTS_DEG: [f64; 6] = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0];
/// One standard deviation of the errors of the kind `attitude_error`, degrees.
const ATTITUDE_ERROR_DEG: f64 = 2.0;

/// A frame of a flight as it was taken.
#[derive(Clone, Copy)]
pub struct SourceFrame<'a> {
    /// The pixels.
    pub gray: &'a Gray,
    /// The intrinsics of the flight's camera.
    pub intrinsics: &'a Intrinsics,
    /// Height by the altimeter, metres above ground.
    pub height_agl_m: f64,
    /// The attitude, as stated; taken as true.
    pub attitude: Attitude,
    /// The true nadir.
    pub nadir: Geodetic,
    /// The true heading, radians clockwise from true north.
    pub true_heading_rad: f64,
    /// Heading by the compass, radians clockwise from true north.
    pub heading_rad: f64,
}

/// A disturbed frame, what is stated of it, and its truth. The truth is as exact as the source's truth, attitude and height.
pub struct DisturbedFrame {
    /// The pixels.
    pub gray: Gray,
    /// The stated view.
    pub view: View,
    /// The stated heading, radians clockwise from true north.
    pub heading_rad: f64,
    /// The true nadir.
    pub nadir: Geodetic,
    /// The true ground under the image's centre.
    pub centre: Geodetic,
    /// How strongly the frame is disturbed, in the kind's own unit.
    pub size: f64,
}

/// How a kind changes camera and statements.
struct CameraChange {
    deviation: CameraDeviation,
    beside: [f64; 2],
    /// The attitude that is stated.
    attitude: Attitude,
    /// Factor of the stated height, and what is added to the stated heading.
    height_factor: f64,
    turn_rad: f64,
    size: f64,
}

impl DisturbedFrame {
    /// Disturbs a frame; `None` where the source shows too little for it. `number` counts the frames of a kind.
    ///
    /// # Errors
    /// Where the stated camera cannot have taken the source.
    pub fn draw(
        kind: DisturbanceKind,
        number: usize,
        source: &SourceFrame<'_>,
        rng: &mut ChaCha8Rng,
    ) -> Result<Option<Self>, CameraError> {
        let (width_px, height_px) = (source.gray.width_px() as u32, source.gray.height_px() as u32);
        let intrinsics = source.intrinsics.scaled_to(width_px, height_px)?;
        let height_agl_m = source.height_agl_m;
        let view = View::Posed {
            intrinsics: intrinsics.clone(),
            height: Height::AboveGround(height_agl_m),
            attitude: source.attitude,
        };
        let camera = Camera::new(&view, width_px, height_px)?;
        let change = CameraChange::draw(kind, number, source.attitude, rng);
        let Some(taken) = VirtualCamera::new(&camera, change.deviation, change.beside) else { return Ok(None) };
        let places = (taken.frame(source.gray), taken.centre_from_source_nadir(), taken.centre_from_nadir());
        let (Some(gray), Some(from_source), Some(from_own)) = places else { return Ok(None) };
        let shifted = |from: Geodetic, offset: BodyOffset| {
            let enu = BodyFrame::from_heading_rad(source.true_heading_rad).enu_from_body(offset);
            LocalFrame::at(from).geodetic_from_enu(enu)
        };
        let Ok(centre) = shifted(source.nadir, from_source) else { return Ok(None) };
        let Ok(nadir) = shifted(centre, BodyOffset::default() - from_own) else { return Ok(None) };
        let ([left, top], [width, height]) = (taken.corner_px(), taken.size_px());
        let [cx, cy] = intrinsics.principal_point_px;
        // What lies beside the middle of the sensor is not stated.
        let hidden = [0, 1].map(|axis| change.beside[axis] * f64::from([width_px, height_px][axis]));
        let stated = Intrinsics {
            width_px: width as u32,
            height_px: height as u32,
            principal_point_px: [cx - left + hidden[0], cy - top + hidden[1]],
            ..intrinsics
        };
        let (gray, strength) = pixels(kind, gray, rng);
        Ok(Some(Self {
            gray,
            view: View::Posed {
                intrinsics: stated,
                height: Height::AboveGround(height_agl_m * change.height_factor),
                attitude: change.attitude,
            },
            heading_rad: source.heading_rad + change.turn_rad,
            nadir,
            centre,
            size: strength.unwrap_or(change.size),
        }))
    }
}

impl CameraChange {
    fn draw(kind: DisturbanceKind, number: usize, attitude: Attitude, rng: &mut ChaCha8Rng) -> Self {
        let mut change = Self {
            deviation: CameraDeviation::default(),
            beside: [0.0; 2],
            attitude,
            height_factor: 1.0,
            turn_rad: 0.0,
            size: 0.0,
        };
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        match kind {
            DisturbanceKind::Tilt => {
                let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
                change.size = TILTS_DEG[number % TILTS_DEG.len()];
                let [pitch_rad, roll_rad] = attitude.assumed_rad();
                change.deviation.pitch_rad = change.size.to_radians() * cos - pitch_rad;
                change.deviation.roll_rad = change.size.to_radians() * sin - roll_rad;
                change.attitude = Attitude::UNSTATED;
            }
            DisturbanceKind::AttitudeError => {
                let mut error = || (ATTITUDE_ERROR_DEG * normal(rng)).to_radians();
                (change.deviation.pitch_rad, change.deviation.roll_rad) = (error(), error());
                change.size = change.deviation.pitch_rad.hypot(change.deviation.roll_rad).to_degrees();
                let [pitch_rad, roll_rad] = attitude.assumed_rad();
                change.attitude = Attitude::new(Some(pitch_rad), Some(roll_rad), Some(ATTITUDE_ERROR_DEG.to_radians()));
            }
            DisturbanceKind::Aspect => {
                change.size = rng.random_range(-0.05..0.05);
                change.deviation.aspect = change.size;
            }
            DisturbanceKind::Shear => {
                change.size = sign * rng.random_range(0.002..0.03);
                change.deviation.shear = change.size;
            }
            DisturbanceKind::Distortion => {
                change.size = sign * rng.random_range(0.05..0.2);
                change.deviation.radial = change.size;
            }
            DisturbanceKind::PrincipalPoint => {
                change.beside = [0, 1].map(|_| rng.random_range(-0.1..0.1));
                change.size = change.beside[0].hypot(change.beside[1]);
                change.attitude =
                    Attitude { sigma_rad: Attitude::UNSTATED.sigma_rad.max(attitude.sigma_rad), ..attitude };
            }
            DisturbanceKind::ScaleError => {
                change.size = sign * rng.random_range(0.05..0.15);
                change.height_factor = 1.0 + change.size;
            }
            DisturbanceKind::HeadingError => {
                change.size = sign * rng.random_range(5.0..20.0);
                change.turn_rad = change.size.to_radians();
            }
            _ => {}
        }
        change
    }
}

/// A nearly normal number: the sum of twelve uniform ones.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}
