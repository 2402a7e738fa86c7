//! `Sensitivity`: how the forecasts change with one parameter.

use super::error::PlanError;
use overfly_core::coupling::{Combined, CouplingParameters, Parallel, Sequential};
use serde::Serialize;

/// The forecasts with one parameter multiplied.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sensitivity {
    /// The parameter: `seconds_per_tile` (K1), `search_constant_s`, `unit_drift_m` (D_U), `relative_s` (t0) or `inaccuracy_m` (I).
    pub parameter: &'static str,
    /// The factor.
    pub factor: f64,
    /// v_max of the sequential mode, m/s.
    pub sequential_max_speed_mps: f64,
    /// n_max; absent above v_max.
    pub max_relative_count: Option<f64>,
    /// T0_max, seconds; absent above v_max.
    pub max_mission_s: Option<f64>,
    /// The search time at which the parallel mode settles, seconds; absent where it does not.
    pub parallel_stable_s: Option<f64>,
    /// v_max of the combined mode, m/s.
    pub combined_max_speed_mps: f64,
}

/// The factors by which each parameter is multiplied.
pub const FACTORS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];

type Scale = fn(&mut CouplingParameters, f64);

/// Returns the forecasts for every parameter and every factor.
///
/// # Errors
/// [`PlanError::Coupling`] where a multiplied parameter leaves the models' domain.
pub fn sensitivity(parameters: CouplingParameters) -> Result<Vec<Sensitivity>, PlanError> {
    let scales: [(&str, Scale); 5] = [
        ("seconds_per_tile", |p, f| p.seconds_per_tile *= f),
        ("search_constant_s", |p, f| p.search_constant_s *= f),
        ("unit_drift_m", |p, f| p.unit_drift_m *= f),
        ("relative_s", |p, f| p.relative_s *= f),
        ("inaccuracy_m", |p, f| p.inaccuracy_m *= f),
    ];
    let mut found = Vec::new();
    for (parameter, scale) in scales {
        for factor in FACTORS {
            let mut p = parameters;
            scale(&mut p, factor);
            let sequential = Sequential::new(p)?;
            found.push(Sensitivity {
                parameter,
                factor,
                sequential_max_speed_mps: sequential.max_speed_mps(),
                max_relative_count: sequential.max_relative_count().ok(),
                max_mission_s: sequential.max_mission_s().ok(),
                parallel_stable_s: Parallel::new(p)?.sequence()?.fixed_points().map(|points| points.stable_s),
                combined_max_speed_mps: Combined::new(p)?.max_speed_mps(),
            });
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::coupling::DriftGrowth;

    #[test]
    fn slower_searches_and_more_drift_never_help() {
        let parameters = CouplingParameters {
            across_m: 600.0,
            along_m: 400.0,
            inaccuracy_m: 20.0,
            unit_drift_m: 1.5,
            drift_growth: DriftGrowth::Linear,
            seconds_per_tile: 0.3,
            search_constant_s: 0.1,
            relative_s: 0.2,
            speed_mps: 40.0,
            min_turn_radius_m: 500.0,
            failure_probability: None,
        };
        let found = sensitivity(parameters).unwrap();
        assert_eq!(found.len(), 25);
        for name in ["seconds_per_tile", "unit_drift_m", "inaccuracy_m"] {
            let rows: Vec<_> = found.iter().filter(|s| s.parameter == name).collect();
            for pair in rows.windows(2) {
                assert!(pair[1].sequential_max_speed_mps <= pair[0].sequential_max_speed_mps);
                assert!(pair[1].max_relative_count <= pair[0].max_relative_count);
                assert!(pair[1].combined_max_speed_mps <= pair[0].combined_max_speed_mps);
            }
        }
        // Without the constant v_max is inversely proportional to K1 (7).
        let bare = sensitivity(CouplingParameters { search_constant_s: 0.0, ..parameters }).unwrap();
        assert!((bare[0].sequential_max_speed_mps / bare[4].sequential_max_speed_mps - 16.0).abs() < 1e-9);
    }
}
