//! The paper's spherical earth: a displacement seen between two images, carried over to latitude, longitude and heading
//! by first-order steps (equations 37 to 41). Only tests use this model; navigation uses the ellipsoid
//! ([`LocalFrame`](overfly_core::geodesy::LocalFrame)).
//!
//! Against the ellipsoid a shift is up to 0.6 % wrong: the sphere's 6370 km stand for radii of curvature from 6335 km
//! (meridian, equator) to 6400 km (poles), -0.46 to +0.55 %; the first-order step adds distance x tan(latitude) / 2 R,
//! 0.05 % for 1 km at 80 degrees.

use nalgebra::{Matrix3x2, Vector2, Vector3};
use overfly_core::geodesy::{
    BodyFrame, BodyOffset, Geodesic, GeodesyError, Geodetic, Heading, LocalFrame, destination, geodesic_between,
};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// R of equation 37, metres.
pub const SPHERE_RADIUS_M: f64 = 6_370_000.0;

/// Position of an image's centre and azimuth of its top edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpherePose {
    /// Image centre.
    pub position: Geodetic,
    /// Azimuth of the image's top edge.
    pub heading: Heading,
}

/// The motion that relative registration measures between two images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereStep {
    /// t_x and t_y of the paper: towards the right and the top edge of the first image.
    pub offset: BodyOffset,
    /// theta of the paper: rotation of the second image against the first, radians, anticlockwise.
    pub turn_rad: f64,
}

/// A sphere by whose radius shifts are divided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    radius_m: f64,
}

impl Sphere {
    /// For shifts measured on the ground: R.
    pub const GROUND: Self = Self { radius_m: SPHERE_RADIUS_M };

    /// As equations 39 and 40 are printed, R + h: right for shifts measured at flight altitude, and short by h / R
    /// (0.016 % a kilometre) for those measured on the ground.
    pub fn at_altitude(altitude_m: f64) -> Self {
        Self { radius_m: SPHERE_RADIUS_M + altitude_m }
    }

    /// The geocentric position of equation 37, metres: X to 90 degrees east, Y to the north pole, Z to Greenwich.
    pub fn geocentric_from_geodetic(self, point: Geodetic) -> Vector3<f64> {
        let (sin_lat, cos_lat) = point.latitude_rad().sin_cos();
        let (sin_lon, cos_lon) = point.longitude_rad().sin_cos();
        Vector3::new(cos_lat * sin_lon, sin_lat, cos_lat * cos_lon) * self.radius_m
    }

    /// The pose after a step, by equations 38 to 41.
    ///
    /// # Errors
    /// Where the step leads over a pole, or is not finite.
    ///
    /// # References
    /// Ziaei, section V.B, equations 38 to 41 (two of them numbered 39). The paper's alpha is measured from the circle
    /// of latitude to the image's x axis, anticlockwise: alpha = -heading. (41) gives the cosine and sine of
    /// theta + alpha - sin(latitude) x longitude step to first order; the angle itself is used here.
    pub fn advance(self, start: SpherePose, step: SphereStep) -> Result<SpherePose, GeodesyError> {
        let shift = geocentric_from_image(start) * Vector2::new(step.offset.right_m, step.offset.ahead_m);
        let (latitude_rad, longitude_rad) = (start.position.latitude_rad(), start.position.longitude_rad());
        let (sin_lat, cos_lat) = latitude_rad.sin_cos();
        let (sin_lon, cos_lon) = longitude_rad.sin_cos();
        let north_rad = shift.y / (self.radius_m * cos_lat);
        let east_rad = (cos_lon * shift.x - sin_lon * shift.z) / (self.radius_m * cos_lat);
        let alpha_rad = step.turn_rad - start.heading.radians() - sin_lat * east_rad;
        if !alpha_rad.is_finite() {
            return Err(GeodesyError::Longitude { longitude_deg: f64::NAN });
        }
        let position = Geodetic::from_radians(latitude_rad + north_rad, longitude_rad + east_rad)?;
        Ok(SpherePose { position, heading: Heading::from_radians(-alpha_rad) })
    }
}

