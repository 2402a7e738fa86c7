//! `CouplingParameters`: the parameters of the models of the three modes.

use super::error::{not_negative, positive, positive_or_infinite, probability};
use super::{CouplingError, DriftGrowth};
use serde::{Deserialize, Serialize};

/// An aircraft, its camera, and the times and errors of its registrations. Lengths are on the ground, times are seconds;
/// lengths, times and speeds lie in 1e-9 to 1e9.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CouplingParameters {
    /// a: the image's ground extent across the heading, metres.
    pub across_m: f64,
    /// b: the image's ground extent along the heading, metres.
    pub along_m: f64,
    /// I: full width of an absolute registration's error, metres, at least 0.
    pub inaccuracy_m: f64,
    /// D_U: drift of one relative registration, one-sided, metres, at least 0.
    pub unit_drift_m: f64,
    /// Growth of the drift with the number of relative registrations.
    #[serde(default)]
    pub drift_growth: DriftGrowth,
    /// K1: search time per area of one image (a b), seconds. [`seconds_per_image`](super::seconds_per_image) converts a time
    /// per tile of another size.
    pub seconds_per_tile: f64,
    /// The part of the search time that does not depend on the searched area, seconds, at least 0. It is 0 in the paper; a
    /// measured line t = constant + K1 tiles has one.
    #[serde(default)]
    pub search_constant_s: f64,
    /// t0 of (9, 17): time of one relative registration, seconds; T_exe of (45).
    pub relative_s: f64,
    /// v: ground speed, m/s.
    pub speed_mps: f64,
    /// R_min: smallest turn radius, metres; infinite for straight flight only.
    pub min_turn_radius_m: f64,
    /// p: a measured probability, in (0, 1], that an absolute registration fails, independent of its duration. `None` selects
    /// the paper's model, in which the probability grows with the duration (5, 6).
    #[serde(default)]
    pub failure_probability: Option<f64>,
}

impl CouplingParameters {
    /// Checks that all values lie in the models' domain.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] with the first field that does not.
    pub fn check(&self) -> Result<(), CouplingError> {
        positive("across_m", self.across_m)?;
        positive("along_m", self.along_m)?;
        not_negative("inaccuracy_m", self.inaccuracy_m)?;
        not_negative("unit_drift_m", self.unit_drift_m)?;
        positive("seconds_per_tile", self.seconds_per_tile)?;
        not_negative("search_constant_s", self.search_constant_s)?;
        positive("relative_s", self.relative_s)?;
        positive("speed_mps", self.speed_mps)?;
        positive_or_infinite("min_turn_radius_m", self.min_turn_radius_m)?;
        self.failure_probability.map_or(Ok(1.0), |p| probability("failure_probability", p))?;
        Ok(())
    }

    /// K1 / (a b): search time per square metre of map.
    pub(super) fn seconds_per_m2(&self) -> f64 {
        self.seconds_per_tile / (self.across_m * self.along_m)
    }

    /// C of (11): (a + I)(b + I), the area to search without drift, square metres.
    pub(super) fn still_area_m2(&self) -> f64 {
        (self.across_m + self.inaccuracy_m) * (self.along_m + self.inaccuracy_m)
    }

    /// a + b + 2 I: half the rim of that area, metres.
    pub(super) fn still_rim_m(&self) -> f64 {
        self.across_m + self.along_m + 2.0 * self.inaccuracy_m
    }

    /// C plus the area that could be searched in the constant part of the search time, square metres.
    pub(super) fn loaded_area_m2(&self) -> f64 {
        self.still_area_m2() + self.search_constant_s / self.seconds_per_m2()
    }
}

/// Parameters for the tests of the modes: one plain aircraft, and draws over many orders of magnitude.
#[cfg(test)]
pub(super) mod drawn {
    use super::*;
    use rand::Rng;
    use rand_chacha::ChaCha8Rng;

