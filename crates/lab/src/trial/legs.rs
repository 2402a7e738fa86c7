//! Relative registration on a real flight: the motion between consecutive frames beside the altimeter, the compass
//! and the satellite positions.
//!
//! The truth is not known to a fraction of a pixel, but nothing is synthetic: relief, trees, houses, the lens, the
//! light.

use super::error::TrialError;
use super::recorded_flight::{RecordedFlight, RecordedFrame, runs};
use overfly_core::camera::Camera;
use overfly_core::geodesy::{BodyFrame, BodyOffset, Enu, LocalFrame, wrap_turn_rad};
use overfly_core::registration::relative::{Motion, MotionAnswer, MotionPrior, register};
use overfly_flight::frame::read_frame;
use serde::Serialize;
use std::time::Instant;

/// Assumed errors of the sensors, one standard deviation each.
#[derive(Debug, Clone, Copy)]
pub struct LegSensorSigmas {
    /// Position, per axis, metres.
    pub position_m: f64,
    /// Heading, radians.
    pub heading_rad: f64,
    /// Height, as a ratio of the height.
    pub height_ratio: f64,
}

/// The way between two consecutive frames.
#[derive(Debug, Clone, Serialize)]
pub struct Leg {
    /// The first frame.
    pub image_a: String,
    /// The second.
    pub image_b: String,
    /// The registered motion beside the sensors; `None` without a motion.
    pub measured: Option<LegComparison>,
    /// The answer of the registration.
    #[serde(flatten)]
    pub answer: MotionAnswer,
    /// Duration from both decoded frames in memory to the answer, milliseconds.
    pub elapsed_ms: f64,
}

/// A registered motion beside the sensors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LegComparison {
    /// Height of b over height of a, above ground: the scale that the motion should have.
    pub height_ratio: f64,
    /// Displacement by the motion with a's height and heading, metres east and north.
    pub displacement_m: [f64; 2],
    /// Displacement by the positions, metres east and north.
    pub position_displacement_m: [f64; 2],
    /// Change of heading by the compass, degrees clockwise.
    pub heading_change_deg: f64,
    /// Whether scale and displacement agree within three standard deviations of the sensors' errors.
    pub agrees: bool,
}

/// The score of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LegScore {
    /// Pairs of consecutive frames.
    pub legs: usize,
    /// Registered pairs.
    pub registered: usize,
    /// Registered pairs that agree with the sensors.
    pub agreeing: usize,
}

impl LegScore {
    /// Counts legs.
    pub fn from_legs(legs: &[Leg]) -> Self {
        let measured = || legs.iter().filter_map(|leg| leg.measured);
        Self { legs: legs.len(), registered: measured().count(), agreeing: measured().filter(|m| m.agrees).count() }
    }
}

/// Three sigma in two dimensions: the 99.73 % quantile of chi-square with two degrees of freedom.
const THREE_SIGMA_2D: f64 = 11.829;

/// Registers every frame against the one before it in the same run; calls `progress` after each.
///
/// # Errors
/// If a frame has no position, cannot be decoded, or looks above the horizon. "No motion" is an outcome.
pub fn run_legs(
    flight: &RecordedFlight,
    sensors: &LegSensorSigmas,
    mut progress: impl FnMut(&Leg),
) -> Result<Vec<Leg>, TrialError> {
    let mut legs = Vec::new();
    for [a, b] in consecutive(&flight.frames) {
        let (pixels_a, pixels_b) = (read_frame(&a.path)?, read_frame(&b.path)?);
        let asked = Instant::now();
        let answer = register(&pixels_a, &pixels_b, &MotionPrior::default());
        let elapsed_ms = asked.elapsed().as_micros() as f64 / 1e3;
        let size = |n: usize| u32::try_from(n).expect("frames are bounded");
        let camera = Camera::new(&a.view(&flight.camera), size(pixels_a.width_px()), size(pixels_a.height_px()))
            .map_err(|cause| TrialError::Locate { image: a.image.clone(), cause: cause.into() })?;
        let by_position = by_position(flight, a, b)?;
        let measured = match &answer {
            MotionAnswer::Motion(m) => Some(compared(m, a, b, camera.gsd_m_per_px(), by_position, sensors)),
            MotionAnswer::NoMotion { .. } => None,
        };
        let leg = Leg { image_a: a.image.clone(), image_b: b.image.clone(), measured, answer, elapsed_ms };
        progress(&leg);
        legs.push(leg);
    }
    Ok(legs)
}

/// Pairs of consecutive frames of one run, in order.
fn consecutive(frames: &[RecordedFrame]) -> Vec<[&RecordedFrame; 2]> {
    runs(frames).into_iter().flat_map(|run| run.windows(2)).map(|pair| [&pair[0], &pair[1]]).collect()
}

