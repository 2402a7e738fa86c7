//! `Route`: a GeoJSON LineString, and points along it.

use super::PlanError;
use crate::geodesy::{Geodesic, Geodetic, destination, geodesic_between};
use serde_json::Value;
use std::path::Path;

/// A line over the ground: at least two positions that are not all one. Between them it follows geodesics.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    points: Vec<Geodetic>,
}

/// A place on a route.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoutePoint {
    /// Way from the route's start, metres.
    pub way_m: f64,
    /// Where.
    pub position: Geodetic,
    /// Direction of flight there, radians clockwise from true north in [0, 2 pi).
    pub heading_rad: f64,
}

/// The most points that a route is looked at in.
const MOST_POINTS: f64 = 200_000.0;

/// A route file: a LineString, a Feature of one, or a FeatureCollection with one such Feature.
///
/// # Errors
/// [`PlanError::Unreadable`], [`PlanError::NotARoute`].
pub fn read_route(path: &Path) -> Result<Route, PlanError> {
    let refuse = |reason: String| PlanError::NotARoute { path: path.into(), reason };
    let text = std::fs::read_to_string(path).map_err(|cause| PlanError::Unreadable { path: path.into(), cause })?;
    Route::from_geojson(&text).map_err(refuse)
}

impl Route {
    /// The route of a GeoJSON text.
    ///
    /// # Errors
    /// What is wrong with it, for people.
    pub fn from_geojson(text: &str) -> Result<Self, String> {
        let json: Value = serde_json::from_str(text).map_err(|e| e.to_string())?;
        let line = line_string(&json)?;
        let coordinates = line["coordinates"].as_array().ok_or("the LineString has no coordinates")?;
        let points = coordinates.iter().enumerate().map(|(i, c)| position(i, c)).collect::<Result<Vec<_>, _>>()?;
        if points.len() < 2 {
            return Err(format!("{} positions, and a line has at least two", points.len()));
        }
        let route = Self { points };
        if route.length_m() <= 0.0 {
            return Err("all its positions are the same".into());
        }
        Ok(route)
    }

    /// Its length, metres.
    pub fn length_m(&self) -> f64 {
        self.legs().map(|(_, g)| g.distance_m).sum()
    }

    /// Points every `step_m` metres from the start on, and the end.
    ///
    /// # Errors
    /// Where the step is not positive or so short that there would be more than 200,000.
    pub fn every(&self, step_m: f64) -> Result<Vec<RoutePoint>, String> {
        let length_m = self.length_m();
        let enough = step_m > 0.0 && length_m / step_m <= MOST_POINTS;
        if !enough {
            return Err(format!("{length_m:.0} m in steps of {step_m} m are too many (at most {MOST_POINTS})"));
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

    /// Start and geodesic of each leg that has a length.
    fn legs(&self) -> impl Iterator<Item = (Geodetic, Geodesic)> + '_ {
        self.points.windows(2).map(|w| (w[0], geodesic_between(w[0], w[1]))).filter(|(_, g)| g.distance_m > 0.0)
    }
}

/// The point `into_m` metres into a leg, with the azimuth there.
fn point(start: Geodetic, leg: Geodesic, begun_m: f64, into_m: f64) -> Option<RoutePoint> {
    let position = destination(start, Geodesic { distance_m: into_m, ..leg }).ok()?;
    // A geodesic's azimuth changes along it: seen back to the start, and turned round.
    let back_rad = geodesic_between(position, start).azimuth_rad;
    let ahead_rad = if into_m > 1e-3 { back_rad + std::f64::consts::PI } else { leg.azimuth_rad };
    let heading_rad = ahead_rad.rem_euclid(std::f64::consts::TAU);
    Some(RoutePoint { way_m: begun_m + into_m, position, heading_rad })
}

fn line_string(json: &Value) -> Result<&Value, String> {
    match json["type"].as_str() {
        Some("LineString") => Ok(json),
        Some("Feature") => line_string(&json["geometry"]),
        Some("FeatureCollection") => match json["features"].as_array().map(Vec::as_slice) {
            Some([feature]) => line_string(feature),
            Some(features) => Err(format!("a collection of {} features, and one is needed", features.len())),
            None => Err("a collection without features".into()),
        },
        Some(other) => Err(format!("a {other}")),
        None => Err("it has no GeoJSON type".into()),
    }
}

fn position(index: usize, coordinates: &Value) -> Result<Geodetic, String> {
    let number = |k: usize| coordinates.get(k).and_then(Value::as_f64);
    let (Some(longitude_deg), Some(latitude_deg)) = (number(0), number(1)) else {
        return Err(format!("position {index} is not [longitude, latitude]"));
    };
    Geodetic::from_degrees(latitude_deg, longitude_deg).map_err(|e| format!("position {index}: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_of_the_equator_is_walked_in_equal_steps() {
        let route = Route::from_geojson(r#"{"type":"LineString","coordinates":[[0,0],[0.5,0,120],[1,0]]}"#).unwrap();
        // One degree of the equator: 6378137 pi / 180.
        assert!((route.length_m() - 111_319.490_793).abs() < 1e-3);
        let points = route.every(10_000.0).unwrap();
        assert_eq!(points.len(), 13);
        for (k, p) in points.iter().enumerate() {
            let way_m = (10_000.0 * k as f64).min(111_319.490_793);
            assert!((p.way_m - way_m).abs() < 1e-3 && p.position.latitude_deg().abs() < 1e-9);
            assert!((p.position.longitude_deg() - way_m / 111_319.490_793).abs() < 1e-9);
            assert!((p.heading_rad.to_degrees() - 90.0).abs() < 1e-6);
        }
    }

    #[test]
    fn says_what_is_no_route() {
        let wrong = [
            ("", "EOF"),
            ("{}", "no GeoJSON type"),
            (r#"{"type":"Point","coordinates":[0,0]}"#, "a Point"),
            (r#"{"type":"LineString","coordinates":[]}"#, "0 positions"),
            (r#"{"type":"LineString","coordinates":[[1,2]]}"#, "1 positions"),
            (r#"{"type":"LineString","coordinates":[[1,2],[1,2]]}"#, "the same"),
            (r#"{"type":"LineString","coordinates":[[1,2],["a",2]]}"#, "position 1"),
            (r#"{"type":"LineString","coordinates":[[1,2],[1,91]]}"#, "position 1"),
            (r#"{"type":"FeatureCollection","features":[]}"#, "0 features"),
            (r#"{"type":"Feature","geometry":null}"#, "no GeoJSON type"),
        ];
        for (text, said) in wrong {
            let error = Route::from_geojson(text).unwrap_err();
            assert!(error.contains(said), "{text}: {error}");
        }
        let route = Route::from_geojson(r#"{"type":"LineString","coordinates":[[0,0],[90,0]]}"#).unwrap();
        assert!(route.every(0.0).is_err() && route.every(f64::NAN).is_err() && route.every(0.1).is_err());
    }
}
