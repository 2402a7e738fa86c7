//! The sequential mode: n relative registrations and one absolute registration, repeated.
//!
//! With a `search_constant_s` of 0, linear drift and no measured failure probability this is the paper's model. Functions with
//! the suffix `_paper` are its approximations as printed.

use super::error::not_negative;
use super::mission::{absolute_count, expected_failures, mission_of_one_failure_s};
use super::{CouplingError, CouplingParameters, DriftGrowth, nominal_count_sequential, scan_limit_s};

/// The model of the sequential mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sequential {
    parameters: CouplingParameters,
}

/// Tolerance, as a share, of the comparison of an absolute registration's time with that of the flight over one image: at
/// n_max the two are equal up to rounding.
const ROUNDING: f64 = 1e-9;

impl Sequential {
    /// Makes the model. It does not use `min_turn_radius_m`.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    pub fn new(parameters: CouplingParameters) -> Result<Self, CouplingError> {
        parameters.check()?;
        Ok(Self { parameters })
    }

    /// 𝒩 after n relative registrations. Here and below, n is at least 0 and need not be whole.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Equations 2 and 3.
    pub fn nominal_count(&self, relative_count: f64) -> Result<f64, CouplingError> {
        let p = &self.parameters;
        let drift_m = p.drift_growth.drift_m(relative_count, p.unit_drift_m)?;
        Ok(nominal_count_sequential(p.across_m, p.along_m, p.inaccuracy_m, drift_m))
    }

    /// t_exe of the absolute registration after n relative ones, seconds.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Equation 4, plus `search_constant_s`.
    pub fn execution_s(&self, relative_count: f64) -> Result<f64, CouplingError> {
        Ok(self.parameters.search_constant_s + self.parameters.seconds_per_tile * self.nominal_count(relative_count)?)
    }

    /// K2, 1/s: growth of the failure probability per second of execution, v / b.
    ///
    /// # References
    /// Equation 6.
    pub fn failures_per_second(&self) -> f64 {
        self.parameters.speed_mps / self.parameters.along_m
    }

    /// p of the absolute registration after n relative ones: K2 t_exe, or the measured probability if there is one.
    ///
    /// # Errors
    /// [`CouplingError::SpeedAboveMax`] or [`CouplingError::CountAboveMax`] where the registration ends after the aircraft has
    /// left the image; [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Equations 5 and 6.
    pub fn failure_probability(&self, relative_count: f64) -> Result<f64, CouplingError> {
        let share = self.execution_s(relative_count)? * self.failures_per_second();
        if share > 1.0 + ROUNDING {
            let max_relative_count = self.max_relative_count()?;
            return Err(CouplingError::CountAboveMax { relative_count, max_relative_count });
        }
        Ok(self.parameters.failure_probability.unwrap_or(share.min(1.0)))
    }

    /// v_max, m/s: the speed at which an absolute registration without drift takes as long as the flight over one image.
    ///
    /// # Example
    /// For 600 x 400 m, 20 m and 0.3 s: 600 x 400^2 / (0.3 x 620 x 420).
    /// ```
    /// # use overfly_core::coupling::*;
    /// # let parameters = CouplingParameters {
    /// #     across_m: 600.0, along_m: 400.0, inaccuracy_m: 20.0, unit_drift_m: 1.5, drift_growth: DriftGrowth::Linear,
    /// #     seconds_per_tile: 0.3, search_constant_s: 0.0, relative_s: 0.2, speed_mps: 40.0, min_turn_radius_m: 500.0,
    /// #     failure_probability: None,
    /// # };
    /// let mode = Sequential::new(parameters).unwrap();
    /// assert!((mode.max_speed_mps() - 1228.879).abs() < 1e-3);
    /// ```
    ///
    /// # References
    /// Equation 7 (the condition is garbled in print; it reads n = 0).
    pub fn max_speed_mps(&self) -> f64 {
        let p = &self.parameters;
        p.along_m / (p.seconds_per_m2() * p.loaded_area_m2())
    }

    /// n_max: the number of relative registrations after which the absolute one takes as long as the flight over one image.
    /// Infinite without drift.
    ///
    /// # Errors
    /// [`CouplingError::SpeedAboveMax`].
    ///
    /// # References
    /// Equation 8, with numerator and denominator multiplied by the conjugate so that nothing cancels near v_max. The square of
    /// that result for drift with square-root growth.
    pub fn max_relative_count(&self) -> Result<f64, CouplingError> {
        let p = &self.parameters;
        // At n_max (a + I + u)(b + I + u) = Q with u = 2 D_T.
        let limit_s = scan_limit_s(p.along_m, p.speed_mps)?;
        let room_m2 = limit_s / p.seconds_per_m2() - p.loaded_area_m2();
        if room_m2 < -ROUNDING * p.loaded_area_m2() {
            return Err(CouplingError::SpeedAboveMax { speed_mps: p.speed_mps, max_speed_mps: self.max_speed_mps() });
        }
        let room_m2 = room_m2.max(0.0);
        let widening_m =
            2.0 * room_m2 / (p.still_rim_m() + p.still_rim_m().mul_add(p.still_rim_m(), 4.0 * room_m2).sqrt());
        if p.unit_drift_m == 0.0 {
            return Ok(f64::INFINITY);
        }
        let factor = widening_m / (2.0 * p.unit_drift_m);
        Ok(match p.drift_growth {
            DriftGrowth::Linear => factor,
            DriftGrowth::SquareRoot => factor * factor,
        })
    }

    /// t_cycle, seconds: the time of n relative registrations and one absolute registration.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Equation 9.
    pub fn cycle_s(&self, relative_count: f64) -> Result<f64, CouplingError> {
        Ok(relative_count * self.parameters.relative_s + self.execution_s(relative_count)?)
    }

    /// f(n) = p N: the expected number of failures in a mission of `mission_s` seconds.
    ///
    /// # Errors
    /// As [`failure_probability`](Self::failure_probability).
    ///
    /// # References
    /// Equations 10 and 11.
    pub fn expected_failures(&self, relative_count: f64, mission_s: f64) -> Result<f64, CouplingError> {
        let p = self.failure_probability(relative_count)?;
        expected_failures(p, absolute_count(mission_s, self.cycle_s(relative_count)?)?)
    }

    /// The derivative of f(n) with respect to n.
    ///
    /// # Errors
    /// As [`failure_probability`](Self::failure_probability).
    ///
    /// # References
    /// Equation 12, whose C' must read C. With E the execution time, f = T0 v / b E / (n t0 + E) has the derivative
    /// T0 v / b t0 (n E' - E) / (n t0 + E)^2 for any growth of drift. A measured p gives -p T0 (t0 + E') / (n t0 + E)^2;
    /// at n = 0 with square-root growth this is minus infinity.
    pub fn expected_failures_slope(&self, relative_count: f64, mission_s: f64) -> Result<f64, CouplingError> {
        let p = &self.parameters;
        let mission_s = not_negative("mission_s", mission_s)?;
        let probability = self.failure_probability(relative_count)?;
        let (execution_s, cycle_s) = (self.execution_s(relative_count)?, self.cycle_s(relative_count)?);
        let slope_s = self.execution_slope_s(relative_count);
        Ok(match p.failure_probability {
            None => {
                let gained_s = if relative_count == 0.0 { 0.0 } else { relative_count * slope_s };
                let rate = mission_s * self.failures_per_second() * p.relative_s;
                rate * (gained_s - execution_s) / (cycle_s * cycle_s)
            }
            Some(_) => -probability * mission_s * (p.relative_s + slope_s) / (cycle_s * cycle_s),
        })
    }

    /// E' = d t_exe / dn, seconds, by the chain rule over D_T.
    fn execution_slope_s(&self, relative_count: f64) -> f64 {
        let p = &self.parameters;
        let drift_m = p.drift_growth.factor(relative_count) * p.unit_drift_m;
        let per_metre_s = p.seconds_per_m2() * (2.0 * p.still_rim_m() + 8.0 * drift_m);
        match p.drift_growth {
            DriftGrowth::Linear => per_metre_s * p.unit_drift_m,
            DriftGrowth::SquareRoot if p.unit_drift_m == 0.0 => 0.0,
            DriftGrowth::SquareRoot => per_metre_s * p.unit_drift_m / (2.0 * relative_count.sqrt()),
        }
    }

    /// The n at which f(n) is least, regardless of n_max: sqrt(C / A). Infinite where f always falls: without drift, with drift
    /// of square-root growth, or with a failure probability that does not depend on n.
    ///
    /// # References
    /// The exact form of equation 13. The approximation is [`optimal_relative_count_paper`](Self::optimal_relative_count_paper).
    pub fn optimal_relative_count(&self) -> f64 {
        let p = &self.parameters;
        let falls_for_ever = p.drift_growth == DriftGrowth::SquareRoot || p.failure_probability.is_some();
        if falls_for_ever { f64::INFINITY } else { p.loaded_area_m2().sqrt() / (2.0 * p.unit_drift_m) }
    }

    /// The approximation of n_opt for I far below a and b: sqrt(a b) / (2 D_U).
    ///
    /// # References
    /// Equation 13, right-hand side.
    pub fn optimal_relative_count_paper(&self) -> f64 {
        let p = &self.parameters;
        (p.across_m * p.along_m).sqrt() / (2.0 * p.unit_drift_m)
    }

    /// n_opt: the n in [0, n_max] at which f(n) is least. f falls up to [`optimal_relative_count`](Self::optimal_relative_count).
    /// Where that lies beyond n_max, the result is n_max: there p has reached 1, and the paper's condition for (14) fails.
    ///
    /// # Errors
    /// [`CouplingError::SpeedAboveMax`].
    ///
    /// # References
    /// Equations 8 and 13.
    pub fn best_relative_count(&self) -> Result<f64, CouplingError> {
        Ok(self.optimal_relative_count().min(self.max_relative_count()?))
    }

    /// The whole n in [0, n_max] at which f(n) is least; `u64::MAX` where there is no limit.
    ///
    /// # Errors
    /// [`CouplingError::SpeedAboveMax`].
    pub fn best_whole_relative_count(&self) -> Result<u64, CouplingError> {
        let best = self.best_relative_count()?;
        // n_max is known up to rounding: 5.999999999 is 6.
        let most = (self.max_relative_count()? * (1.0 + ROUNDING)).floor();
        let (below, above) = (best.floor(), best.ceil());
        // Beyond 2^53 every f64 is whole.
        if below >= 9.0e15 {
            return Ok(if below.is_finite() { below as u64 } else { u64::MAX });
        }
        let above_is_better =
            above <= most && self.expected_failures(above, 1.0)? < self.expected_failures(below, 1.0)?;
        Ok(if above_is_better { above as u64 } else { below as u64 })
    }

    /// The smallest expected number of failures in `mission_s` seconds: f at
    /// [`best_relative_count`](Self::best_relative_count). 0 where n has no limit.
    ///
    /// # Errors
    /// [`CouplingError::SpeedAboveMax`], [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// The exact form of equation 14.
    pub fn least_expected_failures(&self, mission_s: f64) -> Result<f64, CouplingError> {
        let best = self.best_relative_count()?;
        if best.is_infinite() {
            return Ok(0.0 * not_negative("mission_s", mission_s)?);
        }
        self.expected_failures(best, mission_s)
    }

    /// The smallest expected number of failures as printed, for I far below a and b and n_opt below n_max. It is too small, by
    /// at most the share I / min(a, b) if nothing else differs.
    ///
    /// # References
    /// Equation 14.
    pub fn least_expected_failures_paper(&self, mission_s: f64) -> f64 {
        mission_s / self.max_mission_paper_s()
    }

    /// T0_max, seconds: the longest mission with less than one expected failure, at the best n. Infinite without drift. A
    /// failure is still possible: see [`chance_of_no_failure`](super::chance_of_no_failure).
    ///
    /// # Errors
    /// [`CouplingError::SpeedAboveMax`].
    ///
    /// # References
    /// The exact form of equations 15 and 16.
    pub fn max_mission_s(&self) -> Result<f64, CouplingError> {
        let best = self.best_relative_count()?;
        if best.is_infinite() {
            return Ok(f64::INFINITY);
        }
        mission_of_one_failure_s(self.failure_probability(best)?, self.cycle_s(best)?)
    }

    /// T0_max as printed, seconds, for I far below a and b. It is too long by at most the share I / min(a, b).
    ///
    /// # References
    /// Equation 16.
    pub fn max_mission_paper_s(&self) -> f64 {
        let p = &self.parameters;
        let image_m2 = p.across_m * p.along_m;
        let mean_m = image_m2.sqrt() + (p.across_m + p.along_m) / 2.0;
        let gain = p.relative_s * image_m2 / (4.0 * p.seconds_per_tile * p.unit_drift_m * mean_m);
        p.along_m / p.speed_mps * (1.0 + gain)
    }
}

#[cfg(test)]
mod tests;