fn by_position(flight: &RecordedFlight, a: &RecordedFrame, b: &RecordedFrame) -> Result<Enu, TrialError> {
    let position =
        |f: &RecordedFrame| f.true_position.ok_or(TrialError::NoTruth { path: flight.path.clone(), line: f.line });
    Ok(LocalFrame::at(position(a)?).enu_from_geodetic(position(b)?))
}

fn compared(
    motion: &Motion,
    a: &RecordedFrame,
    b: &RecordedFrame,
    gsd_m_per_px: f64,
    by_position: Enu,
    s: &LegSensorSigmas,
) -> LegComparison {
    let moved = BodyOffset::from_image_px(motion.displacement_px, gsd_m_per_px);
    let moved = BodyFrame::from_heading_rad(a.heading_rad).enu_from_body(moved);
    let displacement_m = [moved.east_m, moved.north_m];
    let position_displacement_m = [by_position.east_m, by_position.north_m];
    let height_ratio = b.height_agl_m / a.height_agl_m;
    // The height errs along the motion, the heading across it, and the positions in all directions.
    let length_m = displacement_m[0].hypot(displacement_m[1]).max(1e-9);
    let off = [0, 1].map(|i| displacement_m[i] - position_displacement_m[i]);
    let unit = displacement_m.map(|v| v / length_m);
    let (along, across) = (off[0] * unit[0] + off[1] * unit[1], off[1] * unit[0] - off[0] * unit[1]);
    let square = |ratio: f64| 2.0 * s.position_m.powi(2) + (length_m * ratio).powi(2);
    let distance = along * along / square(s.height_ratio) + across * across / square(s.heading_rad);
    let scale_off = (motion.scale / height_ratio).ln().abs();
    LegComparison {
        height_ratio,
        displacement_m,
        position_displacement_m,
        heading_change_deg: wrap_turn_rad(b.heading_rad - a.heading_rad).to_degrees(),
        agrees: distance <= THREE_SIGMA_2D && scale_off <= 3.0 * 2f64.sqrt() * s.height_ratio,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::Attitude;
    use overfly_core::geodesy::Geodetic;

    fn frame(time_s: f64, heading_deg: f64, height_agl_m: f64) -> RecordedFrame {
        RecordedFrame {
            line: 2,
            image: "a".into(),
            path: "a".into(),
            time_s,
            true_position: Geodetic::from_degrees(47.0, 8.0).ok(),
            true_heading_rad: None,
            height_agl_m,
            height_msl_m: None,
            camera: None,
            heading_rad: heading_deg.to_radians(),
            attitude: Attitude::UNSTATED,
        }
    }

    #[test]
    fn a_pause_ends_a_run() {
        let frames: Vec<_> = [0.0, 2.0, 4.0, 60.0, 62.0].map(|t| frame(t, 0.0, 50.0)).into();
        let starts: Vec<_> = consecutive(&frames).iter().map(|[a, _]| a.time_s).collect();
        assert_eq!(starts, [0.0, 2.0, 60.0]);
        assert!(consecutive(&frames[..1]).is_empty());
    }

    #[test]
    fn ahead_at_heading_east_is_east_and_agreement_has_its_bounds() {
        let motion = Motion {
            a_from_b: [[1.0, 0.0, 0.0], [0.0, 1.0, -100.0]],
            rotation_deg: 0.0,
            scale: 1.0,
            displacement_px: [0.0, -100.0],
            covariance_px2: [[0.01, 0.0], [0.0, 0.01]],
            rotation_sigma_deg: 0.05,
            scale_sigma_ratio: 0.001,
            inliers: 40,
            matches: 50,
            log10_false_alarms: -40.0,
        };
        let sensors = LegSensorSigmas { position_m: 1.0, heading_rad: 0.05, height_ratio: 0.03 };
        let (a, b) = (frame(0.0, 90.0, 50.0), frame(2.0, 350.0, 51.0));
        let with = |east_m: f64| compared(&motion, &a, &b, 0.2, Enu { east_m, north_m: 0.0 }, &sensors);
        let found = with(21.0);
        assert!((found.displacement_m[0] - 20.0).abs() < 1e-9 && found.displacement_m[1].abs() < 1e-9);
        assert!((found.heading_change_deg + 100.0).abs() < 1e-9 && found.agrees);
        // One sigma along the motion is sqrt(2 + 0.36) m; three sigma in two dimensions (3.44) are 5.3 m.
        assert!(with(25.0).agrees && !with(25.5).agrees);
    }
}
