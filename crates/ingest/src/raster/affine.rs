//! `Affine`: the geotransform, from pixels to plane coordinates and back.

/// x = origin_x + column * column_x + row * row_x, and y likewise. Pixels count from the corner of the first pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Affine {
    pub origin: [f64; 2],
    pub column: [f64; 2],
    pub row: [f64; 2],
}

impl Affine {
    /// Returns the transform with its origin moved from the first pixel's centre to its corner.
    pub fn corner_based(self) -> Self {
        let origin = std::array::from_fn(|i| self.origin[i] - 0.5 * (self.column[i] + self.row[i]));
        Self { origin, ..self }
    }

    /// Returns what is wrong with the transform, if anything: it is not finite, or has no inverse.
    pub fn fault(&self) -> Option<String> {
        let all = [self.origin, self.column, self.row].concat();
        if all.iter().any(|v| !v.is_finite()) {
            return Some(format!("the geotransform holds {all:?}"));
        }
        let scale = self.column[0].abs().max(self.column[1].abs()) * self.row[0].abs().max(self.row[1].abs());
        let det = self.determinant();
        // Rounding leaves 1e-16 of the products; pixels squeezed by more than 10^6 make no image either.
        if !det.is_normal() || det.abs() < scale * 1e-6 {
            return Some(format!("the geotransform is singular: pixel axes {:?} and {:?}", self.column, self.row));
        }
        let (long, wide) = (self.column[0].hypot(self.column[1]), self.row[0].hypot(self.row[1]));
        if !(1e-3..=1e3).contains(&(long / wide)) {
            return Some(format!("its pixels would be {long:e} by {wide:e} of the CRS's units"));
        }
        None
    }

    fn determinant(&self) -> f64 {
        self.column[0] * self.row[1] - self.row[0] * self.column[1]
    }

    /// Returns the plane coordinates of a pixel position.
    pub fn plane_from_pixel(&self, x_px: f64, y_px: f64) -> (f64, f64) {
        (
            self.origin[0] + x_px * self.column[0] + y_px * self.row[0],
            self.origin[1] + x_px * self.column[1] + y_px * self.row[1],
        )
    }

    /// Returns the pixel position of plane coordinates. The transform must have no [`fault`](Self::fault).
    pub fn pixel_from_plane(&self, x: f64, y: f64) -> (f64, f64) {
        let (dx, dy, det) = (x - self.origin[0], y - self.origin[1], self.determinant());
        ((dx * self.row[1] - dy * self.row[0]) / det, (dy * self.column[0] - dx * self.column[1]) / det)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn comes_back_from_the_plane(angle in 0.0..6.3f64, a in 0.1..10.0f64, b in 0.1..10.0f64, x in 0.0..1e5f64, y in 0.0..1e5f64) {
            let t = Affine { origin: [5e5, 5e6], column: [a * angle.cos(), a * angle.sin()], row: [b * angle.sin(), -b * angle.cos()] };
            prop_assert_eq!(t.fault(), None);
            let (u, v) = t.plane_from_pixel(x, y);
            let (x1, y1) = t.pixel_from_plane(u, v);
            // 1e-9 m of the plane is what an f64 of 5e6 holds; the smallest pixel is 0.1 m.
            prop_assert!((x1 - x).abs() < 1e-5 && (y1 - y).abs() < 1e-5);
        }
    }

    #[test]
    fn finds_transforms_without_an_inverse() {
        let good = Affine { origin: [0.0; 2], column: [1.0, 0.0], row: [0.0, -1.0] };
        assert!(good.fault().is_none());
        for bad in [
            Affine { row: [0.0, 0.0], ..good },
            Affine { row: [2.0, 0.0], ..good },
            Affine { origin: [f64::NAN, 0.0], ..good },
            Affine { column: [f64::INFINITY, 0.0], ..good },
            Affine { column: [1e-320, 0.0], ..good },
        ] {
            assert!(bad.fault().is_some(), "{bad:?}");
        }
    }
}