/// M of equation 39: image axes (right, up) in the geocentric frame of equation 37.
pub fn geocentric_from_image(pose: SpherePose) -> Matrix3x2<f64> {
    let (sin_alpha, cos_alpha) = (-pose.heading.radians()).sin_cos();
    let (sin_lat, cos_lat) = pose.position.latitude_rad().sin_cos();
    let (sin_lon, cos_lon) = pose.position.longitude_rad().sin_cos();
    #[rustfmt::skip]
    let m = Matrix3x2::new(
        cos_alpha * cos_lon - sin_alpha * sin_lat * sin_lon, -sin_alpha * cos_lon - cos_alpha * sin_lat * sin_lon,
        sin_alpha * cos_lat, cos_alpha * cos_lat,
        -cos_alpha * sin_lon - sin_alpha * sin_lat * cos_lon, sin_alpha * sin_lon - cos_alpha * sin_lat * cos_lon,
    );
    m
}

fn pose(latitude_deg: f64, longitude_deg: f64, heading_rad: f64) -> SpherePose {
    let position = Geodetic::from_degrees(latitude_deg, longitude_deg).unwrap();
    SpherePose { position, heading: Heading::from_radians(heading_rad) }
}

fn step(right_m: f64, ahead_m: f64, turn_rad: f64) -> SphereStep {
    SphereStep { offset: BodyOffset { right_m, ahead_m }, turn_rad }
}

#[test]
fn a_degree_of_the_equator_is_111_kilometres() {
    // Heading east at the equator, one degree of 6370 km is 111,177.5 m of longitude.
    let end = Sphere::GROUND.advance(pose(0.0, 10.0, 90f64.to_radians()), step(0.0, 111_177.473_4, 0.0)).unwrap();
    assert!((end.position.longitude_deg() - 11.0).abs() < 1e-9 && end.position.latitude_deg().abs() < 1e-9);
}

proptest! {
    #[test]
    fn differs_from_the_ellipsoid_by_at_most_six_in_a_thousand(
        lat in -80.0..80.0f64, lon in -180.0..180.0f64, heading_rad in 0.0..TAU,
        right_m in -700.0..700.0f64, ahead_m in -700.0..700.0f64,
    ) {
        let start = pose(lat, lon, heading_rad);
        let frame = LocalFrame::at(start.position);
        let truth = BodyFrame::from_heading_rad(heading_rad).enu_from_body(BodyOffset { right_m, ahead_m });
        let end = Sphere::GROUND.advance(start, step(right_m, ahead_m, 0.0)).unwrap();
        let found = frame.enu_from_geodetic(end.position);
        let miss_m = (found.east_m - truth.east_m).hypot(found.north_m - truth.north_m);
        prop_assert!(miss_m <= 0.006 * truth.length_m() + 1e-6, "{miss_m} of {}", truth.length_m());
    }

    #[test]
    fn the_image_axes_are_orthonormal_and_level(lat in -89.0..89.0f64, lon in -180.0..180.0f64, heading_rad in 0.0..TAU) {
        let at = pose(lat, lon, heading_rad);
        let m = geocentric_from_image(at);
        let up = Sphere::GROUND.geocentric_from_geodetic(at.position) / SPHERE_RADIUS_M;
        prop_assert!((m.transpose() * m - nalgebra::Matrix2::identity()).norm() < 1e-12);
        prop_assert!((m.transpose() * up).norm() < 1e-12);
    }

    #[test]
    fn the_heading_turns_as_a_straight_line_does(lat in -60.0..60.0f64, heading_rad in 0.0..TAU) {
        // A geodesic's azimuth changes along it by what the meridians converge.
        let start = pose(lat, 5.0, heading_rad);
        let end = Sphere::GROUND.advance(start, step(0.0, 1000.0, 0.0)).unwrap();
        let line = geodesic_between(start.position, destination(start.position, Geodesic { distance_m: 2000.0, azimuth_rad: heading_rad }).unwrap());
        let half = destination(start.position, Geodesic { distance_m: 1000.0, ..line }).unwrap();
        let there = destination(start.position, Geodesic { distance_m: 2000.0, ..line }).unwrap();
        let expected = geodesic_between(half, there).azimuth_rad;
        let turn = end.heading.turn_rad_from(Heading::from_radians(expected));
        // 1000 m x tan(60) / R is 2.7e-4 rad of convergence; the sphere and the first order get it to 1 %.
        prop_assert!(turn.abs() < 4e-6, "{turn}");
    }
}

