//! The parallel mode: relative registrations propagate the position while an absolute one runs, and the next search covers
//! their drift.

use super::error::not_negative;
use super::sequence::{ExecutionSequence, FixedPoints};
use super::{CouplingError, CouplingParameters, DriftGrowth, nominal_count_sequential};

/// The model of the parallel mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parallel {
    parameters: CouplingParameters,
}

impl Parallel {
    /// Makes the model. It does not use `min_turn_radius_m` and `failure_probability`.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    pub fn new(parameters: CouplingParameters) -> Result<Self, CouplingError> {
        parameters.check()?;
        Ok(Self { parameters })
    }

    /// The number of relative registrations during `execution_s` seconds: t_exe / t0, not rounded.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Section IV.C, before equation 17.
    pub fn relative_count(&self, execution_s: f64) -> Result<f64, CouplingError> {
        Ok(not_negative("execution_s", execution_s)? / self.parameters.relative_s)
    }

    /// 𝒩 of the search that follows one of `execution_s` seconds.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Equation 17: (3) with the drift of t_exe / t0 relative registrations.
    pub fn nominal_count(&self, execution_s: f64) -> Result<f64, CouplingError> {
        let p = &self.parameters;
        let drift_m = p.drift_growth.factor(self.relative_count(execution_s)?) * p.unit_drift_m;
        Ok(nominal_count_sequential(p.across_m, p.along_m, p.inaccuracy_m, drift_m))
    }

    /// Gamma: the sequence of search times. Its fixed points are t1 and t2 (21, 22); conditions 1 to 3 state their existence
    /// and the limit. `unstable_s` (t2) is also the longest time without a fix from which the mode recovers.
    ///
    /// Condition 3 as printed (t1 to t2) is too narrow below and too wide above. From every start in [0, t2) the times tend
    /// to t1; a start at t2 stays there. Where the discriminant is zero they settle from [0, t1].
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] where a coefficient overflows.
    ///
    /// # Example
    /// A 600 x 400 m image is searched in 0.3 s while the drift grows by 1.5 m every 0.2 s.
    /// ```
    /// # use overfly_core::coupling::*;
    /// # let parameters = CouplingParameters {
    /// #     across_m: 600.0, along_m: 400.0, inaccuracy_m: 20.0, unit_drift_m: 1.5, drift_growth: DriftGrowth::Linear,
    /// #     seconds_per_tile: 0.3, search_constant_s: 0.0, relative_s: 0.2, speed_mps: 40.0, min_turn_radius_m: 500.0,
    /// #     failure_probability: None,
    /// # };
    /// let times = Parallel::new(parameters).unwrap().sequence().unwrap();
    /// assert!((times.limit_s(10.0).unwrap() - 0.332005).abs() < 1e-6);
    /// ```
    ///
    /// # References
    /// Equations 18 and 19: alpha, beta and gamma are the quadratic, linear and constant coefficient. With independent
    /// drifts the coefficients are 4 D_U^2 K1 / (a b t0) of t and 2 D_U (a + b + 2 I) K1 / (a b sqrt(t0)) of sqrt(t).
    pub fn sequence(&self) -> Result<ExecutionSequence, CouplingError> {
        let p = &self.parameters;
        let constant_s = p.search_constant_s + p.seconds_per_m2() * p.still_area_m2();
        let rim = 2.0 * p.unit_drift_m * p.still_rim_m() * p.seconds_per_m2();
        let area = 4.0 * p.unit_drift_m * p.unit_drift_m * p.seconds_per_m2();
        match p.drift_growth {
            DriftGrowth::Linear => {
                let t0 = p.relative_s;
                ExecutionSequence::polynomial(constant_s, rim / t0, area / (t0 * t0), 0.0)
            }
            DriftGrowth::SquareRoot => {
                ExecutionSequence::with_root(constant_s, rim / p.relative_s.sqrt(), area / p.relative_s)
            }
        }
    }

    /// The fixed points t1 and t2.
    ///
    /// # Errors
    /// [`CouplingError::NoFixedPoint`] where conditions 1 and 2 do not hold.
    ///
    /// # References
    /// Equations 20 to 22. At a discriminant of exactly zero, which (20) excludes, both are equal.
    pub fn fixed_points(&self) -> Result<FixedPoints, CouplingError> {
        self.sequence()?.fixed_points().ok_or(CouplingError::NoFixedPoint)
    }

    /// The largest drift of one relative registration at which the searches settle, metres.
    ///
    /// # References
    /// Not in the paper. Conditions 1 and 2 together are beta + 2 sqrt(alpha gamma) <= 1, solved here for D_U: without a search
    /// constant a b t0 / (2 K1 (sqrt(a + I) + sqrt(b + I))^2). With square-root growth the condition is
    /// 4 D_U^2 K1 / (a b t0) < 1, and at the bound itself the searches do not settle.
    pub fn max_unit_drift_m(&self) -> f64 {
        let p = &self.parameters;
        match p.drift_growth {
            DriftGrowth::Linear => {
                let reach_m = p.still_rim_m() + 2.0 * p.loaded_area_m2().sqrt();
                p.relative_s / (2.0 * p.seconds_per_m2() * reach_m)
            }
            DriftGrowth::SquareRoot => (p.relative_s / p.seconds_per_m2()).sqrt() / 2.0,
        }
    }

    /// The speed at which two images one relative registration apart share no ground, m/s: b / t0. The mode has no other limit
    /// of speed, because its drift grows with the number of registrations and not with the distance.
    ///
    /// # References
    /// Section III.A (t_exe < t_lim) for the relative registration. The paper states no limit for this mode.
    pub fn max_speed_mps(&self) -> f64 {
        self.parameters.along_m / self.parameters.relative_s
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters::drawn::{PLAIN, any};
    use super::super::sequence::trials::Tally;
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// The next search time written down again from (18).
    fn next_again(p: &CouplingParameters, t: f64) -> f64 {
        let count = t / p.relative_s;
        let drift = p.unit_drift_m * if p.drift_growth == DriftGrowth::Linear { count } else { count.sqrt() };
        let sides = (p.across_m + p.inaccuracy_m + 2.0 * drift) * (p.along_m + p.inaccuracy_m + 2.0 * drift);
        p.search_constant_s + p.seconds_per_tile * sides / (p.across_m * p.along_m)
    }

    #[test]
    fn the_conditions_20_to_22_say_what_20000_simulated_flights_do() {
        let mut rng = ChaCha8Rng::seed_from_u64(20);
        let mut tally = Tally::default();
        for k in 0..20_000 {
            let mut p = any(&mut rng);
            p.drift_growth = if k % 4 == 3 { DriftGrowth::SquareRoot } else { DriftGrowth::Linear };
            let law = Parallel::new(p).unwrap().sequence().unwrap();
            tally.compare(&law, &mut rng, |t| next_again(&p, t));
        }
        tally.check();
    }

    #[test]
    fn the_coefficients_are_those_of_equation_19() {
        let mut rng = ChaCha8Rng::seed_from_u64(19);
        for _ in 0..500 {
            let p = CouplingParameters { search_constant_s: 0.0, ..any(&mut rng) };
            let (a, b, i, d, k1, t0) =
                (p.across_m, p.along_m, p.inaccuracy_m, p.unit_drift_m, p.seconds_per_tile, p.relative_s);
            let alpha = 4.0 * d * d * k1 / (a * b * t0 * t0);
            let beta = 2.0 * d * (a + b + 2.0 * i) * k1 / (a * b * t0);
            let gamma = k1 * (a + i) * (b + i) / (a * b);
            let mode = Parallel::new(p).unwrap();
            for t in [0.0, 0.3, 7.0, 400.0] {
                let nineteen = alpha * t * t + beta * t + gamma;
                assert!((mode.sequence().unwrap().next_s(t) / nineteen - 1.0).abs() < 1e-12);
                assert!((next_again(&p, t) / nineteen - 1.0).abs() < 1e-12);
                assert!((k1 * mode.nominal_count(t).unwrap() / nineteen - 1.0).abs() < 1e-12);
            }
            // (20) to (22) as printed, where they do not cancel.
            let discriminant = (beta - 1.0).powi(2) - 4.0 * alpha * gamma;
            match mode.fixed_points() {
                Ok(found) => {
                    assert!(beta < 1.0 && discriminant >= -1e-9);
                    let printed = |sign: f64| (-(beta - 1.0) + sign * discriminant.max(0.0).sqrt()) / (2.0 * alpha);
                    assert!((printed(1.0) / found.unstable_s - 1.0).abs() < 1e-6);
                    assert!((printed(-1.0) - found.stable_s).abs() < 1e-6 * found.stable_s + 1e-12 / alpha);
                }
                Err(error) => assert!(error == CouplingError::NoFixedPoint && (beta >= 1.0 || discriminant < 1e-9)),
            }
        }
    }

    #[test]
    fn the_printed_t1_loses_its_digits_where_drift_is_small() {
        let p = CouplingParameters { unit_drift_m: 1e-6, ..PLAIN };
        let found = Parallel::new(p).unwrap().fixed_points().unwrap();
        assert!((next_again(&p, found.stable_s) / found.stable_s - 1.0).abs() < 1e-14);
        let (area, t0) = (p.across_m * p.along_m, p.relative_s);
        let alpha = 4.0 * p.unit_drift_m.powi(2) * p.seconds_per_tile / (area * t0 * t0);
        let beta = 2.0 * p.unit_drift_m * p.still_rim_m() * p.seconds_per_tile / (area * t0);
        let gamma = p.seconds_per_tile * p.still_area_m2() / area;
        let printed = (-(beta - 1.0) - ((beta - 1.0).powi(2) - 4.0 * alpha * gamma).sqrt()) / (2.0 * alpha);
        assert!((printed / found.stable_s - 1.0).abs() > 1e-3, "{printed}");
    }

    #[test]
    fn condition_3_is_too_narrow_below_and_too_wide_above() {
        let law = Parallel::new(PLAIN).unwrap().sequence().unwrap();
        let FixedPoints { stable_s, unstable_s } = law.fixed_points().unwrap();
        assert!(stable_s > 0.0 && unstable_s > 10.0 * stable_s);
        let end = |first_s: f64| law.times_s(first_s).nth(5000).unwrap();
        // Printed: t1 <= t_exe(1) <= t2. Below t1, down to 0, it settles too ...
        for first_s in [0.0, 0.2 * stable_s, stable_s, 0.5 * (stable_s + unstable_s), 0.999 * unstable_s] {
            assert!((end(first_s) / stable_s - 1.0).abs() < 1e-9, "from {first_s}");
            assert_eq!(law.limit_s(first_s), Ok(stable_s));
        }
        // ... and at t2 it stays for as long as rounding lets it, instead of tending to t1.
        assert!((law.next_s(unstable_s) / unstable_s - 1.0).abs() < 1e-12);
        assert_eq!(law.limit_s(unstable_s), Ok(unstable_s));
        assert!(end(1.001 * unstable_s).is_infinite());
        assert_eq!(law.limit_s(1.001 * unstable_s).unwrap_err().code(), "starts_too_late");
    }

    #[test]
    fn the_largest_drift_is_where_settling_ends() {
        let mut rng = ChaCha8Rng::seed_from_u64(22);
        for k in 0..2000 {
            let mut p = any(&mut rng);
            p.drift_growth = if k % 2 == 0 { DriftGrowth::Linear } else { DriftGrowth::SquareRoot };
            let bound = Parallel::new(p).unwrap().max_unit_drift_m();
            let with =
                |unit_drift_m: f64| Parallel::new(CouplingParameters { unit_drift_m, ..p }).unwrap().fixed_points();
            assert!(with(bound * 0.999_999).is_ok() && with(bound * 1.000_001).is_err(), "{p:?}");
            if p.drift_growth == DriftGrowth::Linear && p.search_constant_s == 0.0 {
                let roots = (p.across_m + p.inaccuracy_m).sqrt() + (p.along_m + p.inaccuracy_m).sqrt();
                let area = p.across_m * p.along_m;
                let neat = area * p.relative_s / (2.0 * p.seconds_per_tile * roots * roots);
                assert!((bound / neat - 1.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn whole_relative_registrations_stay_within_one_of_the_continuous_model() {
        // A flight in which drift comes in whole registrations: those that have begun bound it from above, those that have
        // ended from below; the continuous sequence lies between, and so do the ends.
        let law = Parallel::new(PLAIN).unwrap().sequence().unwrap();
        let stepwise =
            |t: f64, whole: fn(f64) -> f64| next_again(&PLAIN, whole(t / PLAIN.relative_s) * PLAIN.relative_s);
        let (mut below, mut above) = (5.0, 5.0);
        for t in law.times_s(5.0).take(200) {
            let rounding = 1.0 + 1e-12;
            assert!(below <= t * rounding && t <= above * rounding, "{below} {t} {above}");
            (below, above) = (stepwise(below, f64::floor), stepwise(above, f64::ceil));
        }
        let one_more_s = next_again(&PLAIN, PLAIN.relative_s) - next_again(&PLAIN, 0.0);
        assert!(above - below < 2.0 * one_more_s, "{below} {above}");
    }

    #[test]
    fn without_drift_every_start_settles_at_once() {
        let mode = Parallel::new(CouplingParameters { unit_drift_m: 0.0, inaccuracy_m: 0.0, ..PLAIN }).unwrap();
        assert_eq!(mode.fixed_points(), Ok(FixedPoints { stable_s: 0.3, unstable_s: f64::INFINITY }));
        assert_eq!(mode.sequence().unwrap().times_s(1e6).nth(1), Some(0.3));
        assert!(mode.nominal_count(-1.0).is_err() && mode.relative_count(f64::NAN).is_err());
    }

    #[test]
    fn the_speed_is_limited_by_the_overlap_of_relative_registration_alone() {
        assert_eq!(Parallel::new(PLAIN).unwrap().max_speed_mps(), 2000.0);
        let fast = CouplingParameters { speed_mps: 400.0, ..PLAIN };
        assert_eq!(Parallel::new(fast).unwrap().fixed_points(), Parallel::new(PLAIN).unwrap().fixed_points());
    }
}
