//! Where along a route the map is there and says enough to be recognised; the longest way between, and what it costs.

use super::{Forecast, PlanError};
use overfly_core::coupling::{Combined, CouplingError, CouplingParameters, Parallel};
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::route::{Route, RoutePoint};
use overfly_store::{Layer, Reader};
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;

/// From when on a fix is expected. The defaults are stated figures, not fitted ones: tiles of the stores on which whole flights
/// were located hold 500 keypoints (the most that are kept) of a distinctiveness of 0.24 and more (0.17
/// was the least of 22,440 others). Distinctiveness is high on a few unlike points too, so all three must hold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Thresholds {
    /// Share of the image's ground that the map shows.
    pub least_covered: f64,
    /// Keypoints of a full tile there, mean over the image.
    pub least_keypoints: f64,
    /// Of the tiles there, mean over the image.
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
    /// Way from the start, metres.
    pub way_m: f64,
    /// Its centre.
    pub latitude_deg: f64,
    /// Its centre.
    pub longitude_deg: f64,
    /// Direction of flight.
    pub heading_deg: f64,
    /// Share of its ground that the map shows.
    pub covered: f64,
    /// Keypoints of a full tile, mean over the image.
    pub keypoints: f64,
    /// Distinctiveness of the tiles, mean over the image.
    pub distinctiveness: f64,
    /// Whether all three reach their thresholds.
    pub fix_expected: bool,
    /// Way since the last image where a fix was expected (or the start, where the position is known), metres.
    pub since_fix_m: f64,
    /// D_T that relative registrations leave here, one-sided, metres.
    pub drift_m: f64,
    /// 𝒩 of a search here (3).
    pub nominal_count: f64,
    /// Time of an absolute registration here, seconds.
    pub execution_s: f64,
}

/// A way without a fix.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gap {
    /// Where the last fix before it is expected, metres from the start.
    pub from_m: f64,
    /// Where the next one is, or the route's end.
    pub to_m: f64,
    /// How long it is flown, seconds.
    pub duration_s: f64,
    /// n: relative registrations on it, one after the other.
    pub relative_count: f64,
    /// D_T at its end, one-sided, metres.
    pub drift_m: f64,
    /// 𝒩 of the search at its end (3).
    pub nominal_count: f64,
    /// Time of that search, seconds.
    pub execution_s: f64,
    /// 𝒩 with absolute registrations alone; absent beyond a quarter of a turn, for which no bound is claimed.
    pub combined_nominal_count: Option<f64>,
    /// Whether searches of the parallel mode still settle after it.
    pub parallel_holds: bool,
    /// Whether those of the combined mode do; `false` beyond a quarter of a turn.
    pub combined_holds: bool,
}

/// What a route holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RouteForecast {
    /// Its length, metres.
    pub length_m: f64,
    /// Way between two images, metres: b.
    pub step_m: f64,
    /// From when on a fix is expected.
    pub thresholds: Thresholds,
    /// Share of the images of which the map shows enough.
    pub with_map: f64,
    /// Share of the images where a fix is expected.
    pub with_fix: f64,
    /// The longest way without a fix.
    pub longest_gap: Gap,
    /// Image by image; not in the summary.
    #[serde(skip)]
    pub steps: Vec<RouteStep>,
}

impl RouteForecast {
    /// Looks at a route in steps of one image; `progress` is called after each.
    ///
    /// # Errors
    /// [`PlanError`] where the route is too long for its steps, the image has no region, or the store fails.
    pub fn of(
        route: &Route,
        forecast: &Forecast,
        store: &Reader,
        layer: &Layer,
        thresholds: Thresholds,
        mut progress: impl FnMut(),
    ) -> Result<Self, PlanError> {
        let p = forecast.parameters;
        let points =
            route.every(p.along_m).map_err(|reason| PlanError::NotARoute { path: "the route".into(), reason })?;
        let mut steps = Vec::with_capacity(points.len());
        let (mut fixed_m, mut longest) = (0.0, [0.0, 0.0]);
        for point in &points {
            let mut step = look(point, &p, store, layer)?;
            step.fix_expected = step.covered >= thresholds.least_covered
                && step.keypoints >= thresholds.least_keypoints
                && step.distinctiveness >= thresholds.least_distinctiveness;
            step.since_fix_m = point.way_m - fixed_m;
            let after = After::of(&p, step.since_fix_m)?;
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

/// The map under one image.
fn look(point: &RoutePoint, p: &CouplingParameters, store: &Reader, layer: &Layer) -> Result<RouteStep, PlanError> {
    let image = ImageOnGround { across_m: p.across_m, along_m: p.along_m, heading_rad: point.heading_rad };
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
        heading_deg: point.heading_rad.to_degrees(),
        covered,
        // Per valid ground: a tile half empty has half the keypoints and is no worse for it.
        keypoints: mean(keypoints, covered),
        distinctiveness: mean(distinctiveness, met),
        fix_expected: false,
        since_fix_m: 0.0,
        drift_m: 0.0,
        nominal_count: 0.0,
        execution_s: 0.0,
    })
}

/// What a way without a fix leaves.
struct After {
    relative_count: f64,
    drift_m: f64,
    nominal_count: f64,
    execution_s: f64,
}

impl After {
    fn of(p: &CouplingParameters, way_m: f64) -> Result<Self, CouplingError> {
        let relative_count = way_m / p.speed_mps / p.relative_s;
        let drift_m = p.drift_growth.drift_m(relative_count, p.unit_drift_m)?;
        let nominal_count = Parallel::new(*p)?.nominal_count(way_m / p.speed_mps)?;
        let execution_s = p.search_constant_s + p.seconds_per_tile * nominal_count;
        Ok(Self { relative_count, drift_m, nominal_count, execution_s })
    }
}

fn gap(p: &CouplingParameters, [from_m, to_m]: [f64; 2]) -> Result<Gap, PlanError> {
    let duration_s = (to_m - from_m) / p.speed_mps;
    let After { relative_count, drift_m, nominal_count, execution_s } = After::of(p, to_m - from_m)?;
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

/// A row per image.
pub fn route_csv(route: &RouteForecast) -> String {
    let mut text = String::from(
        "way_m,latitude_deg,longitude_deg,heading_deg,covered,keypoints,distinctiveness,fix_expected,since_fix_m,drift_m,\
         nominal_count,execution_s\n",
    );
    for s in &route.steps {
        text.push_str(&format!(
            "{:.1},{:.8},{:.8},{:.3},{:.4},{:.1},{:.4},{},{:.1},{:.3},{:.4},{:.5}\n",
            s.way_m,
            s.latitude_deg,
            s.longitude_deg,
            s.heading_deg,
            s.covered,
            s.keypoints,
            s.distinctiveness,
            s.fix_expected,
            s.since_fix_m,
            s.drift_m,
            s.nominal_count,
            s.execution_s
        ));
    }
    text
}

/// A Point per image, with all that is known of it.
pub fn route_geojson(route: &RouteForecast) -> String {
    let features: Vec<_> = route
        .steps
        .iter()
        .map(|s| {
            serde_json::json!({
                "type": "Feature",
                "geometry": {"type": "Point", "coordinates": [s.longitude_deg, s.latitude_deg]},
                "properties": s,
            })
        })
        .collect();
    serde_json::json!({"type": "FeatureCollection", "features": features}).to_string()
}
