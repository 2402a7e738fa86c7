//! `Intrinsics`: a pinhole camera with OpenCV's distortion model.

use super::CameraError;
use serde::{Deserialize, Serialize};

/// A pinhole camera, with the keys of `camera.toml`. Pixels are counted from the image's upper-left corner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intrinsics {
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
}

impl Intrinsics {
    /// Makes a camera without distortion and with its principal point in the middle of the image.
    pub fn centred(width_px: u32, height_px: u32, focal_length_px: f64) -> Self {
        let principal_point_px = [f64::from(width_px) / 2.0, f64::from(height_px) / 2.0];
        Self { width_px, height_px, focal_length_px, principal_point_px, distortion: [0.0; 5] }
    }

    /// Checks that the values describe a camera.
    ///
    /// # Errors
    /// [`CameraError`] for a size of zero, a focal length that is not positive, or a value that is not finite.
    pub fn check(&self) -> Result<(), CameraError> {
        let positive = |name, value: f64| {
            if value.is_finite() && value > 0.0 { Ok(()) } else { Err(CameraError::NotPositive { name, value }) }
        };
        positive("width_px", f64::from(self.width_px))?;
        positive("height_px", f64::from(self.height_px))?;
        positive("focal_length_px", self.focal_length_px)?;
        let others = self.principal_point_px.iter().chain(&self.distortion);
        match others.copied().find(|v| !v.is_finite()) {
            Some(value) => Err(CameraError::NotFinite { name: "principal_point_px or distortion", value }),
            None => Ok(()),
        }
    }

    /// Scales the camera to a frame delivered at another size.
    ///
    /// # Errors
    /// [`CameraError::OtherAspect`] where the frame's aspect differs by more than 1 %: the frame is then a crop, and these
    /// intrinsics do not apply.
    pub fn scaled_to(&self, width_px: u32, height_px: u32) -> Result<Self, CameraError> {
        let (sx, sy) =
            (f64::from(width_px) / f64::from(self.width_px), f64::from(height_px) / f64::from(self.height_px));
        let squeeze = (sx / sy - 1.0).abs();
        if squeeze.is_nan() || squeeze > 0.01 {
            return Err(CameraError::OtherAspect {
                width_px,
                height_px,
                expected_width_px: self.width_px,
                expected_height_px: self.height_px,
            });
        }
        Ok(Self {
            width_px,
            height_px,
            focal_length_px: self.focal_length_px * (sx * sy).sqrt(),
            principal_point_px: [self.principal_point_px[0] * sx, self.principal_point_px[1] * sy],
            distortion: self.distortion,
        })
    }

    /// The frame position, pixels, of a ray (x / z, y / z) with x right and y down; `None` beyond the radius at which the
    /// distortion polynomial turns back.
    ///
    /// # References
    /// OpenCV, camera calibration: x'' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2).
    pub fn frame_from_ray(&self, ray: [f64; 2]) -> Option<[f64; 2]> {
        let [x, y] = ray;
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let slope = 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3));
        if radial <= 0.0 || slope <= 0.0 {
            return None;
        }
        let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        let [cx, cy] = self.principal_point_px;
        Some([cx + self.focal_length_px * xd, cy + self.focal_length_px * yd])
    }

    /// The ray (x / z, y / z) of a frame position, pixels: the inverse of [`Intrinsics::frame_from_ray`], by fixed-point
    /// iteration.
    pub fn ray_from_frame(&self, pixel: [f64; 2]) -> [f64; 2] {
        let [cx, cy] = self.principal_point_px;
        let target = [(pixel[0] - cx) / self.focal_length_px, (pixel[1] - cy) / self.focal_length_px];
        let [k1, k2, p1, p2, k3] = self.distortion;
        let mut ray = target;
        for _ in 0..20 {
            let [x, y] = ray;
            let r2 = x * x + y * y;
            let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            ray = [
                (target[0] - 2.0 * p1 * x * y - p2 * (r2 + 2.0 * x * x)) / radial,
                (target[1] - p1 * (r2 + 2.0 * y * y) - 2.0 * p2 * x * y) / radial,
            ];
        }
        ray
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_comes_back_through_the_distortion() {
        let mut camera = Intrinsics::centred(1000, 800, 900.0);
        camera.distortion = [-0.12, 0.03, 0.001, -0.0005, 0.002];
        for pixel in [[500.0, 400.0], [20.0, 30.0], [990.0, 10.0]] {
            let back = camera.frame_from_ray(camera.ray_from_frame(pixel)).unwrap();
            assert!((back[0] - pixel[0]).abs() < 1e-6 && (back[1] - pixel[1]).abs() < 1e-6, "{pixel:?} {back:?}");
        }
    }

    #[test]
    fn a_crop_is_refused_and_a_thumbnail_is_scaled() {
        let camera = Intrinsics::centred(4000, 2000, 3000.0);
        assert!(camera.scaled_to(2000, 2000).is_err());
        assert_eq!(camera.scaled_to(1000, 500).unwrap().focal_length_px, 750.0);
    }
}
