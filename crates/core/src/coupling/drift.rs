//! Drift of relative registrations: its growth between two absolute registrations, and its decrease with the number of
//! matches.

use super::error::{not_negative, positive};
use super::{CouplingError, displacement_sigma_m};
use serde::{Deserialize, Serialize};

/// Growth of the drift of n relative registrations with n.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DriftGrowth {
    /// n times the drift of one registration, as in the paper: a bias that every registration repeats, or the worst case of
    /// bounded errors.
    #[default]
    Linear,
    /// sqrt(n) times the drift of one registration: independent errors. `unit_drift_m` is then a bound at a chosen confidence
    /// (two or three standard deviations of one registration), and so is the result.
    SquareRoot,
}

impl DriftGrowth {
    /// The factor on `unit_drift_m` after `relative_count` registrations, a number of at least 0 that need not be whole.
    pub fn factor(self, relative_count: f64) -> f64 {
        match self {
            Self::Linear => relative_count,
            Self::SquareRoot => relative_count.sqrt(),
        }
    }

    /// D_T, metres, one-sided, after `relative_count` relative registrations of `unit_drift_m` each.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] where an argument is negative or not a number.
    ///
    /// # Example
    /// ```
    /// use overfly_core::coupling::DriftGrowth;
    /// assert_eq!(DriftGrowth::Linear.drift_m(25.0, 0.4), Ok(10.0));
    /// assert_eq!(DriftGrowth::SquareRoot.drift_m(25.0, 0.4), Ok(2.0));
    /// ```
    ///
    /// # References
    /// Equation 2 is `Linear`.
    pub fn drift_m(self, relative_count: f64, unit_drift_m: f64) -> Result<f64, CouplingError> {
        Ok(self.factor(not_negative("relative_count", relative_count)?) * not_negative("unit_drift_m", unit_drift_m)?)
    }
}

/// Number of matched descriptors at which the paper states a drift: [`PAPER_DRIFT_M`].
///
/// # References
/// Section V.D after figure 15: "to have less than 1 m unitary drift, it is necessary to have more than 600".
pub const PAPER_DRIFT_MATCHES: f64 = 600.0;
/// Drift of one relative registration at [`PAPER_DRIFT_MATCHES`] matched descriptors, metres.
pub const PAPER_DRIFT_M: f64 = 1.0;

/// The drift of one relative registration as a function of its matched descriptors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriftLaw {
    /// Drift of a registration by a single pair, metres: the part that averages out.
    pub pair_drift_m: f64,
    /// Drift that no number of pairs averages out, metres: pixel grids never coincide (section III.B: up to half a pixel), and
    /// the calibration errs. The paper's law has no such part.
    pub floor_m: f64,
}

impl DriftLaw {
    /// Makes the law of section III through the paper's one figure: 1 m at 600 matches, so sqrt(600) = 24.5 m for one match.
    /// The "hundred metres" that the paper mentions for poor ground lie above this law, because some of the few matches
    /// there are wrong.
    pub fn from_paper() -> Self {
        Self { pair_drift_m: PAPER_DRIFT_M * PAPER_DRIFT_MATCHES.sqrt(), floor_m: 0.0 }
    }

    /// D_U, metres: sqrt(floor^2 + pair^2 / n).
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] for fewer than one match, or a law with a negative part.
    ///
    /// # Example
    /// ```
    /// let unit_drift_m = overfly_core::coupling::DriftLaw::from_paper().unit_drift_m(600.0).unwrap();
    /// assert!((unit_drift_m - 1.0).abs() < 1e-12);
    /// ```
    ///
    /// # References
    /// Section III.A (proportional to 1 / sqrt(n)), figure 15.
    pub fn unit_drift_m(&self, matched_count: f64) -> Result<f64, CouplingError> {
        let floor_m = not_negative("floor_m", self.floor_m)?;
        Ok(displacement_sigma_m(self.pair_drift_m, matched_count)?.hypot(floor_m))
    }

    /// The number of matches, at least 1, at which the drift is `unit_drift_m`; infinite at or below the floor.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    pub fn matches_for(&self, unit_drift_m: f64) -> Result<f64, CouplingError> {
        positive("unit_drift_m", unit_drift_m)?;
        let (pair_m, floor_m) =
            (not_negative("pair_drift_m", self.pair_drift_m)?, not_negative("floor_m", self.floor_m)?);
        let square = (unit_drift_m - floor_m) * (unit_drift_m + floor_m);
        if square <= 0.0 {
            return Ok(f64::INFINITY);
        }
        Ok((pair_m * pair_m / square).max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_repeated_bias_adds_up_by_n_and_independent_errors_by_its_root() {
        let (n, walks) = (64usize, 4000);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (mut bias, mut square) = (0.0f64, 0.0);
        for _ in 0..walks {
            let walk: f64 = (0..n).map(|_| if rng.random_bool(0.5) { 1.0 } else { -1.0 }).sum();
            square += walk * walk / walks as f64;
            bias = bias.max((0..n).map(|_| 1.0).sum());
        }
        assert_eq!(DriftGrowth::Linear.drift_m(n as f64, 1.0), Ok(bias));
        let stated = DriftGrowth::SquareRoot.drift_m(n as f64, 1.0).unwrap();
        // 4000 walks know their standard deviation to 1.1 %; four of these.
        assert!((square.sqrt() / stated - 1.0).abs() < 0.045, "{} against {stated}", square.sqrt());
    }

    proptest! {
        #[test]
        fn the_drift_law_and_its_inverse_agree(pair in 0.1..100.0f64, floor in 0.0..2.0f64, n in 1.0..1e5f64) {
            let law = DriftLaw { pair_drift_m: pair, floor_m: floor };
            let drift = law.unit_drift_m(n).unwrap();
            prop_assume!(drift > floor * 1.0001);
            prop_assert!((law.matches_for(drift).unwrap() / n - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn no_number_of_matches_goes_below_the_floor() {
        let law = DriftLaw { pair_drift_m: 24.0, floor_m: 0.6 };
        assert_eq!(law.matches_for(0.6), Ok(f64::INFINITY));
        assert!(law.unit_drift_m(1e9).unwrap() > 0.6);
        assert!(law.unit_drift_m(0.0).is_err() && law.matches_for(f64::NAN).is_err());
        assert!(DriftLaw { floor_m: -1.0, ..law }.unit_drift_m(10.0).is_err());
    }

    #[test]
    fn the_papers_hundred_metres_lie_above_its_own_law() {
        let most_m = DriftLaw::from_paper().unit_drift_m(1.0).unwrap();
        assert!((most_m - 600f64.sqrt()).abs() < 1e-12 && most_m < 100.0);
    }
}
