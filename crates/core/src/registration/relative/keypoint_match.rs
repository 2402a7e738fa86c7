//! `KeypointMatch`: a keypoint of image a and one of image b that look alike.

use crate::feature::keypoint::Keypoints;
use crate::registration::similarity::Similarity;
use nalgebra::Vector2;

/// A point of image a and the point of image b that is taken for the same ground.
#[derive(Debug, Clone, Copy)]
pub struct KeypointMatch {
    /// Position in a, px from the corner.
    pub a: Vector2<f64>,
    /// Position in b, px from the corner.
    pub b: Vector2<f64>,
    /// Rotation of b against a by the keypoints' own orientations, radians.
    pub turn_rad: f64,
    /// Pixels of a per pixel of b by the scales on which the keypoints were found.
    pub scale: f64,
}

/// A keypoint's own orientation agrees with the similarity within this angle; by chance, one in 360 / 50 does.
pub const TURN_TOLERANCE_DEG: f64 = 25.0;
/// The scales on which two keypoints were found agree with that of the frames within this factor.
const SCALE_TOLERANCE: f64 = 1.7;

impl KeypointMatch {
    /// Makes the match of keypoint `i` of a and `j` of b.
    pub fn new(a: &Keypoints, i: usize, b: &Keypoints, j: usize) -> Self {
        let (p, q) = (&a.points[i], &b.points[j]);
        let position = |x_px: f32, y_px: f32| Vector2::new(f64::from(x_px), f64::from(y_px));
        Self {
            a: position(p.x_px, p.y_px),
            b: position(q.x_px, q.y_px),
            turn_rad: f64::from(p.angle_rad - q.angle_rad),
            scale: f64::from(p.scale / q.scale),
        }
    }

    /// Whether the keypoints' own orientations and scales agree with the similarity.
    pub fn agrees_in_kind(&self, a_from_b: &Similarity) -> bool {
        let scale = a_from_b.scale();
        let (sin, cos) = self.turn_rad.sin_cos();
        let ratio = scale / self.scale;
        a_from_b.c * cos + a_from_b.s * sin >= scale * TURN_TOLERANCE_DEG.to_radians().cos()
            && (1.0 / SCALE_TOLERANCE..=SCALE_TOLERANCE).contains(&ratio)
    }
}
