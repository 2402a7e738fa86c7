//! `RouteForecast`: where along a route fixes are expected, and the cost of the longest gap between them.

use super::error::PlanError;
use super::forecast::Forecast;
use overfly_core::coupling::{Combined, CouplingError, CouplingParameters, Parallel};
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::route::{Route, RoutePoint};
use overfly_store::{Layer, Reader};
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;

/// The thresholds at which a fix is expected. All three must be reached: distinctiveness alone is high for a few dissimilar
/// keypoints too.
///
/// The defaults are chosen, not fitted. In the stores on which whole flights were located, tiles have 500 keypoints (the most
/// that are kept) and a distinctiveness of 0.24 or more; of 22,440 other tiles the least was 0.17.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Thresholds {
    /// Least share of the image's ground that the map shows.
    pub least_covered: f64,
    /// Least number of keypoints of a full tile, mean over the image.
    pub least_keypoints: f64,
    /// Least distinctiveness of the tiles, mean over the image.
    pub least_distinctiveness: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { least_covered: 0.5, least_keypoints: 100.0, least_distinctiveness: 0.2 }
    }
}

/// One image along a route.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RouteStep {
    /// Distance from the start along the route, metres.
    pub way_m: f64,
    /// Latitude of the image's centre, degrees.
    pub latitude_deg: f64,
    /// Longitude of the image's centre, degrees.
    pub longitude_deg: f64,
    /// Direction of flight, degrees clockwise from north.
    pub heading_deg: f64,
    /// Share of the image's ground that the map shows.
    pub covered: f64,
    /// Keypoints of a full tile, mean over the image.
    pub keypoints: f64,
    /// Distinctiveness of the tiles, mean over the image.
    pub distinctiveness: f64,
    /// Whether all three reach their thresholds.
    pub fix_expected: bool,
    /// Distance since the last image with an expected fix, or since the start, where the position is known, metres.
    pub since_fix_m: f64,
    /// D_T: the drift of relative registrations here, one-sided, metres.
    pub drift_m: f64,
    /// 𝒩 (3) of a search here.
    pub nominal_count: f64,
    /// Duration of an absolute registration here, seconds.
    pub execution_s: f64,
}

/// A part of the route without a fix.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gap {
    /// Where the last fix before the gap is expected, metres from the start.
    pub from_m: f64,
    /// Where the next fix is expected, or the route's end, metres from the start.
    pub to_m: f64,
    /// Duration of its flight, seconds.
    pub duration_s: f64,
    /// n: number of relative registrations in it, one after the other.
    pub relative_count: f64,
    /// D_T at its end, one-sided, metres.
    pub drift_m: f64,
    /// 𝒩 (3) of the search at its end.
    pub nominal_count: f64,
    /// Duration of that search, seconds.
    pub execution_s: f64,
    /// 𝒩 with absolute registrations alone; absent beyond a quarter of a turn, for which no bound is claimed.
    pub combined_nominal_count: Option<f64>,
    /// Whether searches of the parallel mode still settle after it.
    pub parallel_holds: bool,
    /// Whether searches of the combined mode still settle after it; `false` beyond a quarter of a turn.
    pub combined_holds: bool,
}

/// The forecast along a route.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RouteForecast {
    /// Length of the route, metres.
    pub length_m: f64,
    /// b: distance between two images, metres.
    pub step_m: f64,
    /// The thresholds at which a fix is expected.
    pub thresholds: Thresholds,
    /// Share of the images that the map covers enough.
    pub with_map: f64,
    /// Share of the images with an expected fix.
    pub with_fix: f64,
    /// The longest part of the route without a fix.
    pub longest_gap: Gap,
    /// The images; not serialised.
    #[serde(skip)]
    pub steps: Vec<RouteStep>,
}

