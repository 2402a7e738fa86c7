//! Reading routes from GeoJSON, GPX and KML.

mod geojson;
mod position;
mod xml;

use super::error::PlanError;
use super::text_file::read_text;
use overfly_core::route::Route;
use std::path::Path;

/// Reads the route of a file that has one; see [`read_routes`].
///
/// # Errors
/// As [`read_routes`]; [`PlanError::NotARoute`] where the file has several.
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

/// Reads the routes of a GeoJSON, GPX or KML file: the planned one first, then its alternates. A line that begins where the
/// previous one ends continues that route.
///
/// # Errors
/// [`PlanError::Unreadable`], [`PlanError::NotARoute`].
pub fn read_routes(path: &Path) -> Result<Vec<Route>, PlanError> {
    let refuse = |reason: String| PlanError::NotARoute { path: path.into(), reason };
    let text = read_text(path).map_err(|cause| PlanError::Unreadable { path: path.into(), cause })?;
    parse_routes(&text).map_err(refuse)
}

/// Parses the routes of a text, whose beginning tells GeoJSON from GPX and KML.
///
/// # Errors
/// What is wrong with the text, for people.
pub fn parse_routes(text: &str) -> Result<Vec<Route>, String> {
    let begin = text.trim_start_matches('\u{feff}').trim_start();
    let lines = if begin.starts_with('<') { xml::lines(begin)? } else { geojson::lines(begin)? };
    Route::from_lines(lines).map_err(|e| e.to_string())
}

/// Parses the route of a text that has one.
///
/// # Errors
/// As [`parse_routes`], and where the text has several.
pub fn parse_route(text: &str) -> Result<Route, String> {
    let mut routes = parse_routes(text)?;
    let one = routes.len() == 1;
    routes.pop().filter(|_| one).ok_or_else(|| "several lines, and one is needed".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_invalid_routes() {
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
            let error = parse_route(text).unwrap_err();
            assert!(error.contains(said), "{text}: {error}");
        }
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
        let expected = parse_routes(geojson).unwrap();
        assert_eq!(expected.iter().map(|r| r.points().len()).collect::<Vec<_>>(), [3, 2]);
        assert_eq!(parse_routes(gpx).unwrap(), expected);
        assert_eq!(parse_routes(kml).unwrap(), expected);
    }
}
