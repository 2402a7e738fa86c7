//! Writing a route's forecast as CSV and GeoJSON.

use super::matchability::{RouteForecast, RouteStep};
use serde::{Serialize, Serializer};

/// A row of `route.csv`: a [`RouteStep`] with fixed numbers of decimals.
#[derive(Serialize)]
struct RouteRow {
    #[serde(serialize_with = "decimals::<1, _>")]
    way_m: f64,
    #[serde(serialize_with = "decimals::<8, _>")]
    latitude_deg: f64,
    #[serde(serialize_with = "decimals::<8, _>")]
    longitude_deg: f64,
    #[serde(serialize_with = "decimals::<3, _>")]
    heading_deg: f64,
    #[serde(serialize_with = "decimals::<4, _>")]
    covered: f64,
    #[serde(serialize_with = "decimals::<1, _>")]
    keypoints: f64,
    #[serde(serialize_with = "decimals::<4, _>")]
    distinctiveness: f64,
    fix_expected: bool,
    #[serde(serialize_with = "decimals::<1, _>")]
    since_fix_m: f64,
    #[serde(serialize_with = "decimals::<3, _>")]
    drift_m: f64,
    #[serde(serialize_with = "decimals::<4, _>")]
    nominal_count: f64,
    #[serde(serialize_with = "decimals::<5, _>")]
    execution_s: f64,
}

impl From<&RouteStep> for RouteRow {
    fn from(step: &RouteStep) -> Self {
        Self {
            way_m: step.way_m,
            latitude_deg: step.latitude_deg,
            longitude_deg: step.longitude_deg,
            heading_deg: step.heading_deg,
            covered: step.covered,
            keypoints: step.keypoints,
            distinctiveness: step.distinctiveness,
            fix_expected: step.fix_expected,
            since_fix_m: step.since_fix_m,
            drift_m: step.drift_m,
            nominal_count: step.nominal_count,
            execution_s: step.execution_s,
        }
    }
}

/// Serialises a number with `N` decimals.
fn decimals<const N: usize, S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{value:.N$}"))
}

/// Returns the images as CSV: a header, and one row for each image.
pub fn route_csv(route: &RouteForecast) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for step in &route.steps {
        writer.serialize(RouteRow::from(step)).expect("rows of numbers serialise to memory");
    }
    let bytes = writer.into_inner().expect("memory takes every row");
    String::from_utf8(bytes).expect("rows of numbers are ASCII")
}

/// Returns the images as GeoJSON, one Point feature each, with all fields as properties.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::matchability::{Gap, Thresholds};

    #[test]
    fn writes_fixed_decimals() {
        let step = RouteStep {
            way_m: 12.345,
            latitude_deg: 47.123_456_789,
            longitude_deg: -99.5,
            heading_deg: 90.0,
            covered: 1.0,
            keypoints: 499.96,
            distinctiveness: 0.24,
            fix_expected: true,
            since_fix_m: 0.0,
            drift_m: f64::INFINITY,
            nominal_count: 2.5,
            execution_s: 0.1,
        };
        let longest_gap = Gap {
            from_m: 0.0,
            to_m: 0.0,
            duration_s: 0.0,
            relative_count: 0.0,
            drift_m: 0.0,
            nominal_count: 0.0,
            execution_s: 0.0,
            combined_nominal_count: None,
            parallel_holds: true,
            combined_holds: true,
        };
        let thresholds = Thresholds::default();
        let (with_map, with_fix, steps) = (1.0, 1.0, vec![step]);
        let route = RouteForecast { length_m: 1.0, step_m: 1.0, thresholds, with_map, with_fix, longest_gap, steps };
        let expected = "way_m,latitude_deg,longitude_deg,heading_deg,covered,keypoints,distinctiveness,fix_expected,\
                        since_fix_m,drift_m,nominal_count,execution_s\n\
                        12.3,47.12345679,-99.50000000,90.000,1.0000,500.0,0.2400,true,0.0,inf,2.5000,0.10000\n";
        assert_eq!(route_csv(&route), expected);
    }
}