    pub const PLAIN: CouplingParameters = CouplingParameters {
        across_m: 600.0,
        along_m: 400.0,
        inaccuracy_m: 20.0,
        unit_drift_m: 1.5,
        drift_growth: DriftGrowth::Linear,
        seconds_per_tile: 0.3,
        search_constant_s: 0.0,
        relative_s: 0.2,
        speed_mps: 40.0,
        min_turn_radius_m: 500.0,
        failure_probability: None,
    };

    /// Between `low` and `high`, evenly in the logarithm.
    pub fn log_uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
        (low.ln() + rng.random::<f64>() * (high / low).ln()).exp()
    }

    /// Any aircraft: images from 30 m to 10 km, slow and fast searches, sharp turns and none.
    pub fn any(rng: &mut ChaCha8Rng) -> CouplingParameters {
        CouplingParameters {
            across_m: log_uniform(rng, 30.0, 1e4),
            along_m: log_uniform(rng, 30.0, 1e4),
            inaccuracy_m: if rng.random_bool(0.2) { 0.0 } else { log_uniform(rng, 0.1, 1e3) },
            unit_drift_m: log_uniform(rng, 0.01, 100.0),
            drift_growth: DriftGrowth::Linear,
            seconds_per_tile: log_uniform(rng, 1e-3, 30.0),
            search_constant_s: if rng.random_bool(0.5) { 0.0 } else { log_uniform(rng, 1e-3, 10.0) },
            relative_s: log_uniform(rng, 0.01, 5.0),
            speed_mps: log_uniform(rng, 5.0, 500.0),
            min_turn_radius_m: if rng.random_bool(0.2) { f64::INFINITY } else { log_uniform(rng, 20.0, 5e3) },
            failure_probability: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::drawn::PLAIN;
    use super::*;

    #[test]
    fn names_the_field_that_is_out_of_domain() {
        assert_eq!(PLAIN.check(), Ok(()));
        let broken = [
            ("across_m", CouplingParameters { across_m: 0.0, ..PLAIN }),
            ("along_m", CouplingParameters { along_m: f64::NAN, ..PLAIN }),
            ("inaccuracy_m", CouplingParameters { inaccuracy_m: -1.0, ..PLAIN }),
            ("unit_drift_m", CouplingParameters { unit_drift_m: f64::INFINITY, ..PLAIN }),
            ("seconds_per_tile", CouplingParameters { seconds_per_tile: 0.0, ..PLAIN }),
            ("search_constant_s", CouplingParameters { search_constant_s: f64::NAN, ..PLAIN }),
            ("relative_s", CouplingParameters { relative_s: -0.1, ..PLAIN }),
            ("speed_mps", CouplingParameters { speed_mps: 0.0, ..PLAIN }),
            ("min_turn_radius_m", CouplingParameters { min_turn_radius_m: 0.0, ..PLAIN }),
            ("failure_probability", CouplingParameters { failure_probability: Some(0.0), ..PLAIN }),
        ];
        for (field, parameters) in broken {
            match parameters.check() {
                Err(CouplingError::OutOfDomain { name, .. }) => assert_eq!(name, field),
                other => panic!("{field}: {other:?}"),
            }
        }
    }

    #[test]
    fn is_read_from_toml_with_the_papers_model_where_nothing_is_said() {
        let text = "across_m = 600\nalong_m = 400\ninaccuracy_m = 20\nunit_drift_m = 1.5\nseconds_per_tile = 0.3\n\
                    relative_s = 0.2\nspeed_mps = 40\nmin_turn_radius_m = 500\n";
        assert_eq!(toml::from_str::<CouplingParameters>(text).unwrap(), PLAIN);
        let straight = toml::from_str::<CouplingParameters>(&text.replace("500", "inf")).unwrap();
        assert_eq!(straight.min_turn_radius_m, f64::INFINITY);
        assert!(toml::from_str::<CouplingParameters>(&format!("{text}speed_kmh = 3\n")).is_err());
    }
}
