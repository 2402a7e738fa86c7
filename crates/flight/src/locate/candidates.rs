//! Which tiles to search for a position and its uncertainty, best first.
//!
//! The store's R-tree filters, the region's exact check decides, the probability that the image's centre lies in a
//! tile ranks. No tile that meets the region is ever missing.

mod error;
mod index;
mod parameters;
mod residents;

pub use error::CandidatesError;
pub use index::ResidentIndex;
pub use parameters::CandidateParameters;
pub use residents::Residents;

use overfly_core::coupling::SECONDS_PER_TILE;
use overfly_core::geodesy::{Geodetic, GeodeticBounds};
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::tile::{MAX_ZOOM, MercatorBounds, TileId, zoom_for_gsd};
use overfly_store::{Footprint, Layer, Reader};
use serde::Serialize;

/// Most tiles that one question may consider: bounds its time (about a second) and the size of its answer.
pub const MAX_TILES: u64 = 250_000;

/// One question.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateQuery {
    /// Most likely position of the image's centre; in the combined mode where the last fix was.
    pub centre: Geodetic,
    /// What the image covers.
    pub image: ImageOnGround,
    /// What is known of the centre.
    pub uncertainty: Uncertainty,
    /// Which layer; `None`: the only one, or `ortho` among several.
    pub layer: Option<String>,
    /// How many of the best to return; all by default.
    pub max_tiles: Option<usize>,
    /// Chooses the level whose pixels are no larger than this at the centre; the base level otherwise.
    pub gsd_m_per_px: Option<f64>,
}

/// The tiles to search and what the search will cost.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidates {
    /// The paper's count for this search: equation 3, 17 (parallel) or 28 (combined, flights of at most the turn radius);
    /// elsewhere the region's area over one image's.
    pub nominal_count: f64,
    /// What is searched; cut at the antimeridian and at 85.05 degrees.
    pub region: Geometry,
    /// Best first: by falling probability, then by distance from the region's middle.
    pub tiles: Vec<Candidate>,
    /// Probability that the image's centre lies in the returned tiles.
    pub containment: f64,
    /// Seconds that searching the returned tiles takes (K1 of equation 4 times their number).
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
    /// Probability that the image's centre lies in it.
    pub probability: f64,
    /// Keypoints described in it.
    pub keypoints: u32,
    /// How unlike each other they are, in [0, 1].
    pub distinctiveness: f64,
    /// True ground sample distance at its centre (geometric mean of east and north).
    pub gsd_m_per_px: f64,
    /// Newest acquisition date in it (ISO 8601), where known.
    pub acquired: Option<String>,
}

/// A GeoJSON geometry (RFC 7946) in WGS84 degrees, longitude first.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", content = "coordinates")]
pub enum Geometry {
    /// One polygon: its rings.
    Polygon(Vec<Vec<[f64; 2]>>),
    /// Several polygons: what crosses the antimeridian is cut there.
    MultiPolygon(Vec<Vec<Vec<[f64; 2]>>>),
}

impl Geometry {
    /// Polygons without holes: closed, counterclockwise rings of (longitude, latitude).
    pub fn from_rings(mut rings: Vec<Vec<[f64; 2]>>) -> Self {
        match rings.len() {
            1 => Self::Polygon(vec![rings.remove(0)]),
            _ => Self::MultiPolygon(rings.into_iter().map(|ring| vec![ring]).collect()),
        }
    }
}

/// Answers a question from the store's own R-tree ([`Residents`] answers the same from memory).
///
/// # Errors
/// [`CandidatesError`]: parameters out of range, an unknown layer, more than [`MAX_TILES`] tiles, the store.
pub fn candidates(store: &Reader, query: &CandidateQuery) -> Result<Candidates, CandidatesError> {
    let (layer, zoom, region) = prepare(store, query)?;
    let footprints = store.footprints_in(layer, zoom, &region.mercator_bounds())?;
    Ok(rank(&layer.name, footprints.iter(), &region, query.max_tiles))
}

