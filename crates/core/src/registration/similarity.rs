//! `Similarity`: shift, rotation and scale of the plane.
//!
//! A similarity is named after the images that it maps: `a_from_b` takes a point of b to the point of a that shows the same
//! ground, `map_from_view` a point of a view to the map.

use nalgebra::{Matrix2, Matrix4, Vector2};

/// A similarity of the plane, here `a_from_b`: (x, y) -> (c x - s y + t_x, s x + c y + t_y).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Scale times the cosine of the rotation, which is clockwise as seen (y runs down).
    pub c: f64,
    /// Scale times the sine of the rotation.
    pub s: f64,
    /// Shift, px of a.
    pub t: Vector2<f64>,
}

impl Similarity {
    /// Makes the similarity that takes two points of b to two points of a; `None` where the points of b coincide.
    ///
    /// # References
    /// Equations 34 to 36, which hold at equal scale; here normalised by the lengths' ratio.
    pub fn through(b: [Vector2<f64>; 2], a: [Vector2<f64>; 2]) -> Option<Self> {
        let (db, da) = (b[1] - b[0], a[1] - a[0]);
        let square = db.norm_squared();
        if square < 1e-9 {
            return None;
        }
        let c = (db.x * da.x + db.y * da.y) / square;
        let s = (db.x * da.y - db.y * da.x) / square;
        Some(Self::about(c, s, b[0], a[0]))
    }

    /// Makes the similarity of given linear part (scale times cosine and sine) that takes point `p` of b to point `q` of a.
    pub fn about(c: f64, s: f64, p: Vector2<f64>, q: Vector2<f64>) -> Self {
        Self { c, s, t: q - Vector2::new(c * p.x - s * p.y, s * p.x + c * p.y) }
    }

    /// The point of a that shows the same ground as point `p` of b.
    pub fn apply(&self, p: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.c * p.x - self.s * p.y, self.s * p.x + self.c * p.y) + self.t
    }

    /// Pixels of a per pixel of b.
    pub fn scale(&self) -> f64 {
        self.c.hypot(self.s)
    }

    /// Rotation of b against a, clockwise as seen in the image.
    pub fn rotation_rad(&self) -> f64 {
        self.s.atan2(self.c)
    }

    /// The same similarity in other pixels: those of a are `of_a` times, those of b `of_b` times as wide.
    pub fn in_pixels(&self, of_a: f64, of_b: f64) -> Self {
        let ratio = of_b / of_a;
        Self { c: self.c * ratio, s: self.s * ratio, t: self.t / of_a }
    }
}

/// The precision of a similarity: its variances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Precision {
    /// Covariance of the point of a that the similarity takes b's centre to, px^2.
    pub centre_px2: Matrix2<f64>,
    /// Variance of the rotation, rad^2.
    pub turn_rad2: f64,
    /// Variance of the logarithm of the scale.
    pub log_scale2: f64,
}

impl Precision {
    /// Makes a precision from the covariance of (x, y, c, s), x and y being where b's centre is taken.
    pub fn from_covariance(similarity: &Similarity, covariance: &Matrix4<f64>) -> Self {
        let linear = covariance.fixed_view::<2, 2>(2, 2).into_owned();
        let along = Vector2::new(similarity.c, similarity.s) / similarity.scale().powi(2);
        let across = Vector2::new(-along.y, along.x);
        Self {
            centre_px2: covariance.fixed_view::<2, 2>(0, 0).into_owned(),
            turn_rad2: across.dot(&(linear * across)),
            log_scale2: along.dot(&(linear * along)),
        }
    }

