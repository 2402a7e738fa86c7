//! `LocalFrame`: the east-north plane at a point of the ellipsoid, and `Enu`, an offset in that plane.

use super::{ECCENTRICITY_SQUARED, GeodesyError, Geodetic, SEMI_MAJOR_M, SEMI_MINOR_M, normal_radius_m};
use nalgebra::{Matrix3, Vector3};

/// A horizontal offset in a local frame, metres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Enu {
    /// Towards true east, metres.
    pub east_m: f64,
    /// Towards true north, metres.
    pub north_m: f64,
}

impl Enu {
    /// Length of the offset, metres.
    pub fn length_m(self) -> f64 {
        self.east_m.hypot(self.north_m)
    }
}

/// The plane tangent to the ellipsoid at `origin`. Points of the ellipsoid are projected onto the plane along the
/// vertical of the origin (orthographically), so the round trip is exact. The projection shortens a length d by about
/// d^3 / (6 R^2): 4 mm at 10 km.
#[derive(Debug, Clone, Copy)]
pub struct LocalFrame {
    origin: Geodetic,
    origin_in_ecef: Vector3<f64>,
    enu_from_ecef: Matrix3<f64>,
}

impl LocalFrame {
    /// Makes the frame with its zero at `origin`.
    pub fn at(origin: Geodetic) -> Self {
        let (sin_lat, cos_lat) = origin.latitude_rad().sin_cos();
        let (sin_lon, cos_lon) = origin.longitude_rad().sin_cos();
        #[rustfmt::skip]
        let enu_from_ecef = Matrix3::new(
            -sin_lon, cos_lon, 0.0,
            -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat,
            cos_lat * cos_lon, cos_lat * sin_lon, sin_lat,
        );
        Self { origin, origin_in_ecef: ecef_from_geodetic(origin), enu_from_ecef }
    }

    /// The zero of the frame.
    pub fn origin(&self) -> Geodetic {
        self.origin
    }

    /// Offset of a point of the ellipsoid from the origin.
    pub fn enu_from_geodetic(&self, point: Geodetic) -> Enu {
        let offset = self.enu_from_ecef * (ecef_from_geodetic(point) - self.origin_in_ecef);
        Enu { east_m: offset.x, north_m: offset.y }
    }

    /// The point of the ellipsoid at an offset.
    ///
    /// # Errors
    /// [`GeodesyError::OffLocalFrame`] for an offset beyond the horizon of the frame (about 6,300 km) or not finite.
    pub fn geodetic_from_enu(&self, enu: Enu) -> Result<Geodetic, GeodesyError> {
        let off = || GeodesyError::OffLocalFrame { east_m: enu.east_m, north_m: enu.north_m };
        // The line p + u * up meets x^2 + y^2 + (z a / b)^2 = a^2: take the upper root.
        let stretch = Vector3::new(1.0, 1.0, SEMI_MAJOR_M / SEMI_MINOR_M);
        let foot = self.origin_in_ecef + self.enu_from_ecef.transpose() * Vector3::new(enu.east_m, enu.north_m, 0.0);
        let up = self.enu_from_ecef.row(2).transpose();
        let (p, d) = (foot.component_mul(&stretch), up.component_mul(&stretch));
        let (a, half_b, c) = (d.dot(&d), p.dot(&d), p.dot(&p) - SEMI_MAJOR_M * SEMI_MAJOR_M);
        let discriminant = half_b * half_b - a * c;
        if !(discriminant >= 0.0 && half_b > 0.0) {
            return Err(off());
        }
        // c / (-b - sqrt) is the root near zero without cancellation.
        let u = -c / (half_b + discriminant.sqrt());
        geodetic_from_ecef_surface(foot + up * u)
    }
}

fn ecef_from_geodetic(point: Geodetic) -> Vector3<f64> {
    let (sin_lat, cos_lat) = point.latitude_rad().sin_cos();
    let (sin_lon, cos_lon) = point.longitude_rad().sin_cos();
    let n = normal_radius_m(point.latitude_rad());
    Vector3::new(n * cos_lat * cos_lon, n * cos_lat * sin_lon, n * (1.0 - ECCENTRICITY_SQUARED) * sin_lat)
}

/// Position of a point on the surface, where tan(latitude) = z / (p (1 - e^2)) is exact.
fn geodetic_from_ecef_surface(x: Vector3<f64>) -> Result<Geodetic, GeodesyError> {
    let p = x.x.hypot(x.y);
    Geodetic::from_radians(x.z.atan2(p * (1.0 - ECCENTRICITY_SQUARED)), x.y.atan2(x.x))
}

#[cfg(test)]
mod tests {
    use super::super::geodesic_between;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_position_and_its_offset_are_inverse(lat in -89.9..89.9f64, lon in -180.0..180.0f64,
                                         east_m in -5e4..5e4f64, north_m in -5e4..5e4f64) {
            let frame = LocalFrame::at(Geodetic::from_degrees(lat, lon).unwrap());
            let there = frame.geodetic_from_enu(Enu { east_m, north_m }).unwrap();
            let back = frame.enu_from_geodetic(there);
            prop_assert!((back.east_m - east_m).abs() < 1e-6 && (back.north_m - north_m).abs() < 1e-6);
        }

        #[test]
        fn agrees_with_the_geodesic_over_a_few_kilometres(lat in -80.0..80.0f64, lon in -180.0..180.0f64,
                                         east_m in -3e3..3e3f64, north_m in -3e3..3e3f64) {
            let origin = Geodetic::from_degrees(lat, lon).unwrap();
            let there = LocalFrame::at(origin).geodetic_from_enu(Enu { east_m, north_m }).unwrap();
            let line = geodesic_between(origin, there);
            // d^3 / (6 R^2) is 0.3 mm at 4.2 km.
            prop_assert!((line.distance_m - east_m.hypot(north_m)).abs() < 5e-4);
        }
    }

    #[test]
    fn refuses_an_offset_beyond_the_horizon() {
        let frame = LocalFrame::at(Geodetic::from_degrees(10.0, 20.0).unwrap());
        assert!(frame.geodetic_from_enu(Enu { east_m: 7e6, north_m: 0.0 }).is_err());
        assert!(frame.geodetic_from_enu(Enu { east_m: f64::NAN, north_m: 0.0 }).is_err());
    }
}
