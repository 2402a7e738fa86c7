//! `Geometry`: GeoJSON polygons.

use serde::Serialize;

/// A GeoJSON geometry (RFC 7946) in WGS84 degrees, longitude first.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", content = "coordinates")]
pub enum Geometry {
    /// The rings of one polygon.
    Polygon(Vec<Vec<[f64; 2]>>),
    /// Several polygons: a region across the antimeridian is cut there.
    MultiPolygon(Vec<Vec<Vec<[f64; 2]>>>),
}

impl Geometry {
    /// Makes polygons without holes from closed, counterclockwise rings of (longitude, latitude).
    pub fn from_rings(mut rings: Vec<Vec<[f64; 2]>>) -> Self {
        match rings.len() {
            1 => Self::Polygon(vec![rings.remove(0)]),
            _ => Self::MultiPolygon(rings.into_iter().map(|ring| vec![ring]).collect()),
        }
    }
}
