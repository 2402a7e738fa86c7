//! `CameraPose`: one hypothesis of where the camera was.

use overfly_core::camera::Camera;
use overfly_core::geodesy::Heading;
use overfly_core::registration::Similarity;
use overfly_core::tile::WorldPixel;

/// Position, heading and height of the camera under one hypothesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPose {
    /// The nadir, in pixels of the world at `zoom`.
    pub nadir: WorldPixel,
    /// The level of `nadir`.
    pub zoom: u8,
    /// Heading, radians clockwise from true north.
    pub heading_rad: f64,
    /// True height over the stated height.
    pub height_ratio: f64,
    /// True pitch and roll less the assumed ones, radians, about the ground point under the image's centre: `nadir` is where the nadir
    /// would be without.
    pub tilt_rad: [f64; 2],
}

impl CameraPose {
    /// The camera that sees through this pose, where `camera` is the stated one; `None` where it sees the horizon.
    pub(super) fn camera(&self, camera: &Camera) -> Option<Camera> {
        let camera = camera.at_height_ratio(self.height_ratio);
        if self.tilt_rad == [0.0; 2] { Some(camera) } else { camera.tilted_about_image_centre(self.tilt_rad) }
    }

    /// The same pose in the pixels of another level.
    pub fn at_zoom(self, zoom: u8) -> Self {
        let factor = 2f64.powi(i32::from(zoom) - i32::from(self.zoom));
        let nadir = WorldPixel { x_px: self.nadir.x_px * factor, y_px: self.nadir.y_px * factor };
        Self { nadir, zoom, ..self }
    }

    /// The pose after a measured correction about the nadir, which [`fit_windows`] gives.
    ///
    /// [`fit_windows`]: overfly_core::registration::window_fit::fit_windows
    pub fn corrected(self, map_from_view: &Similarity) -> Self {
        let Similarity { c, s, t } = *map_from_view;
        let nadir = WorldPixel { x_px: self.nadir.x_px + t.x, y_px: self.nadir.y_px + t.y };
        let heading_rad = Heading::from_radians(self.heading_rad + s).radians();
        Self { nadir, heading_rad, height_ratio: self.height_ratio * c, ..self }
    }
}