/// The answer for footprints that an index let through: exact check, ranking, figures.
pub fn rank<'a>(
    layer: &str,
    footprints: impl Iterator<Item = &'a Footprint>,
    region: &Region,
    max_tiles: Option<usize>,
) -> Candidates {
    let mut met: Vec<(f64, f64, &Footprint)> = footprints
        .filter_map(|f| {
            let bounds = f.tile.mercator_bounds();
            let met = region.meets(&bounds);
            met.then(|| (region.probability(&bounds), region.distance_m(&bounds), f))
        })
        .collect();
    met.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)).then(a.2.tile.cmp(&b.2.tile)));
    met.truncate(max_tiles.unwrap_or(usize::MAX));
    let tiles: Vec<Candidate> = met.iter().map(|&(probability, _, f)| candidate(layer, f, probability)).collect();
    Candidates {
        nominal_count: region.nominal_count(),
        region: Geometry::from_rings(region.rings_deg()),
        // Not `sum`: of nothing that is -0, which JSON would show.
        containment: tiles.iter().fold(0.0, |sum: f64, t| sum + t.probability).min(1.0),
        estimated_s: SECONDS_PER_TILE * tiles.len() as f64,
        tiles,
    }
}

fn candidate(layer: &str, footprint: &Footprint, probability: f64) -> Candidate {
    let tile = footprint.tile;
    Candidate {
        id: format!("{layer}/{tile}"),
        layer: layer.to_owned(),
        z: tile.zoom(),
        x: tile.column(),
        y: tile.row(),
        bounds_deg: tile.bounds(),
        probability,
        keypoints: footprint.keypoints,
        distinctiveness: footprint.distinctiveness,
        gsd_m_per_px: tile.gsd().mean_m_per_px(),
        acquired: footprint.acquired.clone(),
    }
}

fn prepare<'a>(store: &'a Reader, query: &CandidateQuery) -> Result<(&'a Layer, u8, Region), CandidatesError> {
    let layer = match &query.layer {
        Some(name) => store.layer(name)?,
        None => default_layer(store)?,
    };
    let zoom = level(layer, query)?;
    let region = Region::new(query.centre, query.image, query.uncertainty)?;
    bounded(&region.mercator_bounds(), zoom, layer, MAX_TILES)?;
    Ok((layer, zoom, region))
}

/// The layer meant where none is named: the only complete one, or `ortho` among several.
///
/// # Errors
/// Where that is not one layer.
pub fn default_layer(store: &Reader) -> Result<&Layer, CandidatesError> {
    let mut complete = store.layers().iter().filter(|layer| layer.complete);
    match (complete.next(), complete.next()) {
        (Some(only), None) => Ok(only),
        _ => store.layers().iter().find(|l| l.complete && l.name == "ortho").ok_or_else(|| {
            CandidatesError::LayerNotStated { layers: store.layers().iter().map(|l| l.name.clone()).collect() }
        }),
    }
}

fn level(layer: &Layer, query: &CandidateQuery) -> Result<u8, CandidatesError> {
    let Some(gsd) = query.gsd_m_per_px else { return Ok(layer.base_zoom) };
    if !(gsd.is_finite() && gsd > 0.0) {
        return Err(CandidatesError::out_of_range("gsd_m_per_px", gsd, "metres per pixel, more than 0 and finite"));
    }
    Ok(zoom_for_gsd(query.centre, gsd).clamp(layer.min_zoom, layer.base_zoom))
}

/// How many tiles a question could meet; refused where these are more than `most`.
fn bounded(bounds: &MercatorBounds, zoom: u8, layer: &Layer, most: u64) -> Result<u64, CandidatesError> {
    let world = TileId::new(0, 0, 0).expect("the world is a tile").mercator_bounds();
    let span_m = (world.max_x_m - world.min_x_m) / f64::from(1u32 << zoom.min(MAX_ZOOM));
    let cells = |extent_m: f64| (extent_m / span_m).ceil() + 1.0;
    let tiles = cells(bounds.max_x_m - bounds.min_x_m) * cells(bounds.max_y_m - bounds.min_y_m);
    let tiles = tiles.min(layer.tiles as f64) as u64;
    if tiles > most { Err(CandidatesError::TooManyTiles { tiles, zoom, most }) } else { Ok(tiles) }
}

#[cfg(test)]
mod tests;
