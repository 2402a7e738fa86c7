//! The accepted values of a [`Scenario`].

use super::scenario::{CovarianceModel, FailureLaw, Scenario};
use overfly_core::coupling::Mode;

/// Most flights of one mode.
const MOST_RUNS: f64 = 1e6;
/// Greatest turn radius that keeps an aircraft over a map.
const MOST_RADIUS_M: f64 = 20_000.0;

const POSITIVE: &str = "a number from 1e-9 to 1e9";
const NOT_NEGATIVE: &str = "a number from 0 to 1e9";
const SHARE: &str = "a share from 0 to 1";

/// A field, its value, the least and the greatest accepted value, and a description of these.
type Bound = (&'static str, f64, f64, f64, &'static str);

impl Scenario {
    /// Checks that the simulation accepts all numbers.
    ///
    /// # Errors
    /// The first field out of range, its value, and the accepted values.
    pub fn check(&self) -> Result<(), String> {
        self.modes_are_some()?;
        self.bounds().into_iter().try_for_each(within)?;
        self.optional_bounds().into_iter().try_for_each(within)?;
        self.covariance.iter().flat_map(|c| covariance_bounds(c, self.runs)).try_for_each(within)?;
        self.probability_fits_the_law()?;
        self.parameters().check().map_err(|e| e.to_string())
    }

    fn modes_are_some(&self) -> Result<(), String> {
        let doubled = self.modes.iter().enumerate().any(|(k, mode)| self.modes[..k].contains(mode));
        if self.modes.is_empty() || doubled {
            return Err("modes: at least one, and none twice".into());
        }
        if self.modes.contains(&Mode::RelativeOnly) && self.covariance.is_none() {
            return Err("modes: relative_only is for a table [covariance], and there is none".into());
        }
        Ok(())
    }

    fn probability_fits_the_law(&self) -> Result<(), String> {
        match (self.failures.law, self.failures.probability) {
            (FailureLaw::Overlap, None) => Ok(()),
            (FailureLaw::Overlap, Some(_)) => {
                Err("failures.probability: the law overlap says it itself; leave it out".into())
            }
            (_, None) => Err("failures.probability: this law needs it, from 1e-12 to 1".into()),
            (_, Some(p)) => within(("failures.probability", p, 1e-12, 1.0, "from 1e-12 to 1")),
        }
    }

    fn bounds(&self) -> Vec<Bound> {
        let (aircraft, errors, execution) = (&self.aircraft, &self.errors, &self.execution);
        let positive = |name, value| (name, value, 1e-9, 1e9, POSITIVE);
        let not_negative = |name, value| (name, value, 0.0, 1e9, NOT_NEGATIVE);
        let is_placed = self.store.is_some() || self.covariance.is_some();
        let radius = aircraft.min_turn_radius_m;
        vec![
            ("runs", f64::from(self.runs), 1.0, MOST_RUNS, "a whole number from 1 to 1e6"),
            positive("aircraft.speed_mps", aircraft.speed_mps),
            positive("aircraft.across_m", aircraft.across_m),
            positive("aircraft.along_m", aircraft.along_m),
            not_negative("aircraft.image_interval_s", aircraft.image_interval_s),
            if is_placed {
                let expected =
                    "from 1 to 20,000 m with [store] or [covariance], where the aircraft turns to stay about";
                ("aircraft.min_turn_radius_m", radius, 1.0, MOST_RADIUS_M, expected)
            } else {
                ("aircraft.min_turn_radius_m", radius, 1e-9, f64::INFINITY, "a number from 1e-9 on, or inf")
            },
            not_negative("errors.inaccuracy_m", errors.inaccuracy_m),
            not_negative("errors.unit_drift_m", errors.unit_drift_m),
            ("errors.drift_sigmas", errors.drift_sigmas, 0.01, 100.0, "a number from 0.01 to 100"),
            positive("execution.relative_s", execution.relative_s),
            positive("execution.seconds_per_tile", execution.seconds_per_tile),
            not_negative("execution.constant_s", execution.constant_s),
            ("failures.false_share", self.failures.false_share, 0.0, 1.0, SHARE),
        ]
    }

    fn optional_bounds(&self) -> Vec<Bound> {
        let mut bounds = Vec::new();
        let times = [("mission_s", self.mission_s, 1e-9), ("without_fix_s", self.without_fix_s, 0.0)];
        bounds.extend(times.into_iter().filter_map(|(name, value, least)| {
            let expected = if least > 0.0 { POSITIVE } else { NOT_NEGATIVE };
            value.map(|value| (name, value, least, 1e9, expected))
        }));
        if let Some(count) = self.sequential.relative_count {
            bounds.push(("sequential.relative_count", count as f64, 0.0, 1e9, "a whole number from 0 to 1e9"));
        }
        if let Some(store) = &self.store {
            bounds.push(("store.least_covered", store.least_covered, 1e-3, 1.0, "a share from 0.001 to 1"));
            bounds.push(("store.beyond_m", store.beyond_m, -1e5, 1e5, "metres from -1e5 to 1e5"));
        }
        bounds
    }
}

fn covariance_bounds(c: &CovarianceModel, runs: u32) -> Vec<Bound> {
    let metres = |name, value| (name, value, 1e-3, 1e5, "metres from 0.001 to 1e5");
    let degrees = |name, value| (name, value, 1e-4, 30.0, "degrees from 1e-4 to 30");
    let ratio = |name, value| (name, value, 1e-6, 0.3, "a ratio from 1e-6 to 0.3");
    let expected = "a whole number from 1 to `runs`";
    vec![
        ("covariance.runs", f64::from(c.runs), 1.0, f64::from(runs), expected),
        metres("covariance.height_m", c.height_m),
        degrees("covariance.heading_offset_deg", c.heading_offset_deg),
        degrees("covariance.heading_noise_deg", c.heading_noise_deg),
        ratio("covariance.height_offset_ratio", c.height_offset_ratio),
        ratio("covariance.height_noise_ratio", c.height_noise_ratio),
        degrees("covariance.turn_noise_deg", c.turn_noise_deg),
        ratio("covariance.climb_noise_ratio", c.climb_noise_ratio),
        metres("covariance.start_sigma_m", c.start_sigma_m),
        metres("covariance.fix_sigma_m", c.fix_sigma_m),
        ("covariance.fix_common_share", c.fix_common_share, 0.0, 1.0, SHARE),
        degrees("covariance.fix_heading_deg", c.fix_heading_deg),
        ratio("covariance.fix_scale_ratio", c.fix_scale_ratio),
        ("covariance.stated_ratio", c.stated_ratio, 0.01, 100.0, "a number from 0.01 to 100"),
    ]
}

fn within((name, value, least, most, expected): Bound) -> Result<(), String> {
    let holds = value >= least && value <= most;
    if holds { Ok(()) } else { Err(format!("{name} = {value}: {expected}")) }
}
