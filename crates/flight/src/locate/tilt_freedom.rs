//! `TiltFreedom`: what a vote may change of the camera's pitch and roll, and how that moves its windows on the ground.

use super::camera_pose::CameraPose;
use super::observation::Observation;
use nalgebra::{Matrix2, Vector2};
use overfly_core::camera::Camera;
use overfly_core::geodesy::{BodyFrame, BodyOffset};
use overfly_core::registration::soft_vote::TiltMotion;
use overfly_core::registration::windows::WindowSurface;

/// Pitch and roll are compared up to this many standard deviations of the attitude.
const MOST_SIGMAS: f64 = 2.0;

/// The camera of a view whose tilt is known to a standard deviation.
pub struct TiltFreedom<'a> {
    /// The pose that the view was rendered through.
    pub pose: CameraPose,
    /// The stated camera.
    pub camera: &'a Camera,
    /// One standard deviation of pitch and of roll, radians.
    pub sigma_rad: f64,
}

impl TiltFreedom<'_> {
    /// How a tilt moves the windows of a view; `None` where the camera sees the horizon.
    pub fn motion(&self, observation: &Observation, surfaces: &[WindowSurface]) -> Option<TiltMotion> {
        let grid = &observation.view.grid;
        let camera = self.pose.camera(self.camera)?;
        let turn = BodyFrame::from_heading_rad(self.pose.heading_rad);
        let at_middle = camera.image_centre_per_tilt()?;
        let px_per_rad = |surface: &WindowSurface| {
            let rise_m = observation.relief.as_ref().map_or(0.0, |relief| relief.at(surface.centre_px));
            let ground = turn.body_from_enu(grid.enu_from_grid(surface.centre_px));
            let pixel = camera.frame_from_ground(ground, rise_m)?;
            let nearer = 1.0 - rise_m / camera.height_agl_m();
            let body = camera.body_per_tilt(pixel)? * nearer - at_middle;
            let px = |axis: usize| {
                let enu = turn.enu_from_body(BodyOffset { right_m: body[(0, axis)], ahead_m: body[(1, axis)] });
                Vector2::new(enu.east_m / grid.gsd_m_per_px[0], -enu.north_m / grid.gsd_m_per_px[1])
            };
            Some(Matrix2::from_columns(&[px(0), px(1)]))
        };
        let px_per_rad = surfaces.iter().map(px_per_rad).collect::<Option<_>>()?;
        Some(TiltMotion { px_per_rad, max_rad: MOST_SIGMAS * self.sigma_rad })
    }
}
