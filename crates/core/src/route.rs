//! `Route`: a line over the ground with points along it.

use crate::geodesy::{Geodesic, Geodetic, Heading, destination, geodesic_between};

/// A line over the ground through at least two positions, which are not all equal. It follows geodesics between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    points: Vec<Geodetic>,
}

/// A place on a route.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoutePoint {
    /// Distance from the route's start along the route, metres.
    pub way_m: f64,
    /// The position.
    pub position: Geodetic,
    /// Direction of flight there.
    pub heading: Heading,
}

/// The largest number of positions of a route, and of points along a route.
const MOST_POINTS: f64 = 200_000.0;

/// A line continues the line before it where their ends are nearer than this, metres.
const JOINED_M: f64 = 1.0;

/// Why positions are not a route, or why a route cannot be divided.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RouteError {
    /// A line has fewer than two positions.
    #[error("{count} positions, and a line has at least two")]
    TooFewPositions {
        /// Number of positions.
        count: usize,
    },
    /// The lines have too many positions.
    #[error("more than {MOST_POINTS} positions")]
    TooManyPositions,
    /// All positions of a route are equal.
    #[error("all its positions are the same")]
    NoLength,
    /// The step is not positive, or too short for the route.
    #[error("{length_m:.0} m in steps of {step_m} m are too many (at most {MOST_POINTS})")]
    TooManySteps {
        /// Length of the route, metres.
        length_m: f64,
        /// The given step, metres.
        step_m: f64,
    },
}

impl Route {
    /// Makes routes from lines in order. A line that begins where the line before it ends continues that line's route.
    ///
    /// # Errors
    /// [`RouteError`] for a line of fewer than two positions, a route without length, or more than 200,000 positions.
    pub fn from_lines(lines: Vec<Vec<Geodetic>>) -> Result<Vec<Self>, RouteError> {
        let mut routes: Vec<Self> = Vec::new();
        for points in lines {
            if points.len() < 2 {
                return Err(RouteError::TooFewPositions { count: points.len() });
            }
            match routes.last_mut() {
                Some(route) if route.ends_at(points[0]) => route.points.extend(&points[1..]),
                _ => routes.push(Self { points }),
            }
        }
        if routes.iter().map(|r| r.points.len()).sum::<usize>() as f64 > MOST_POINTS {
            return Err(RouteError::TooManyPositions);
        }
        match routes.iter().find(|r| r.length_m() <= 0.0) {
            Some(_) => Err(RouteError::NoLength),
            None => Ok(routes),
        }
    }

    fn ends_at(&self, point: Geodetic) -> bool {
        self.points.last().is_some_and(|last| geodesic_between(*last, point).distance_m < JOINED_M)
    }

    /// The positions of the route.
    pub fn points(&self) -> &[Geodetic] {
        &self.points
    }

    /// Length of the route, metres.
    pub fn length_m(&self) -> f64 {
        self.legs().map(|(_, g)| g.distance_m).sum()
    }

    /// Points at every `step_m` metres from the start, and at the end.
    ///
    /// # Errors
    /// [`RouteError::TooManySteps`] where the step is not positive or gives more than 200,000 points.
    pub fn every(&self, step_m: f64) -> Result<Vec<RoutePoint>, RouteError> {
        let length_m = self.length_m();
        let is_bounded = step_m > 0.0 && length_m / step_m <= MOST_POINTS;
        if !is_bounded {
            return Err(RouteError::TooManySteps { length_m, step_m });
        }
        let mut found = Vec::new();
        let (mut begun_m, mut next_m) = (0.0, 0.0);
        for (start, leg) in self.legs() {
            while next_m < begun_m + leg.distance_m {
                found.extend(point(start, leg, begun_m, next_m - begun_m));
                next_m += step_m;
            }
            begun_m += leg.distance_m;
        }
        if let Some((start, leg)) = self.legs().last() {
            found.extend(point(start, leg, begun_m - leg.distance_m, leg.distance_m));
        }
        Ok(found)
    }

    /// The start and the geodesic of each leg that has a length.
    pub fn legs(&self) -> impl Iterator<Item = (Geodetic, Geodesic)> + '_ {
        self.points.windows(2).map(|w| (w[0], geodesic_between(w[0], w[1]))).filter(|(_, g)| g.distance_m > 0.0)
    }
}

/// The point `into_m` metres into a leg, with the azimuth there.
fn point(start: Geodetic, leg: Geodesic, begun_m: f64, into_m: f64) -> Option<RoutePoint> {
    let position = destination(start, Geodesic { distance_m: into_m, ..leg }).ok()?;
    // The azimuth changes along a geodesic: take the azimuth back to the start, and turn it round.
    let back_rad = geodesic_between(position, start).azimuth_rad;
    let ahead_rad = if into_m > 1e-3 { back_rad + std::f64::consts::PI } else { leg.azimuth_rad };
    Some(RoutePoint { way_m: begun_m + into_m, position, heading: Heading::from_radians(ahead_rad) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A route through longitudes and latitudes, degrees.
    fn line(points_deg: &[[f64; 2]]) -> Route {
        let points = points_deg.iter().map(|p| Geodetic::from_degrees(p[1], p[0]).unwrap()).collect();
        Route::from_lines(vec![points]).unwrap().remove(0)
    }

    #[test]
    fn a_quarter_of_the_equator_is_walked_in_equal_steps() {
        let route = line(&[[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]);
        // One degree of the equator: 6378137 pi / 180.
        assert!((route.length_m() - 111_319.490_793).abs() < 1e-3);
        let points = route.every(10_000.0).unwrap();
        assert_eq!(points.len(), 13);
        for (k, p) in points.iter().enumerate() {
            let way_m = (10_000.0 * k as f64).min(111_319.490_793);
            assert!((p.way_m - way_m).abs() < 1e-3 && p.position.latitude_deg().abs() < 1e-9);
            assert!((p.position.longitude_deg() - way_m / 111_319.490_793).abs() < 1e-9);
            assert!((p.heading.degrees() - 90.0).abs() < 1e-6);
        }
    }

    #[test]
    fn steps_are_positive_and_not_too_many() {
        let route = line(&[[0.0, 0.0], [90.0, 0.0]]);
        assert!(route.every(0.0).is_err() && route.every(f64::NAN).is_err() && route.every(0.1).is_err());
    }
}
