//! The combined mode: absolute registrations only. Each searches the ground that the aircraft can have reached during the
//! one before.
//!
//! There are two models. Functions with the suffix `_paper` are equations 28 to 31 as printed. Functions without the suffix
//! use corrected areas, as derived in [`shown_area_m2`](super::shown_area_m2), and include I and the constant part of a
//! search.

use super::error::not_negative;
use super::sequence::{ExecutionSequence, FixedPoints, crossing};
use super::{CouplingError, CouplingParameters, swept_area_paper_m2, turned_rad};

/// The model of the combined mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Combined {
    parameters: CouplingParameters,
}

impl Combined {
    /// Makes the model. It does not use `unit_drift_m`, `relative_s` and `failure_probability`.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    pub fn new(parameters: CouplingParameters) -> Result<Self, CouplingError> {
        parameters.check()?;
        Ok(Self { parameters })
    }

    /// The largest turn of the aircraft during a search of `execution_s`, radians. The printed model assumes that it is far
    /// below 1, the corrected one that it is at most a quarter of a turn.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Equation 24.
    pub fn turned_rad(&self, execution_s: f64) -> Result<f64, CouplingError> {
        let p = &self.parameters;
        turned_rad(p.speed_mps * not_negative("execution_s", execution_s)?, p.min_turn_radius_m)
    }

    /// 𝒩 of the search that follows one of `execution_s` seconds, as printed; 0 for `execution_s` = 0.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Equation 28.
    pub fn nominal_count_paper(&self, execution_s: f64) -> Result<f64, CouplingError> {
        let p = &self.parameters;
        let path_m = p.speed_mps * not_negative("execution_s", execution_s)?;
        Ok(swept_area_paper_m2(p.across_m, path_m, p.min_turn_radius_m)? / (p.across_m * p.along_m))
    }

    /// 𝒩 of the search that follows one of `execution_s` seconds: all ground that the image can show, I included;
    /// (a + I)(b + I) / (a b) for `execution_s` = 0. The width of the wings is taken as s^2 / (2 R), which makes 𝒩 a
    /// polynomial. Up to a quarter of a turn it is never too small, and exceeds the exact area by at most the share
    /// u^2 / (2 - 2 cos(u)) - 1 with u = s / R: 9 % at one radian, 23 % at the quarter.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Replaces equation 28: (s^3 / (3 R) + (b + I) s^2 / R + (a + I) s + (a + I)(b + I)) / (a b), s = v t.
    pub fn nominal_count(&self, execution_s: f64) -> Result<f64, CouplingError> {
        let p = &self.parameters;
        let path_m = p.speed_mps * not_negative("execution_s", execution_s)?;
        Ok(self.area_m2(path_m) / (p.across_m * p.along_m))
    }

    /// Phi as printed: the sequence of search times.
    ///
    /// Its fixed points are 0 and s1. From every start below s1 it tends to 0, because the printed model searches nothing
    /// where the aircraft had no time to move. A start at s1 stays there, which condition 2 overlooks.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] where a coefficient overflows.
    ///
    /// # References
    /// Equation 29: sigma and sigma' are the cubic and the linear coefficient. Equations 30 and 31 are its fixed points.
    pub fn sequence_paper(&self) -> Result<ExecutionSequence, CouplingError> {
        let p = &self.parameters;
        let (k, v) = (p.seconds_per_m2(), p.speed_mps);
        let cube = 2.0 * k * v * v * v / (3.0 * p.min_turn_radius_m);
        ExecutionSequence::polynomial(0.0, k * v * p.across_m, 0.0, cube)
    }

    /// The sequence of search times. `unstable_s` of its fixed points is also the longest time without a fix from which the
    /// mode recovers.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] where a coefficient overflows.
    ///
    /// # Example
    /// A 600 x 400 m image searched in 0.3 s at 40 m/s: the times settle a little above 0.3 s, not at 0.
    /// ```
    /// # use overfly_core::coupling::*;
    /// # let parameters = CouplingParameters {
    /// #     across_m: 600.0, along_m: 400.0, inaccuracy_m: 20.0, unit_drift_m: 1.5, drift_growth: DriftGrowth::Linear,
    /// #     seconds_per_tile: 0.3, search_constant_s: 0.0, relative_s: 0.2, speed_mps: 40.0, min_turn_radius_m: 500.0,
    /// #     failure_probability: None,
    /// # };
    /// let mode = Combined::new(parameters).unwrap();
    /// assert!((mode.sequence().unwrap().limit_s(5.0).unwrap() - 0.336111).abs() < 1e-6);
    /// assert_eq!(mode.sequence_paper().unwrap().limit_s(5.0), Ok(0.0));
    /// ```
    ///
    /// # References
    /// Replaces equation 29: `search_constant_s` + K1 times [`nominal_count`](Self::nominal_count).
    pub fn sequence(&self) -> Result<ExecutionSequence, CouplingError> {
        let p = &self.parameters;
        let (k, v, r) = (p.seconds_per_m2(), p.speed_mps, p.min_turn_radius_m);
        ExecutionSequence::polynomial(
            p.search_constant_s + k * p.still_area_m2(),
            k * v * (p.across_m + p.inaccuracy_m),
            k * v * v * (p.along_m + p.inaccuracy_m) / r,
            k * v * v * v / (3.0 * r),
        )
    }

    /// The fixed points s2 = 0 and s1 of the printed model.
    ///
    /// # Errors
    /// [`CouplingError::NoFixedPoint`] where sigma' is 1 or more, so that condition 1 does not hold.
    ///
    /// # References
    /// Equations 30 and 31.
    pub fn fixed_points_paper(&self) -> Result<FixedPoints, CouplingError> {
        self.sequence_paper()?.fixed_points().ok_or(CouplingError::NoFixedPoint)
    }

    /// The time at which searches settle, and the longest time from which they still settle.
    ///
    /// # Errors
    /// [`CouplingError::NoFixedPoint`] above [`max_speed_mps`](Self::max_speed_mps).
    ///
    /// # References
    /// Replaces equations 30 and 31.
    pub fn fixed_points(&self) -> Result<FixedPoints, CouplingError> {
        self.sequence()?.fixed_points().ok_or(CouplingError::NoFixedPoint)
    }

    /// The speed at and above which the printed model does not settle, m/s: b / K1.
    ///
    /// # References
    /// Condition 1 of section IV.D: sigma' < 1.
    pub fn max_speed_paper_mps(&self) -> f64 {
        self.parameters.along_m / self.parameters.seconds_per_tile
    }

    /// The largest speed at which searches settle, m/s. With an infinite turn radius they settle below that speed only.
    ///
    /// # References
    /// Not in the paper. With Q(s) the area after s metres and k = K1 / (a b), a fixed point is a path length s with
    /// v = s / (k Q(s)). The largest such v lies where Q = s Q', and is 1 / (k Q') there.
    pub fn max_speed_mps(&self) -> f64 {
        let p = &self.parameters;
        let (a_m, b_m) = (p.across_m + p.inaccuracy_m, p.along_m + p.inaccuracy_m);
        let (r, loaded_m2) = (p.min_turn_radius_m, p.loaded_area_m2());
        if r == f64::INFINITY {
            return 1.0 / (p.seconds_per_m2() * a_m);
        }
        // Q - s Q' = C - b s^2 / R - 2 s^3 / (3 R) falls from C, and is negative at the second bracket.
        let rises = |s: f64| loaded_m2 - s * s / r * (b_m + 2.0 / 3.0 * s) > 0.0;
        let best_m = crossing(0.0, (r * loaded_m2 / b_m).sqrt(), rises);
        1.0 / (p.seconds_per_m2() * (a_m + (2.0 * b_m + best_m) * best_m / r))
    }

    fn area_m2(&self, path_m: f64) -> f64 {
        let p = &self.parameters;
        let (a_m, b_m, turned) =
            (p.across_m + p.inaccuracy_m, p.along_m + p.inaccuracy_m, path_m / p.min_turn_radius_m);
        path_m * turned * (path_m / 3.0 + b_m) + a_m * path_m + p.still_area_m2()
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters::drawn::{PLAIN, any};
    use super::super::sequence::trials::Tally;
    use super::super::shown_area_m2;
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// (29) written down again from (27) and (28).
    fn next_paper(p: &CouplingParameters, t: f64) -> f64 {
        let s = p.speed_mps * t;
        let area = 2.0 * s.powi(3) / (3.0 * p.min_turn_radius_m) + p.across_m * s;
        p.seconds_per_tile * area / (p.across_m * p.along_m)
    }

    /// The corrected one from its four areas.
    fn next_corrected(p: &CouplingParameters, t: f64) -> f64 {
        let (s, a, b) = (p.speed_mps * t, p.across_m + p.inaccuracy_m, p.along_m + p.inaccuracy_m);
        let (wings, ahead, aside) = (s.powi(3) / (3.0 * p.min_turn_radius_m), a * s, b * s * s / p.min_turn_radius_m);
        p.search_constant_s + p.seconds_per_tile * (wings + ahead + aside + a * b) / (p.across_m * p.along_m)
    }

    /// 20,000 aircraft, simulated and stated; `corrected` or printed.
    fn compare(corrected: bool, seed: u64) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut tally = Tally::default();
        for _ in 0..20_000 {
            let p = any(&mut rng);
            let mode = Combined::new(p).unwrap();
            let law = if corrected { mode.sequence() } else { mode.sequence_paper() }.unwrap();
            tally.compare(&law, &mut rng, |t| if corrected { next_corrected(&p, t) } else { next_paper(&p, t) });
        }
        tally.check();
    }

    #[test]
    fn the_conditions_of_31_say_what_20000_simulated_flights_of_the_printed_model_do() {
        compare(false, 31);
    }

    #[test]
    fn the_corrected_conditions_say_what_20000_simulated_flights_do() {
        compare(true, 32);
    }

    #[test]
    fn the_printed_model_is_equations_28_to_31() {
        let mut rng = ChaCha8Rng::seed_from_u64(28);
        for _ in 0..500 {
            let p = any(&mut rng);
            let mode = Combined::new(p).unwrap();
            let sigma =
                2.0 * p.seconds_per_tile * p.speed_mps.powi(3) / (3.0 * p.min_turn_radius_m * p.across_m * p.along_m);
            let dashed = p.seconds_per_tile * p.speed_mps / p.along_m;
            for t in [0.0, 0.4, 9.0] {
                let printed = sigma * t * t * t + dashed * t;
                let near = |value: f64| (value - printed).abs() <= 1e-12 * printed;
                assert!(near(mode.sequence_paper().unwrap().next_s(t)) && near(next_paper(&p, t)));
                assert!(near(p.seconds_per_tile * mode.nominal_count_paper(t).unwrap()));
            }
            match mode.fixed_points_paper() {
                Ok(found) => {
                    assert!(dashed < 1.0 && p.speed_mps < mode.max_speed_paper_mps() && found.stable_s == 0.0);
                    let s1 = ((1.0 - dashed) / sigma).sqrt();
                    assert!(s1 == found.unstable_s || (s1 / found.unstable_s - 1.0).abs() < 1e-9);
                }
                Err(_) => assert!(dashed >= 1.0 - 1e-12),
            }
        }
    }

    #[test]
    fn the_printed_model_reads_nothing_in_the_end_and_a_real_search_at_least_its_image() {
        let mode = Combined::new(PLAIN).unwrap();
        let (paper, real) = (mode.sequence_paper().unwrap(), mode.sequence().unwrap());
        assert!(paper.times_s(5.0).nth(200).unwrap() < 1e-20);
        assert_eq!((mode.nominal_count_paper(0.0), paper.limit_s(5.0)), (Ok(0.0), Ok(0.0)));
        let settled = real.times_s(5.0).nth(200).unwrap();
        assert!((settled / real.limit_s(5.0).unwrap() - 1.0).abs() < 1e-12);
        assert!(settled > PLAIN.seconds_per_tile && mode.nominal_count(0.0).unwrap() > 1.0);
        // At s1 the printed one stays (condition 2 says it tends to 0), beyond it grows.
        let s1 = mode.fixed_points_paper().unwrap().unstable_s;
        assert!((paper.next_s(s1) / s1 - 1.0).abs() < 1e-12);
        assert_eq!(paper.limit_s(s1), Ok(s1));
        assert!(paper.times_s(1.001 * s1).nth(500).unwrap().is_infinite());
        assert!(paper.times_s(0.999 * s1).nth(5000).unwrap() < 1e-20);
    }

    #[test]
    fn the_polynomial_lies_above_the_exact_area_by_at_most_the_width_of_its_wings() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut most = 0.0f64;
        for _ in 0..5000 {
            let p = CouplingParameters { min_turn_radius_m: rng.random_range(20.0..5e3), ..any(&mut rng) };
            let mode = Combined::new(p).unwrap();
            let u = rng.random_range(0.05..1.57);
            let path_m = u * p.min_turn_radius_m;
            let (a, b) = (p.across_m + p.inaccuracy_m, p.along_m + p.inaccuracy_m);
            let exact = shown_area_m2(a, b, path_m, p.min_turn_radius_m).unwrap() / (p.across_m * p.along_m);
            let ratio = mode.nominal_count(path_m / p.speed_mps).unwrap() / exact;
            assert!(ratio >= 1.0 - 1e-12 && ratio <= u * u / (2.0 - 2.0 * u.cos()) + 1e-9, "{ratio}");
            most = most.max(ratio);
        }
        assert!(most > 1.05 && most < 1.234, "{most}");
    }

    #[test]
    fn the_largest_speed_is_where_settling_ends() {
        let mut rng = ChaCha8Rng::seed_from_u64(17);
        for _ in 0..3000 {
            let p = any(&mut rng);
            let mode = Combined::new(p).unwrap();
            let bound = mode.max_speed_mps();
            if !(1e-6..1e8).contains(&bound) {
                continue;
            }
            let with = |speed_mps: f64| Combined::new(CouplingParameters { speed_mps, ..p }).unwrap().fixed_points();
            assert!(with(bound * 0.999_999).is_ok() && with(bound * 1.000_001).is_err(), "{p:?} {bound}");
            assert!(bound < mode.max_speed_paper_mps() * (1.0 + 1e-12));
        }
    }

    #[test]
    fn straight_flight_is_a_line_with_one_fixed_point() {
        let p = CouplingParameters { min_turn_radius_m: f64::INFINITY, inaccuracy_m: 0.0, ..PLAIN };
        let mode = Combined::new(p).unwrap();
        assert_eq!(mode.max_speed_mps(), mode.max_speed_paper_mps());
        assert_eq!(mode.fixed_points_paper(), Ok(FixedPoints { stable_s: 0.0, unstable_s: f64::INFINITY }));
        // t = K1 (1 + v t / b).
        let found = mode.fixed_points().unwrap();
        assert!((found.stable_s - 0.3 / (1.0 - 0.3 * 40.0 / 400.0)).abs() < 1e-12 && found.unstable_s.is_infinite());
        assert_eq!(mode.turned_rad(100.0), Ok(0.0));
        let at = Combined::new(CouplingParameters { speed_mps: mode.max_speed_mps(), ..p }).unwrap();
        assert_eq!(at.fixed_points().unwrap_err().code(), "no_fixed_point");
    }

    #[test]
    fn refuses_what_is_no_number() {
        let mode = Combined::new(PLAIN).unwrap();
        assert!(mode.nominal_count(f64::NAN).is_err() && mode.nominal_count_paper(-1.0).is_err());
        assert!(mode.turned_rad(f64::INFINITY).is_err());
        assert!(Combined::new(CouplingParameters { min_turn_radius_m: f64::NAN, ..PLAIN }).is_err());
    }
}
