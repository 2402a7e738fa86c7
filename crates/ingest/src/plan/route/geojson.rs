//! Parsing the lines of a GeoJSON text (RFC 7946).
//!
//! Only what makes a line is kept: no text takes much more memory than it has bytes, whatever it holds.

use super::position::position_at;
use overfly_core::geodesy::Geodetic;
use serde::de::{Deserializer, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, de};
use serde_json::value::RawValue;
use std::borrow::Cow;
use std::fmt;

/// A LineString, MultiLineString, Feature or FeatureCollection.
#[derive(Deserialize)]
struct Document<'a> {
    #[serde(borrow, rename = "type")]
    kind: Option<Cow<'a, str>>,
    #[serde(borrow)]
    features: Option<Vec<Feature<'a>>>,
    #[serde(borrow)]
    geometry: Option<Geometry<'a>>,
    #[serde(borrow)]
    coordinates: Option<&'a RawValue>,
}

#[derive(Deserialize)]
struct Feature<'a> {
    #[serde(borrow)]
    geometry: Option<Geometry<'a>>,
}

#[derive(Deserialize, Default)]
struct Geometry<'a> {
    #[serde(borrow, rename = "type")]
    kind: Option<Cow<'a, str>>,
    #[serde(borrow)]
    coordinates: Option<&'a RawValue>,
}

/// Longitude and latitude, degrees; what follows them is ignored.
struct Position {
    longitude_deg: f64,
    latitude_deg: f64,
}

/// Returns every line of a LineString, MultiLineString, Feature or FeatureCollection, in order. Points in a collection are
/// ignored: they mark places.
///
/// # Errors
/// What is wrong with the text, for people.
pub(super) fn lines(text: &str) -> Result<Vec<Vec<Geodetic>>, String> {
    let Document { kind, features, geometry, coordinates } = serde_json::from_str(text).map_err(|e| e.to_string())?;
    let lines = match kind.as_deref() {
        Some("FeatureCollection") => {
            let features = features.ok_or("a collection without features")?;
            let geometries = features.into_iter().map(|f| f.geometry.unwrap_or_default());
            let lines = geometries.filter(|g| !g.is_mark()).map(|g| g.lines());
            lines.collect::<Result<Vec<_>, _>>()?.concat()
        }
        Some("Feature") => geometry.unwrap_or_default().lines()?,
        _ => Geometry { kind, coordinates }.lines()?,
    };
    if lines.is_empty() { Err("no line in it".into()) } else { Ok(lines) }
}

impl Geometry<'_> {
    fn is_mark(&self) -> bool {
        matches!(self.kind.as_deref(), Some("Point" | "MultiPoint"))
    }

    fn lines(&self) -> Result<Vec<Vec<Geodetic>>, String> {
        match self.kind.as_deref() {
            Some("LineString") => {
                let coordinates = self.coordinates.ok_or("the LineString has no coordinates")?;
                Ok(vec![line(coordinates)?])
            }
            Some("MultiLineString") => {
                let lines = self.coordinates.and_then(members).ok_or("the MultiLineString has no coordinates")?;
                lines.into_iter().map(line).collect()
            }
            Some(other) => Err(format!("a {other}")),
            None => Err("it has no GeoJSON type".into()),
        }
    }
}

/// The members of a list, as they stand in the text.
fn members(list: &RawValue) -> Option<Vec<&RawValue>> {
    serde_json::from_str(list.get()).ok()
}

fn line(coordinates: &RawValue) -> Result<Vec<Geodetic>, String> {
    let positions = members(coordinates).ok_or("the LineString has no coordinates")?;
    positions.iter().enumerate().map(|(index, position)| geodetic(index, position)).collect()
}

fn geodetic(index: usize, position: &RawValue) -> Result<Geodetic, String> {
    let Position { longitude_deg, latitude_deg } =
        serde_json::from_str(position.get()).map_err(|_| format!("position {index} is not [longitude, latitude]"))?;
    position_at(index, latitude_deg, longitude_deg)
}

impl<'de> Deserialize<'de> for Position {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct PositionVisitor;
        impl<'de> Visitor<'de> for PositionVisitor {
            type Value = Position;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("[longitude, latitude]")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Position, A::Error> {
                let mut next =
                    || list.next_element::<f64>()?.ok_or_else(|| de::Error::invalid_length(1, &"two numbers"));
                let (longitude_deg, latitude_deg) = (next()?, next()?);
                while list.next_element::<IgnoredAny>()?.is_some() {}
                Ok(Position { longitude_deg, latitude_deg })
            }
        }
        deserializer.deserialize_seq(PositionVisitor)
    }
}
