//! `SimulatedRoute`: the true position of a simulated aircraft, which flies from waypoint to waypoint and turns no
//! tighter than it can.

use overfly_core::geodesy::{Enu, GeodesyError, Geodetic, Heading, LocalFrame, wrap_turn_rad};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// A true position and heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruePose {
    /// The point straight below the camera.
    pub position: Geodetic,
    /// Direction of flight.
    pub heading: Heading,
    /// Heading in the plane of the route, radians clockwise from the plane's north. A turn between two images is a
    /// turn in this plane, while true north turns too (the convergence of meridians).
    pub plane_heading_rad: f64,
}

/// The true path of a flight, in the plane tangent at the centre of a box.
#[derive(Debug, Clone)]
pub struct SimulatedRoute {
    frame: LocalFrame,
    half_extent_m: [f64; 2],
    radius_m: f64,
    rng: ChaCha8Rng,
    at_m: [f64; 2],
    heading_rad: f64,
    waypoint_m: [f64; 2],
}

/// Length of a piece of the path, in turn radii: a turn is a polygon of such edges.
const PIECE: f64 = 0.05;
/// A waypoint counts as reached within this many turn radii, because a waypoint inside the turn circle is never
/// reached.
const REACHED: f64 = 2.5;

impl SimulatedRoute {
    /// Starts at a random place and heading in a box about the frame's origin, with random waypoints in the box.
    pub fn new(frame: LocalFrame, half_extent_m: [f64; 2], radius_m: f64, mut rng: ChaCha8Rng) -> Self {
        let at_m = drawn(half_extent_m, &mut rng);
        let heading_rad = rng.random_range(0.0..TAU);
        let waypoint_m = drawn(half_extent_m, &mut rng);
        Self { frame, half_extent_m, radius_m, rng, at_m, heading_rad, waypoint_m }
    }

    /// Flies on by a distance.
    pub fn advance(&mut self, distance_m: f64) {
        let mut left_m = distance_m;
        while left_m > 0.0 {
            let piece_m = left_m.min(PIECE * self.radius_m);
            left_m -= piece_m;
            let [x, y] = [self.waypoint_m[0] - self.at_m[0], self.waypoint_m[1] - self.at_m[1]];
            if x.hypot(y) < REACHED * self.radius_m {
                self.waypoint_m = drawn(self.half_extent_m, &mut self.rng);
            }
            let off_rad = wrap_turn_rad(x.atan2(y) - self.heading_rad);
            let turn_rad = off_rad.clamp(-piece_m / self.radius_m, piece_m / self.radius_m);
            let (sin, cos) = (self.heading_rad + turn_rad / 2.0).sin_cos();
            self.at_m = [self.at_m[0] + piece_m * sin, self.at_m[1] + piece_m * cos];
            self.heading_rad += turn_rad;
        }
    }

    /// The position and heading now.
    ///
    /// # Errors
    /// If the position lies beyond the frame's horizon, which no route reaches.
    pub fn pose(&self) -> Result<TruePose, GeodesyError> {
        let [east_m, north_m] = self.at_m;
        let position = self.frame.geodetic_from_enu(Enu { east_m, north_m })?;
        Ok(TruePose {
            position,
            heading: Heading::from_radians(self.heading_rad - self.north_rad(position)),
            plane_heading_rad: self.heading_rad,
        })
    }

    /// Direction of a point's true north in the plane, clockwise: its local north on the plane's two axes.
    fn north_rad(&self, at: Geodetic) -> f64 {
        let middle = self.frame.origin();
        let (sin, cos) = at.latitude_rad().sin_cos();
        let (sin_middle, cos_middle) = middle.latitude_rad().sin_cos();
        let (sin_off, cos_off) = (at.longitude_rad() - middle.longitude_rad()).sin_cos();
        (-sin * sin_off).atan2(sin * sin_middle * cos_off + cos * cos_middle)
    }
}

fn drawn(half_extent_m: [f64; 2], rng: &mut ChaCha8Rng) -> [f64; 2] {
    half_extent_m.map(|half| half * (2.0 * rng.random::<f64>() - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn route(radius_m: f64) -> SimulatedRoute {
        let frame = LocalFrame::at(Geodetic::from_degrees(47.0, 10.0).unwrap());
        SimulatedRoute::new(frame, [20_000.0, 10_000.0], radius_m, ChaCha8Rng::seed_from_u64(3))
    }

    #[test]
    fn flies_the_stated_way_turns_no_tighter_and_stays_about() {
        let mut route = route(400.0);
        let mut before = route.pose().unwrap();
        let mut turned = 0.0f64;
        for _ in 0..20_000 {
            route.advance(40.0);
            let pose = route.pose().unwrap();
            let moved = LocalFrame::at(before.position).enu_from_geodetic(pose.position);
            let turn = (pose.plane_heading_rad - before.plane_heading_rad).abs();
            // A chord of 40 m in a turn of 400 m is 17 mm shorter than its arc.
            assert!((39.97..40.02).contains(&moved.length_m()) && turn <= 0.1 + 1e-9, "{moved:?} {turn}");
            turned += turn;
            let [x, y] = route.at_m;
            assert!(x.abs() < 22_000.0 && y.abs() < 12_000.0);
            before = pose;
        }
        assert!(turned > 40.0, "{turned} rad in 800 km");
    }

    #[test]
    fn heads_where_it_goes_and_true_north_turns_by_the_convergence_of_meridians() {
        let mut route = route(400.0);
        let mut convergence = 0.0f64;
        for _ in 0..3000 {
            route.advance(25.0);
            let pose = route.pose().unwrap();
            let (sin, cos) = route.heading_rad.sin_cos();
            let mut straight = route.clone();
            straight.waypoint_m = [route.at_m[0] + 1e6 * sin, route.at_m[1] + 1e6 * cos];
            straight.advance(10.0);
            let moved = LocalFrame::at(pose.position).enu_from_geodetic(straight.pose().unwrap().position);
            let off = Heading::from_enu(moved).turn_rad_from(pose.heading);
            // The plane shortens what points away from its middle: at 22 km by 6e-6.
            assert!(off.abs() < 1e-5, "{off}");
            convergence =
                convergence.max(Heading::from_radians(pose.plane_heading_rad).turn_rad_from(pose.heading).abs());
        }
        // Up to 20 km east or west at 47 degrees: 20 / 6378 tan(47 degrees).
        assert!((1e-3..4e-3).contains(&convergence), "{convergence}");
    }
}
