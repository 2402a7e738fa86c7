//! `CorridorCoverage`: how much of a corridor the map shows, along the route.

use super::corridor::half_width_m;
use super::error::ExportError;
use super::request::ExportRequest;
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::route::RoutePoint;
use overfly_store::{Layer, Reader};
use serde::Serialize;

/// The longest step between two cross-sections, metres.
const MAX_STEP_M: f64 = 500.0;
/// The most cross-sections of a route; steps of a longer route exceed [`MAX_STEP_M`].
const MAX_STEPS: f64 = 2_000.0;

/// One cross-section of the corridor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoverageStep {
    /// The layer.
    pub layer: String,
    /// Which route: 0 is the planned one, the others are its alternates.
    pub route: usize,
    /// Distance from that route's start, metres.
    pub way_m: f64,
    /// Latitude, degrees.
    pub latitude_deg: f64,
    /// Longitude, degrees.
    pub longitude_deg: f64,
    /// The corridor's width on each side there, metres.
    pub half_width_m: f64,
    /// Distance between two cross-sections of that route, metres; not serialised.
    #[serde(skip)]
    pub step_m: f64,
    /// Share of the cross-section that has valid pixels, in [0, 1].
    pub covered: f64,
}

/// How much of a corridor one layer shows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CorridorCoverage {
    /// The layer.
    pub layer: String,
    /// Mean coverage of the steps, in [0, 1].
    pub mean: f64,
    /// Least coverage of the steps, in [0, 1].
    pub least: f64,
    /// Share of the steps of which less than half is covered.
    pub poor_share: f64,
    /// The steps; not serialised.
    #[serde(skip)]
    pub steps: Vec<CoverageStep>,
}

/// Returns the coverage of a request's corridor by one layer.
///
/// # Errors
/// [`ExportError`] where the store cannot be read or the route leaves the tile matrix.
pub fn coverage(store: &Reader, layer: &Layer, request: &ExportRequest) -> Result<CorridorCoverage, ExportError> {
    let width = request.width();
    let mut steps = Vec::new();
    for (index, route) in request.routes.iter().enumerate() {
        let length_m = route.length_m();
        let step_m = MAX_STEP_M.min(length_m).max(length_m / MAX_STEPS);
        let before_m = if index == 0 { 0.0 } else { request.routes[0].length_m() };
        for point in route.every(step_m).unwrap_or_default() {
            let half_m = half_width_m(&width, before_m + point.way_m)?;
            steps.push(CoverageStep {
                layer: layer.name.clone(),
                route: index,
                way_m: point.way_m,
                latitude_deg: point.position.latitude_deg(),
                longitude_deg: point.position.longitude_deg(),
                half_width_m: half_m,
                step_m,
                covered: covered(store, layer, &point, half_m, step_m.min(2.0 * half_m))?,
            });
        }
    }
    let count = steps.len().max(1) as f64;
    Ok(CorridorCoverage {
        layer: layer.name.clone(),
        mean: steps.iter().map(|s| s.covered).sum::<f64>() / count,
        least: steps.iter().map(|s| s.covered).fold(1.0, f64::min),
        poor_share: steps.iter().filter(|s| s.covered < 0.5).count() as f64 / count,
        steps,
    })
}

fn covered(
    store: &Reader,
    layer: &Layer,
    point: &RoutePoint,
    half_width_m: f64,
    along_m: f64,
) -> Result<f64, ExportError> {
    let image = ImageOnGround { across_m: 2.0 * half_width_m, along_m, heading_rad: point.heading.radians() };
    let region = Region::new(point.position, image, Uncertainty::Sequential { inaccuracy_m: 0.0, drift_m: 0.0 })?;
    let mut share = 0.0;
    for footprint in store.footprints_in(layer, layer.base_zoom, &region.mercator_bounds())? {
        // The region is uniform, so a tile's probability is its share of the region's area.
        let (parts, valid) = footprint.imaged_ground();
        share += parts.iter().map(|part| region.probability(part)).sum::<f64>() * valid;
    }
    Ok(share.min(1.0))
}
