//! How much of a corridor the map shows, along the way.

use super::corridor::half_width_m;
use super::{ExportError, ExportRequest};
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::route::RoutePoint;
use overfly_store::{Layer, Reader};
use serde::Serialize;

/// Longest and most steps in which a route is looked at.
const LONGEST_STEP_M: f64 = 500.0;
const MOST_STEPS: f64 = 2_000.0;

/// One cross-section of the corridor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoverageStep {
    /// The layer.
    pub layer: String,
    /// Which route: 0 is the planned one, the others are its alternates.
    pub route: usize,
    /// Way from that route's start, metres.
    pub way_m: f64,
    /// Where.
    pub latitude_deg: f64,
    /// Where.
    pub longitude_deg: f64,
    /// The corridor on each side there, metres.
    pub half_width_m: f64,
    /// Share of the cross-section that has valid pixels, in [0, 1].
    pub covered: f64,
}

/// What a layer shows of a corridor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// The layer.
    pub layer: String,
    /// Mean over the steps.
    pub mean: f64,
    /// Least of the steps.
    pub least: f64,
    /// Share of the steps of which less than half is covered.
    pub poor_share: f64,
    /// Step by step; not in the summary.
    #[serde(skip)]
    pub steps: Vec<CoverageStep>,
}

/// The coverage of a request's corridor by one layer.
///
/// # Errors
/// Where the store cannot be read or the route leaves the tile matrix.
pub fn coverage(store: &Reader, layer: &Layer, request: &ExportRequest) -> Result<Coverage, ExportError> {
    let width = request.width();
    let mut steps = Vec::new();
    for (index, route) in request.routes.iter().enumerate() {
        let length_m = route.length_m();
        let step_m = LONGEST_STEP_M.min(length_m).max(length_m / MOST_STEPS);
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
                covered: covered(store, layer, &point, half_m, step_m.min(2.0 * half_m))?,
            });
        }
    }
    let count = steps.len().max(1) as f64;
    Ok(Coverage {
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
    let image = ImageOnGround { across_m: 2.0 * half_width_m, along_m, heading_rad: point.heading_rad };
    let region = Region::new(point.position, image, Uncertainty::Sequential { inaccuracy_m: 0.0, drift_m: 0.0 })?;
    let mut share = 0.0;
    for footprint in store.footprints_in(layer, layer.base_zoom, &region.mercator_bounds())? {
        // The region is uniform, so a tile's probability is its share of the region's area.
        share += region.probability(&footprint.tile.mercator_bounds()) * footprint.valid_fraction;
    }
    Ok(share.min(1.0))
}
