//! Missions as numbers of absolute registrations, each of which may fail.

use super::CouplingError;
use super::error::{not_negative, positive, probability};

/// N: the number of absolute registrations in a mission of `mission_s` seconds with one per cycle of `cycle_s`, not rounded.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # References
/// Equation 10.
pub fn absolute_count(mission_s: f64, cycle_s: f64) -> Result<f64, CouplingError> {
    Ok(not_negative("mission_s", mission_s)? / positive("cycle_s", cycle_s)?)
}

/// p N: the expected number of failures among N absolute registrations that fail with probability p.
///
/// The paper requires p N < 1 so that none fails. That only means that fewer than one failure is expected; see
/// [`chance_of_no_failure`].
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # References
/// The left-hand side of equations 1 and 15.
pub fn expected_failures(failure_probability: f64, absolute_count: f64) -> Result<f64, CouplingError> {
    Ok(probability("failure_probability", failure_probability)? * not_negative("absolute_count", absolute_count)?)
}

/// The longest mission with less than one expected failure, seconds: t_cycle / p. A mission of this length passes without a
/// failure with a probability of only 1/e = 37 % where p is small, and less where p is large.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # References
/// Equations 1 and 10, which give the step from (15) to (16).
pub fn mission_of_one_failure_s(failure_probability: f64, cycle_s: f64) -> Result<f64, CouplingError> {
    Ok(positive("cycle_s", cycle_s)? / probability("failure_probability", failure_probability)?)
}

/// The probability that none of N absolute registrations fails: (1 - p)^N for independent failures.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # Example
/// Among 1000 with p = 0.001 one failure is expected, and none happens with a probability of 36.8 %.
/// ```
/// let chance = overfly_core::coupling::chance_of_no_failure(0.001, 1000.0).unwrap();
/// assert!((chance - 0.36770).abs() < 1e-5);
/// ```
///
/// # References
/// The quantity that (1) is meant to bound.
pub fn chance_of_no_failure(failure_probability: f64, absolute_count: f64) -> Result<f64, CouplingError> {
    let p = probability("failure_probability", failure_probability)?;
    let count = not_negative("absolute_count", absolute_count)?;
    Ok(if count == 0.0 { 1.0 } else { (count * (-p).ln_1p()).exp() })
}

/// The longest mission with a probability of failure of at most `risk` (in (0, 1)), seconds:
/// t_cycle ln(1 - risk) / ln(1 - p).
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # References
/// [`chance_of_no_failure`] solved for T0. The paper's bound is [`mission_of_one_failure_s`].
pub fn mission_within_risk_s(failure_probability: f64, cycle_s: f64, risk: f64) -> Result<f64, CouplingError> {
    let p = probability("failure_probability", failure_probability)?;
    if !(risk > 0.0 && risk < 1.0) {
        return Err(CouplingError::OutOfDomain { name: "risk", value: risk, expected: "between 0 and 1" });
    }
    Ok(positive("cycle_s", cycle_s)? * (-risk).ln_1p() / (-p).ln_1p())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn one_expected_failure_leaves_a_chance_of_37_percent_of_none() {
        // Flown, not computed: 20,000 missions of 50 registrations, each failing with 1/50.
        let (p, count, missions) = (0.02, 50, 20_000);
        assert!((expected_failures(p, f64::from(count)).unwrap() - 1.0).abs() < 1e-12);
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let clean = (0..missions).filter(|_| (0..count).all(|_| !rng.random_bool(p))).count() as f64;
        let seen = clean / f64::from(missions);
        // Four standard deviations of that share: 4 sqrt(0.36 x 0.64 / 20,000).
        assert!((seen - chance_of_no_failure(p, f64::from(count)).unwrap()).abs() < 0.0136, "{seen}");
        assert!((chance_of_no_failure(1e-6, 1e6).unwrap() - (-1f64).exp()).abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn a_mission_within_a_risk_has_just_that_risk(p in 1e-6..0.9f64, cycle_s in 0.1..100.0f64, risk in 1e-3..0.99f64) {
            let mission_s = mission_within_risk_s(p, cycle_s, risk).unwrap();
            let none = chance_of_no_failure(p, absolute_count(mission_s, cycle_s).unwrap()).unwrap();
            prop_assert!((none - (1.0 - risk)).abs() < 1e-9);
        }

        #[test]
        fn the_papers_bound_runs_a_risk_of_at_least_63_percent(p in 1e-6..1.0f64, cycle_s in 0.1..100.0f64) {
            let mission_s = mission_of_one_failure_s(p, cycle_s).unwrap();
            let count = absolute_count(mission_s, cycle_s).unwrap();
            prop_assert!((expected_failures(p, count).unwrap() - 1.0).abs() < 1e-12);
            prop_assert!(chance_of_no_failure(p, count).unwrap() <= (-1f64).exp() + 1e-12);
            // A risk of 5 % allows ln(1 / 0.95) = 0.0513 of the paper's length, or less.
            prop_assert!(mission_within_risk_s(p, cycle_s, 0.05).unwrap() <= 0.0513 * mission_s);
        }
    }

    #[test]
    fn a_sure_failure_allows_no_mission_and_no_registration_cannot_fail() {
        assert_eq!(chance_of_no_failure(1.0, 0.0), Ok(1.0));
        assert_eq!(chance_of_no_failure(1.0, 1.0), Ok(0.0));
        assert_eq!(mission_within_risk_s(1.0, 3.0, 0.1), Ok(0.0));
        assert!(mission_within_risk_s(0.1, 3.0, 1.0).is_err() && expected_failures(f64::NAN, 1.0).is_err());
        assert!(absolute_count(10.0, 0.0).is_err() && mission_of_one_failure_s(0.0, 1.0).is_err());
    }
}
