//! `Candidates`: the tiles to search, best first.

use super::geometry::Geometry;
use overfly_core::geodesy::GeodeticBounds;
use serde::Serialize;

/// The tiles to search, and the cost of the search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidates {
    /// The paper's count for this search: equation 3, 17 (parallel) or 28 (combined, flights of at most the turn radius);
    /// elsewhere the region's area over one image's.
    pub nominal_count: f64,
    /// The region to search; cut at the antimeridian and at 85.05 degrees.
    pub region: Geometry,
    /// Best first: by falling probability, then by distance from the region's middle.
    pub tiles: Vec<Candidate>,
    /// Probability that the image's centre lies where the returned tiles have pixels.
    pub containment: f64,
    /// Seconds that a fix takes that searches the returned tiles with one thread, within a factor of two or so: a store that is
    /// read for the first time, on a 2 GHz core.
    pub estimated_s: f64,
}

/// A tile that meets the region.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// `layer/z/x/y`: its path under `/v1/tiles/`.
    pub id: String,
    /// Its layer.
    pub layer: String,
    /// Zoom.
    pub z: u8,
    /// Column, from the antimeridian eastwards.
    pub x: u32,
    /// Row, 0 north.
    pub y: u32,
    /// Exact extent, degrees.
    pub bounds_deg: GeodeticBounds,
    /// Probability that the image's centre lies in it, where it has pixels.
    pub probability: f64,
    /// Share of its pixels that are valid, in (0, 1].
    pub valid_fraction: f64,
    /// Keypoints described in it.
    pub keypoints: u32,
    /// How unlike each other they are, in [0, 1].
    pub distinctiveness: f64,
    /// True ground sample distance at its centre (geometric mean of east and north).
    pub gsd_m_per_px: f64,
    /// Newest acquisition date in it (ISO 8601), where known.
    pub acquired: Option<String>,
}
