//! `VirtualCamera`: a frame as another camera would have taken it, which looked at the same point of the ground.

use nalgebra::Vector2;
use overfly_core::camera::{Camera, CameraDeviation};
use overfly_core::geodesy::BodyOffset;
use overfly_core::pixels::Gray;

/// A camera that looks at the ground at the source frame's centre, with a deviation from the source's camera. Its frame is a cut
/// of the source's size, small enough that the source shows all of its ground.
pub struct VirtualCamera<'a> {
    source: &'a Camera,
    deviation: CameraDeviation,
    /// Size of its frame as a share of the source's, and the offset of its middle from the source's middle, as a share of the size.
    share: f64,
    beside: [f64; 2],
}

/// The cut shrinks by steps of this until the source shows all of it, down to the least share.
const SHARE_STEP: f64 = 0.02;
const LEAST_SHARE: f64 = 0.5;

impl<'a> VirtualCamera<'a> {
    /// Returns the virtual camera with the largest frame; `None` where the source shows too little. `beside`: how far beside the
    /// middle of the sensor its frame is cut, as a share of the source's size.
    pub fn new(source: &'a Camera, deviation: CameraDeviation, beside: [f64; 2]) -> Option<Self> {
        let mut camera = Self { source, deviation, share: 1.0, beside };
        while camera.share >= LEAST_SHARE {
            if camera.is_inside() {
                return Some(camera);
            }
            camera.share -= SHARE_STEP;
        }
        None
    }

    /// Columns and rows of its frame.
    pub fn size_px(&self) -> [usize; 2] {
        let (w, h) = self.source.frame_size_px();
        [w, h].map(|side| (f64::from(side) * self.share).floor() as usize)
    }

    /// The offset of its frame's corner from the source's, pixels.
    pub fn corner_px(&self) -> [f64; 2] {
        let (w, h) = self.source.frame_size_px();
        let [tw, th] = self.size_px();
        let at = |side: u32, own: usize, beside: f64| ((f64::from(side) * (0.5 + beside)) - own as f64 / 2.0).round();
        [at(w, tw, self.beside[0]), at(h, th, self.beside[1])]
    }

    /// The ground at its image's centre, as an offset from its own nadir.
    pub fn centre_from_nadir(&self) -> Option<BodyOffset> {
        let [w, h] = self.size_px();
        self.ground([w as f64 / 2.0, h as f64 / 2.0])
    }

    /// The ground at its image's centre, as an offset from the source's nadir.
    pub fn centre_from_source_nadir(&self) -> Option<BodyOffset> {
        let (w, h) = self.source.frame_size_px();
        let [x, y] = self.beside;
        self.source.body_from_frame([f64::from(w) * (0.5 + x), f64::from(h) * (0.5 + y)])
    }

    /// Its frame.
    pub fn frame(&self, source: &Gray) -> Option<Gray> {
        let [width, height] = self.size_px();
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let [u, v] = self.source_px([x as f64 + 0.5, y as f64 + 0.5])?;
                values.push(source.sample(u, v));
            }
        }
        Gray::from_values(width, height, values)
    }

    /// The ground under a position in its frame, as an offset from its nadir.
    fn ground(&self, [x, y]: [f64; 2]) -> Option<BodyOffset> {
        let [left, top] = self.corner_px();
        let ray = self.source.ray_from_frame([x + left, y + top]);
        self.source.deviated(&self.deviation).body_from_ray(self.deviation.ray(ray, 0.0), 0.0)
    }

    /// The position in the source's frame that shows the same ground.
    fn source_px(&self, pixel: [f64; 2]) -> Option<[f64; 2]> {
        let from_centre = self.ground(pixel)? - self.centre_from_nadir()?;
        let centre = self.centre_from_source_nadir()?;
        self.source.frame_from_body(BodyOffset {
            right_m: centre.right_m + from_centre.right_m,
            ahead_m: centre.ahead_m + from_centre.ahead_m,
        })
    }

    /// Whether the source shows the ground of every pixel at its frame's edge.
    fn is_inside(&self) -> bool {
        let (w, h) = self.source.frame_size_px();
        let [tw, th] = self.size_px().map(|side| side as f64);
        let most = Vector2::new(f64::from(w) - 1.0, f64::from(h) - 1.0);
        let holds =
            |pixel| self.source_px(pixel).is_some_and(|[u, v]| u >= 1.0 && v >= 1.0 && u <= most.x && v <= most.y);
        (0..=8).all(|i| {
            let t = f64::from(i) / 8.0;
            [[t * tw, 0.0], [t * tw, th], [0.0, t * th], [tw, t * th]].into_iter().all(holds)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::{Attitude, Height, Intrinsics, View};

    fn camera(pitch_deg: f64, width_px: u32, height_px: u32, principal_point_px: [f64; 2]) -> Camera {
        let view = View::Posed {
            intrinsics: Intrinsics { principal_point_px, ..Intrinsics::centred(width_px, height_px, 400.0) },
            height: Height::AboveGround(2200.0),
            attitude: Attitude::exact(pitch_deg.to_radians(), 0.0),
        };
        Camera::new(&view, width_px, height_px).unwrap()
    }

    #[test]
    fn a_tilted_frame_shows_what_the_camera_model_says() {
        let source = camera(0.0, 256, 192, [128.0, 96.0]);
        let ground = |x: f64, y: f64| ((x / 40.0).sin() + (y / 55.0).cos()) as f32;
        let values = (0..256 * 192)
            .map(|i| {
                let at = source.body_from_frame([f64::from(i % 256) + 0.5, f64::from(i / 256) + 0.5]).unwrap();
                ground(at.right_m, at.ahead_m)
            })
            .collect();
        let gray = Gray::from_values(256, 192, values).unwrap();
        let deviation = CameraDeviation { pitch_rad: 5f64.to_radians(), ..CameraDeviation::default() };
        let virtual_camera = VirtualCamera::new(&source, deviation, [0.0; 2]).unwrap();
        let frame = virtual_camera.frame(&gray).unwrap();
        let [left, top] = virtual_camera.corner_px();
        let (w, h) = (frame.width_px(), frame.height_px());
        let tilted = camera(5.0, w as u32, h as u32, [128.0 - left, 96.0 - top]);
        // The nadir lies behind the centre by h tan(5 degrees).
        let centre = virtual_camera.centre_from_nadir().unwrap();
        assert!((centre.ahead_m - 2200.0 * 5f64.to_radians().tan()).abs() < 3.0, "{centre:?}");
        for (x, y) in [(3, 4), (w - 4, 6), (w / 2, h - 5)] {
            let at = tilted.body_from_frame([x as f64 + 0.5, y as f64 + 0.5]).unwrap();
            let expected = ground(at.right_m - centre.right_m, at.ahead_m - centre.ahead_m);
            assert!((frame.at(x, y) - expected).abs() < 0.02, "{x} {y}: {} {expected}", frame.at(x, y));
        }
    }
}
