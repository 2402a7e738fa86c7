//! `Similarity`: shift, turn and growth of the plane.

use nalgebra::Vector2;

/// A similarity of the plane: x -> (c x - s y + t_x, s x + c y + t_y).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Scale times cosine of the turn, clockwise as seen (y runs down).
    pub c: f64,
    /// Scale times its sine.
    pub s: f64,
    /// Shift, px of a.
    pub t: Vector2<f64>,
}

impl Similarity {
    /// The one that takes two points of b to two of a; `None` where the points of b coincide.
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

    /// The one of given scale and turn that takes p of b to q of a.
    pub fn about(c: f64, s: f64, p: Vector2<f64>, q: Vector2<f64>) -> Self {
        Self { c, s, t: q - Vector2::new(c * p.x - s * p.y, s * p.x + c * p.y) }
    }

    /// Where a point of b lies in a.
    pub fn apply(&self, p: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.c * p.x - self.s * p.y, self.s * p.x + self.c * p.y) + self.t
    }

    /// Pixels of a per pixel of b.
    pub fn scale(&self) -> f64 {
        self.c.hypot(self.s)
    }

    /// Clockwise as seen in the image.
    pub fn rotation_rad(&self) -> f64 {
        self.s.atan2(self.c)
    }

    /// The same motion where a's pixels are `of_a` and b's `of_b` times as wide.
    pub fn in_pixels(&self, of_a: f64, of_b: f64) -> Self {
        let ratio = of_b / of_a;
        Self { c: self.c * ratio, s: self.s * ratio, t: self.t / of_a }
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
}
