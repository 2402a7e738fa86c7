//! `Route`: a line over the ground, read from GeoJSON, GPX or KML, and points along it.

mod geojson;
mod xml;

use super::PlanError;
use super::text_file::read_text;
use crate::geodesy::{Geodesic, Geodetic, destination, geodesic_between};
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

/// Legs whose ends are nearer than this are one after the other, metres.
const JOINED_M: f64 = 1.0;

/// The one route of a file; see [`read_routes`].
///
/// # Errors
/// As [`read_routes`], and where there are several.
pub fn read_route(path: &Path) -> Result<Route, PlanError> {
    let mut routes = read_routes(path)?;
    match (routes.pop(), routes.len()) {
        (Some(route), 0) => Ok(route),
        (_, others) => {
            let reason = format!("{} lines that do not follow one another, and one is needed", others + 1);
            Err(PlanError::NotARoute { path: path.into(), reason })
        }
    }
}

/// The routes of a file, GeoJSON, GPX or KML: the planned one first, its alternates after it. Lines that begin where the one
/// before ends are its further legs.
///
/// # Errors
/// [`PlanError::Unreadable`], [`PlanError::NotARoute`].
pub fn read_routes(path: &Path) -> Result<Vec<Route>, PlanError> {
    let refuse = |reason: String| PlanError::NotARoute { path: path.into(), reason };
    let text = read_text(path).map_err(|cause| PlanError::Unreadable { path: path.into(), cause })?;
    Route::all_from_text(&text).map_err(refuse)
}

impl Route {
    /// The routes of a text: GeoJSON, GPX or KML, by what it begins with.
    ///
    /// # Errors
    /// What is wrong with it, for people.
    pub fn all_from_text(text: &str) -> Result<Vec<Self>, String> {
        let begin = text.trim_start_matches('\u{feff}').trim_start();
        let lines = if begin.starts_with('<') { xml::lines(begin)? } else { geojson::lines(begin)? };
        let mut routes: Vec<Self> = Vec::new();
        for points in lines {
            if points.len() < 2 {
                return Err(format!("{} positions, and a line has at least two", points.len()));
            }
            match routes.last_mut() {
                Some(route) if route.ends_at(points[0]) => route.points.extend(&points[1..]),
                _ => routes.push(Self { points }),
            }
        }
        if routes.iter().map(|r| r.points.len()).sum::<usize>() as f64 > MOST_POINTS {
            return Err(format!("more than {MOST_POINTS} positions"));
        }
        match routes.iter().find(|r| r.length_m() <= 0.0) {
            Some(_) => Err("all its positions are the same".into()),
            None => Ok(routes),
        }
    }

    /// The route of a GeoJSON text that holds one.
    ///
    /// # Errors
    /// As [`Route::all_from_text`].
    pub fn from_geojson(text: &str) -> Result<Self, String> {
        let mut routes = Self::all_from_text(text)?;
        let one = routes.len() == 1;
        routes.pop().filter(|_| one).ok_or_else(|| "several lines, and one is needed".into())
    }

    fn ends_at(&self, point: Geodetic) -> bool {
        self.points.last().is_some_and(|last| geodesic_between(*last, point).distance_m < JOINED_M)
    }

    /// Its positions.
    pub fn points(&self) -> &[Geodetic] {
        &self.points
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
    pub fn legs(&self) -> impl Iterator<Item = (Geodetic, Geodesic)> + '_ {
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
            (r#"{"type":"FeatureCollection","features":[]}"#, "no line"),
            ("<kml><Document/></kml>", "no line"),
            ("<gpx><rte><rtept lat='1' lon='2'/></rte></gpx>", "1 positions"),
            ("<gpx><rte><rtept lat='1'/></rte></gpx>", "no lon"),
            ("<gpx><rte><rtept lat='1' lon='NaN'/><rtept lat='1' lon='3'/></rte></gpx>", "longitude"),
            ("<gpx><rte>", "ends within"),
            ("<osm/>", "neither GPX nor KML"),
            ("<kml><LineString><coordinates>1,2 3</coordinates></LineString></kml>", "longitude,latitude"),
            (r#"{"type":"Feature","geometry":null}"#, "no GeoJSON type"),
        ];
        for (text, said) in wrong {
            let error = Route::from_geojson(text).unwrap_err();
            assert!(error.contains(said), "{text}: {error}");
        }
        let route = Route::from_geojson(r#"{"type":"LineString","coordinates":[[0,0],[90,0]]}"#).unwrap();
        assert!(route.every(0.0).is_err() && route.every(f64::NAN).is_err() && route.every(0.1).is_err());
    }

    #[test]
    fn the_three_formats_give_the_same_line() {
        let geojson = r#"{"type":"FeatureCollection","features":[
            {"type":"Feature","geometry":{"type":"Point","coordinates":[9,9]}},
            {"type":"Feature","geometry":{"type":"LineString","coordinates":[[-99.2,47.0],[-99.1,47.01]]}},
            {"type":"Feature","geometry":{"type":"LineString","coordinates":[[-99.1,47.01],[-99.0,47.0]]}},
            {"type":"Feature","geometry":{"type":"MultiLineString","coordinates":[[[-99.1,47.01],[-99.1,47.1]]]}}]}"#;
        let gpx = r#"<?xml version="1.0"?><gpx xmlns="http://www.topografix.com/GPX/1/1"><wpt lat="9" lon="9"/>
            <rte><name>a</name><rtept lat="47.0" lon="-99.2"><ele>3</ele></rtept><rtept lat="47.01" lon="-99.1"/>
            <rtept lon="-99.0" lat="47.0"/></rte>
            <trk><trkseg><trkpt lat="47.01" lon="-99.1"/></trkseg><trkseg><trkpt lat="47.1" lon="-99.1"/></trkseg></trk></gpx>"#;
        let kml = r#"<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark><MultiGeometry>
            <Point><coordinates>9,9,0</coordinates></Point>
            <LineString><coordinates> -99.2,47.0,100
              -99.1,47.01,100 -99.0,47.0 </coordinates></LineString>
            <LineString><coordinates>-99.1,47.01 -99.1,47.1</coordinates></LineString></MultiGeometry></Placemark></Document></kml>"#;
        let expected = Route::all_from_text(geojson).unwrap();
        assert_eq!(expected.iter().map(|r| r.points().len()).collect::<Vec<_>>(), [3, 2]);
        assert_eq!(Route::all_from_text(gpx).unwrap(), expected);
        assert_eq!(Route::all_from_text(kml).unwrap(), expected);
    }
}
