//! `CandidatesJson`: the tiles to search.

use super::geometry::GeometryJson;
use overfly_core::geodesy::GeodeticBounds;
use overfly_flight::locate::candidates::{Candidate, Candidates};
use serde::Serialize;
use utoipa::ToSchema;

/// The tiles to search and the expected cost of the search.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Candidates)]
pub(crate) struct CandidatesJson {
    /// The paper's count for this search: equation 3, 17 (parallel) or 28 (combined, flights of at most the turn radius);
    /// elsewhere the area of the region divided by that of one image.
    nominal_count: f64,
    /// The search region, cut at the antimeridian and at 85.05 degrees.
    region: GeometryJson,
    /// The tiles, best first: by decreasing probability, then by distance from the middle of the region.
    tiles: Vec<CandidateJson>,
    /// Probability that the image's centre lies where the returned tiles have pixels.
    containment: f64,
    /// Estimated time of a fix that searches the returned tiles, seconds of one thread on a 2 GHz core.
    estimated_s: f64,
}

/// A tile that meets the region.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Candidate)]
pub(crate) struct CandidateJson {
    /// `layer/z/x/y`: its path under `/v1/tiles/`.
    id: String,
    /// Name of the layer.
    layer: String,
    /// Zoom.
    z: u8,
    /// Column, from the antimeridian eastwards.
    x: u32,
    /// Row, 0 north.
    y: u32,
    /// Extent, degrees.
    bounds_deg: GeodeticBoundsJson,
    /// Probability that the image's centre lies in the tile, where it has pixels.
    probability: f64,
    /// Share of the tile's pixels that are valid, more than 0 and at most 1.
    valid_fraction: f64,
    /// Number of keypoints with descriptors.
    keypoints: u32,
    /// How different the descriptors are from each other, in [0, 1].
    distinctiveness: f64,
    /// True ground sample distance at the tile's centre (geometric mean of east and north).
    gsd_m_per_px: f64,
    /// Newest acquisition date in the tile (ISO 8601), if known.
    acquired: Option<String>,
}

/// An extent in degrees, west to east. A tile never crosses the antimeridian.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[schema(as = GeodeticBounds)]
pub(crate) struct GeodeticBoundsJson {
    /// Western edge, degrees.
    west: f64,
    /// Southern edge, degrees.
    south: f64,
    /// Eastern edge, degrees.
    east: f64,
    /// Northern edge, degrees.
    north: f64,
}

impl From<Candidates> for CandidatesJson {
    fn from(found: Candidates) -> Self {
        Self {
            nominal_count: found.nominal_count,
            region: found.region.into(),
            tiles: found.tiles.into_iter().map(CandidateJson::from).collect(),
            containment: found.containment,
            estimated_s: found.estimated_s,
        }
    }
}

impl From<Candidate> for CandidateJson {
    fn from(tile: Candidate) -> Self {
        Self {
            id: tile.id,
            layer: tile.layer,
            z: tile.z,
            x: tile.x,
            y: tile.y,
            bounds_deg: tile.bounds_deg.into(),
            probability: tile.probability,
            valid_fraction: tile.valid_fraction,
            keypoints: tile.keypoints,
            distinctiveness: tile.distinctiveness,
            gsd_m_per_px: tile.gsd_m_per_px,
            acquired: tile.acquired,
        }
    }
}

impl From<GeodeticBounds> for GeodeticBoundsJson {
    fn from(bounds: GeodeticBounds) -> Self {
        Self { west: bounds.west_deg, south: bounds.south_deg, east: bounds.east_deg, north: bounds.north_deg }
    }
}