#[test]
fn altitude_shortens_a_ground_shift_by_h_over_r() {
    let start = pose(45.0, 5.0, 0.0);
    let turning = step(0.0, 1000.0, 0.3);
    let north = |sphere: Sphere| {
        sphere.advance(start, turning).unwrap().position.latitude_rad() - start.position.latitude_rad()
    };
    let ratio = north(Sphere::at_altitude(3000.0)) / north(Sphere::GROUND);
    assert!((1.0 - ratio - 3000.0 / (SPHERE_RADIUS_M + 3000.0)).abs() < 1e-9);
    // theta is anticlockwise: the heading falls.
    assert!((Sphere::GROUND.advance(start, turning).unwrap().heading.radians() - (TAU - 0.3)).abs() < 1e-12);
}

#[test]
fn refuses_a_step_over_the_pole() {
    assert!(Sphere::GROUND.advance(pose(89.9, 0.0, 0.0), step(0.0, 1e5, 0.0)).is_err());
    assert!(Sphere::GROUND.advance(pose(0.0, 0.0, 0.0), step(f64::NAN, 1e5, 0.0)).is_err());
}

#[test]
fn the_geocentric_axes_are_those_of_equation_37() {
    let at = |latitude_deg: f64, longitude_deg: f64| {
        Sphere::at_altitude(500.0)
            .geocentric_from_geodetic(Geodetic::from_degrees(latitude_deg, longitude_deg).unwrap())
            / (SPHERE_RADIUS_M + 500.0)
    };
    for (found, axis) in [(at(0.0, 90.0), Vector3::x()), (at(90.0, 0.0), Vector3::y()), (at(0.0, 0.0), Vector3::z())] {
        assert!((found - axis).norm() < 1e-12, "{found}");
    }
}

#[test]
fn a_heading_of_90_degrees_shifts_east_as_alpha_minus_90_does_in_38() {
    // M of (39) with alpha = -90 degrees takes the image's y axis to the east.
    let shift = geocentric_from_image(pose(30.0, 40.0, 90f64.to_radians())) * Vector2::new(0.0, 1.0);
    let (sin, cos) = 40f64.to_radians().sin_cos();
    assert!((shift - Vector3::new(cos, 0.0, -sin)).norm() < 1e-12);
}

#[test]
fn equations_39_and_40_are_the_differences_of_37() {
    // Both steps small against the radius: (37) there less (37) here is the shift, to first order.
    let (start, step) = (pose(47.0, -120.0, 0.4), step(3.0, 4.0, 0.0));
    let end = Sphere::GROUND.advance(start, step).unwrap();
    let moved =
        Sphere::GROUND.geocentric_from_geodetic(end.position) - Sphere::GROUND.geocentric_from_geodetic(start.position);
    let shift = geocentric_from_image(start) * Vector2::new(step.offset.right_m, step.offset.ahead_m);
    // The sphere falls away by 5^2 / 2 R = 2 micrometres, and bends the circle of latitude as much again.
    assert!((moved - shift).norm() < 5e-6, "{}", (moved - shift).norm());
}

#[test]
fn equation_41_is_the_turned_angle_to_first_order() {
    let (start, step) = (pose(50.0, 5.0, 1.1), step(-300.0, 900.0, 0.2));
    let end = Sphere::GROUND.advance(start, step).unwrap();
    let east_rad = end.position.longitude_rad() - start.position.longitude_rad();
    let correction = start.position.latitude_rad().sin() * east_rad;
    let (sin, cos) = (step.turn_rad - start.heading.radians()).sin_cos();
    let (end_sin, end_cos) = (-end.heading.radians()).sin_cos();
    let second_order = correction * correction;
    assert!(correction.abs() > 1e-5);
    assert!((end_cos - (cos + sin * correction)).abs() <= second_order);
    assert!((end_sin - (sin - cos * correction)).abs() <= second_order);
}
