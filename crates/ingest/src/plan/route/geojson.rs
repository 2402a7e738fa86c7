//! Parsing the lines of a GeoJSON text (RFC 7946).

use overfly_core::geodesy::Geodetic;
use serde_json::Value;

/// Returns every line of a LineString, MultiLineString, Feature or FeatureCollection, in order. Points in a collection are
/// ignored: they mark places.
///
/// # Errors
/// What is wrong with the text, for people.
pub(super) fn lines(text: &str) -> Result<Vec<Vec<Geodetic>>, String> {
    let json: Value = serde_json::from_str(text).map_err(|e| e.to_string())?;
    let lines = match json["type"].as_str() {
        Some("FeatureCollection") => {
            let features = json["features"].as_array().ok_or("a collection without features")?;
            let marks = |f: &&Value| matches!(f["geometry"]["type"].as_str(), Some("Point" | "MultiPoint"));
            let lines = features.iter().filter(|f| !marks(f)).map(|f| lines_of_geometry(&f["geometry"]));
            lines.collect::<Result<Vec<_>, _>>()?.concat()
        }
        Some("Feature") => lines_of_geometry(&json["geometry"])?,
        _ => lines_of_geometry(&json)?,
    };
    if lines.is_empty() { Err("no line in it".into()) } else { Ok(lines) }
}

fn lines_of_geometry(geometry: &Value) -> Result<Vec<Vec<Geodetic>>, String> {
    match geometry["type"].as_str() {
        Some("LineString") => Ok(vec![line(&geometry["coordinates"])?]),
        Some("MultiLineString") => {
            let lines = geometry["coordinates"].as_array().ok_or("the MultiLineString has no coordinates")?;
            lines.iter().map(line).collect()
        }
        Some(other) => Err(format!("a {other}")),
        None => Err("it has no GeoJSON type".into()),
    }
}

fn line(coordinates: &Value) -> Result<Vec<Geodetic>, String> {
    let coordinates = coordinates.as_array().ok_or("the LineString has no coordinates")?;
    coordinates.iter().enumerate().map(|(index, c)| position(index, c)).collect()
}

fn position(index: usize, coordinates: &Value) -> Result<Geodetic, String> {
    let number = |k: usize| coordinates.get(k).and_then(Value::as_f64);
    let (Some(longitude_deg), Some(latitude_deg)) = (number(0), number(1)) else {
        return Err(format!("position {index} is not [longitude, latitude]"));
    };
    Geodetic::from_degrees(latitude_deg, longitude_deg).map_err(|e| format!("position {index}: {e}"))
}