impl RouteForecast {
    /// Makes the forecast along a route in steps of one image; `progress` is called after each step.
    ///
    /// # Errors
    /// [`PlanError`] where the route is too long for its steps, the image makes no search region, or the store fails.
    pub fn new(
        route: &Route,
        forecast: &Forecast,
        store: &Reader,
        layer: &Layer,
        thresholds: Thresholds,
        mut progress: impl FnMut(),
    ) -> Result<Self, PlanError> {
        let p = forecast.parameters;
        let points = route
            .every(p.along_m)
            .map_err(|e| PlanError::NotARoute { path: "the route".into(), reason: e.to_string() })?;
        let mut steps = Vec::with_capacity(points.len());
        let (mut fixed_m, mut longest) = (0.0, [0.0, 0.0]);
        for point in &points {
            let mut step = image_step(point, &p, store, layer)?;
            step.fix_expected = step.covered >= thresholds.least_covered
                && step.keypoints >= thresholds.least_keypoints
                && step.distinctiveness >= thresholds.least_distinctiveness;
            step.since_fix_m = point.way_m - fixed_m;
            let after = SearchAfterGap::new(&p, step.since_fix_m)?;
            (step.drift_m, step.nominal_count) = (after.drift_m, after.nominal_count);
            step.execution_s = after.execution_s;
            if step.since_fix_m > longest[1] - longest[0] {
                longest = [fixed_m, point.way_m];
            }
            if step.fix_expected {
                fixed_m = point.way_m;
            }
            steps.push(step);
            progress();
        }
        let share = |holds: &dyn Fn(&RouteStep) -> bool| {
            steps.iter().filter(|s| holds(s)).count() as f64 / steps.len().max(1) as f64
        };
        let (with_map, with_fix) = (share(&|s| s.covered >= thresholds.least_covered), share(&|s| s.fix_expected));
        let longest_gap = gap(&p, longest)?;
        Ok(Self { length_m: route.length_m(), step_m: p.along_m, thresholds, with_map, with_fix, longest_gap, steps })
    }
}

/// Returns one image with the properties of the map under it, and without its fix.
fn image_step(
    point: &RoutePoint,
    p: &CouplingParameters,
    store: &Reader,
    layer: &Layer,
) -> Result<RouteStep, PlanError> {
    let image = ImageOnGround { across_m: p.across_m, along_m: p.along_m, heading_rad: point.heading.radians() };
    let known = Uncertainty::Sequential { inaccuracy_m: p.inaccuracy_m, drift_m: 0.0 };
    let region = Region::new(point.position, image, known)?;
    let (mut covered, mut met, mut keypoints, mut distinctiveness) = (0.0, 0.0, 0.0, 0.0);
    for footprint in store.footprints_in(layer, layer.base_zoom, &region.mercator_bounds())? {
        // The centre is uniform over the region, so a tile's probability is its share of the region's area.
        let share = region.probability(&footprint.tile.mercator_bounds());
        met += share;
        covered += share * footprint.valid_fraction;
        keypoints += share * f64::from(footprint.keypoints);
        distinctiveness += share * footprint.distinctiveness;
    }
    let mean = |sum: f64, over: f64| if over > 0.0 { sum / over } else { 0.0 };
    Ok(RouteStep {
        way_m: point.way_m,
        latitude_deg: point.position.latitude_deg(),
        longitude_deg: point.position.longitude_deg(),
        heading_deg: point.heading.degrees(),
        covered,
        // Per valid ground: a half-empty tile has half the keypoints and is not worse.
        keypoints: mean(keypoints, covered),
        distinctiveness: mean(distinctiveness, met),
        fix_expected: false,
        since_fix_m: 0.0,
        drift_m: 0.0,
        nominal_count: 0.0,
        execution_s: 0.0,
    })
}

/// The drift after a distance without a fix, and the search that follows.
struct SearchAfterGap {
    relative_count: f64,
    drift_m: f64,
    nominal_count: f64,
    execution_s: f64,
}

impl SearchAfterGap {
    fn new(p: &CouplingParameters, way_m: f64) -> Result<Self, CouplingError> {
        let relative_count = way_m / p.speed_mps / p.relative_s;
        let drift_m = p.drift_growth.drift_m(relative_count, p.unit_drift_m)?;
        let nominal_count = Parallel::new(*p)?.nominal_count(way_m / p.speed_mps)?;
        let execution_s = p.search_constant_s + p.seconds_per_tile * nominal_count;
        Ok(Self { relative_count, drift_m, nominal_count, execution_s })
    }
}

fn gap(p: &CouplingParameters, [from_m, to_m]: [f64; 2]) -> Result<Gap, PlanError> {
    let duration_s = (to_m - from_m) / p.speed_mps;
    let SearchAfterGap { relative_count, drift_m, nominal_count, execution_s } = SearchAfterGap::new(p, to_m - from_m)?;
    let combined = Combined::new(*p)?;
    let bounded = combined.turned_rad(duration_s)? <= FRAC_PI_2;
    Ok(Gap {
        from_m,
        to_m,
        duration_s,
        relative_count,
        drift_m,
        nominal_count,
        execution_s,
        combined_nominal_count: bounded.then(|| combined.nominal_count(duration_s)).transpose()?,
        parallel_holds: Parallel::new(*p)?.sequence()?.limit_s(duration_s).is_ok(),
        combined_holds: bounded && combined.sequence()?.limit_s(duration_s).is_ok(),
    })
}
