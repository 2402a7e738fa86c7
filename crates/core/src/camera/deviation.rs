//! `CameraDeviation`: how a real camera may differ from the stated one.

/// How a real camera differs from the stated one. All zero: not at all.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraDeviation {
    /// Natural logarithm of the true height over the stated height.
    pub log_height: f64,
    /// True pitch minus stated pitch, radians.
    pub pitch_rad: f64,
    /// True roll minus stated roll, radians.
    pub roll_rad: f64,
    /// The image is wider by half of this and lower by half of it, as a ratio: pixels that are not square.
    pub aspect: f64,
    /// Shear of the image: half of it per row along the columns, half of it per column along the rows (rolling shutter, with a turn).
    pub shear: f64,
    /// The first radial coefficient of the lens beyond the stated ones, as k1 of the OpenCV model but to the first order from the
    /// image to the ray.
    pub radial: f64,
}

impl CameraDeviation {
    /// The ray (x / z, y / z) of a camera with this deviation where the stated camera's ray is `ray`. `mean_square`: the square of
    /// the radius at which `radial` does not change the scale.
    pub fn ray(&self, [x, y]: [f64; 2], mean_square: f64) -> [f64; 2] {
        let radial = 1.0 + self.radial * (x * x + y * y - mean_square);
        let (wider, sheared) = (self.aspect / 2.0, self.shear / 2.0);
        [radial * (x * (1.0 + wider) + y * sheared), radial * (y * (1.0 - wider) + x * sheared)]
    }
}