    /// The same precision where the pixels of a are `of_a` times as wide.
    pub fn in_pixels(&self, of_a: f64) -> Self {
        Self { centre_px2: self.centre_px2 / (of_a * of_a), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goes_through_both_points_and_changes_pixels() {
        let (b, a) = ([[1.0, 2.0], [5.0, -3.0]], [[10.0, 20.0], [16.0, 31.0]]);
        let s = Similarity::through(b.map(Vector2::from), a.map(Vector2::from)).unwrap();
        for (b, a) in b.into_iter().zip(a) {
            assert!((s.apply(b.into()) - Vector2::from(a)).norm() < 1e-12);
            let binned = s.in_pixels(2.0, 4.0);
            assert!((binned.apply(Vector2::from(b) / 4.0) - Vector2::from(a) / 2.0).norm() < 1e-12);
        }
        assert!(Similarity::through([[1.0, 1.0].into(); 2], a.map(Vector2::from)).is_none());
    }

    /// (32, 33): where image 2, turned by `theta` and shifted by `t`, sees a point of image 1 (y up, as the paper has it).
    fn seen_from_image_2(p: [f64; 2], theta: f64, t: [f64; 2]) -> [f64; 2] {
        let ((sin, cos), x, y) = (theta.sin_cos(), p[0] - t[0], p[1] - t[1]);
        [cos * x + sin * y, -sin * x + cos * y]
    }

    /// Cosine, sine and shift from two descriptors by (34), (35) and (36) as printed.
    fn printed(image_1: [[f64; 2]; 2], image_2: [[f64; 2]; 2]) -> [f64; 4] {
        let [dx, dy] = [image_1[1][0] - image_1[0][0], image_1[1][1] - image_1[0][1]];
        let [ex, ey] = [image_2[1][0] - image_2[0][0], image_2[1][1] - image_2[0][1]];
        let square = ex * ex + ey * ey;
        let (cos, sin) = ((ex * dx + ey * dy) / square, (ex * dy - ey * dx) / square);
        let ([x1, y1], [u1, v1]) = (image_1[0], image_2[0]);
        [cos, sin, -u1 * cos + v1 * sin + x1, -u1 * sin - v1 * cos + y1]
    }

    #[test]
    fn two_descriptors_give_turn_and_shift_as_equations_32_to_36_do() {
        let (d, theta, t) = ([[120.0, -40.0], [-75.0, 210.0]], 0.7, [33.0, 88.0]);
        let seen = d.map(|p| seen_from_image_2(p, theta, t));
        let [cos, sin, t_x, t_y] = printed(d, seen);
        assert!((cos - theta.cos()).abs() < 1e-12 && (sin - theta.sin()).abs() < 1e-12);
        assert!((t_x - t[0]).abs() < 1e-9 && (t_y - t[1]).abs() < 1e-9);
        let s = Similarity::through(seen.map(Vector2::from), d.map(Vector2::from)).unwrap();
        assert!((s.c - cos).abs() < 1e-12 && (s.s - sin).abs() < 1e-12);
        assert!((s.t - Vector2::new(t_x, t_y)).norm() < 1e-9 && (s.scale() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn at_unequal_scale_the_printed_cosine_and_sine_carry_the_scale() {
        let (d, theta, t) = ([[120.0, -40.0], [-75.0, 210.0]], 0.7, [33.0, 88.0]);
        // Image 2 from a tenth lower: its ground lies 1 / 0.9 times as far from its centre.
        let seen = d.map(|p| seen_from_image_2(p, theta, t).map(|x| x / 0.9));
        let [cos, sin, ..] = printed(d, seen);
        assert!((cos.hypot(sin) - 0.9).abs() < 1e-12 && (cos.acos() - theta).abs() > 0.1);
        let s = Similarity::through(seen.map(Vector2::from), d.map(Vector2::from)).unwrap();
        assert!((s.scale() - 0.9).abs() < 1e-12 && (s.rotation_rad() - theta).abs() < 1e-12);
    }

    #[test]
    fn the_shift_does_not_follow_from_the_turn() {
        // Straight flight ahead: t = (0, 80), theta = 0. "t_y = t_x tan(theta)" would make t_y 0.
        let (d, theta, t) = ([[120.0, -40.0], [-75.0, 210.0]], 0.0f64, [0.0, 80.0]);
        let [_, _, t_x, t_y] = printed(d, d.map(|p| seen_from_image_2(p, theta, t)));
        assert!((t_y - 80.0).abs() < 1e-9 && (t_x * theta.tan()).abs() < 1e-9);
    }

    #[test]
    fn rotation_and_scale_are_across_and_along() {
        // (c, s) = 2 (cos 30, sin 30): 0.02 along (c, s) is 1 % of scale, 0.04 across is 0.02 rad of rotation.
        let (sin, cos) = 30f64.to_radians().sin_cos();
        let (along, across) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
        let mut covariance = Matrix4::identity();
        let linear = along * along.transpose() * 0.02f64.powi(2) + across * across.transpose() * 0.04f64.powi(2);
        covariance.fixed_view_mut::<2, 2>(2, 2).copy_from(&linear);
        let found =
            Precision::from_covariance(&Similarity { c: 2.0 * cos, s: 2.0 * sin, t: Vector2::zeros() }, &covariance);
        assert!((found.turn_rad2.sqrt() - 0.02).abs() < 1e-12 && (found.log_scale2.sqrt() - 0.01).abs() < 1e-12);
    }
}
