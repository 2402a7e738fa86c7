//! Why a model of `coupling` has no answer.

/// A condition of the models that does not hold, with the numbers that break it.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CouplingError {
    /// A number is NaN, infinite where it must not be, or outside of what the model speaks of.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// The field or argument.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is accepted.
        expected: &'static str,
    },
    /// Equation 7: even without drift an absolute registration outlasts the flight over one image.
    #[error("at {speed_mps} m/s every absolute registration comes too late; this mode ends at {max_speed_mps:.3} m/s")]
    SpeedAboveMax {
        /// v.
        speed_mps: f64,
        /// v_max.
        max_speed_mps: f64,
    },
    /// Equation 8: after so many relative registrations the absolute one outlasts the flight over one image.
    #[error(
        "after {relative_count} relative registrations the absolute one comes too late; at most {max_relative_count:.3}"
    )]
    CountAboveMax {
        /// n.
        relative_count: f64,
        /// n_max.
        max_relative_count: f64,
    },
    /// Conditions 1 and 2 of the parallel mode, condition 1 of the combined one: every search takes longer than the one before.
    #[error("no execution time reproduces itself: every search takes longer than the one before it")]
    NoFixedPoint,
    /// Condition 3 of the parallel mode, condition 2 of the combined one: too long without a fix.
    #[error("started from {start_s} s the searches take longer and longer; they settle from below {limit_s:.6} s only")]
    StartsTooLate {
        /// t_exe(1).
        start_s: f64,
        /// The fixed point that repels: t2, s1.
        limit_s: f64,
    },
    /// Condition 24 and what stands in its place here: the area's shape is known up to a quarter of a turn.
    #[error("{path_m} m of flight at a radius of {min_turn_radius_m} m is more than a quarter of a turn")]
    BeyondQuarterTurn {
        /// v t_exe.
        path_m: f64,
        /// R_min.
        min_turn_radius_m: f64,
    },
    /// Section III: not even a registration of no descriptors ends in time.
    #[error("a relative registration takes {least_s:.6} s before its first descriptor, and {limit_s:.6} s are left")]
    NoTime {
        /// Time of a registration without descriptors.
        least_s: f64,
        /// Time there is.
        limit_s: f64,
    },
}

impl CouplingError {
    /// A stable word for programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::OutOfDomain { .. } => "out_of_domain",
            Self::SpeedAboveMax { .. } => "speed_above_max",
            Self::CountAboveMax { .. } => "relative_count_above_max",
            Self::NoFixedPoint => "no_fixed_point",
            Self::StartsTooLate { .. } => "starts_too_late",
            Self::BeyondQuarterTurn { .. } => "beyond_quarter_turn",
            Self::NoTime { .. } => "no_time",
        }
    }
}

/// Smallest and largest number that the models take for a length, time, speed or count where zero makes no sense.
/// Wide enough for anything that flies; products of a few stay far from what f64 can hold.
const LEAST: f64 = 1e-9;
const MOST: f64 = 1e9;

/// `value` if it is a number from 1e-9 to 1e9.
pub(super) fn positive(name: &'static str, value: f64) -> Result<f64, CouplingError> {
    let holds = (LEAST..=MOST).contains(&value);
    if holds {
        Ok(value)
    } else {
        Err(CouplingError::OutOfDomain { name, value, expected: "a number from 1e-9 to 1e9" })
    }
}

/// `value` if it is a number from 0 to 1e9.
pub(super) fn not_negative(name: &'static str, value: f64) -> Result<f64, CouplingError> {
    let holds = (0.0..=MOST).contains(&value);
    if holds { Ok(value) } else { Err(CouplingError::OutOfDomain { name, value, expected: "a number from 0 to 1e9" }) }
}

/// `value` if it is from 1e-9 up, infinity included.
pub(super) fn positive_or_infinite(name: &'static str, value: f64) -> Result<f64, CouplingError> {
    let holds = value == f64::INFINITY || (LEAST..=MOST).contains(&value);
    let expected = "a number from 1e-9 to 1e9, or infinity";
    if holds { Ok(value) } else { Err(CouplingError::OutOfDomain { name, value, expected }) }
}

/// `value` if it is above 0 and at most 1.
pub(super) fn probability(name: &'static str, value: f64) -> Result<f64, CouplingError> {
    let holds = value > 0.0 && value <= 1.0;
    if holds { Ok(value) } else { Err(CouplingError::OutOfDomain { name, value, expected: "above 0, at most 1" }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_and_infinity_are_outside_of_every_domain_but_one() {
        for check in [positive, not_negative, positive_or_infinite, probability] {
            assert_eq!(check("x", f64::NAN).unwrap_err().code(), "out_of_domain");
            assert!(check("x", f64::NEG_INFINITY).is_err() && check("x", -1e-12).is_err());
            assert_eq!(check("x", 1.0), Ok(1.0));
        }
        assert!(positive("x", f64::INFINITY).is_err() && not_negative("x", f64::INFINITY).is_err());
        assert_eq!(positive_or_infinite("x", f64::INFINITY), Ok(f64::INFINITY));
        assert_eq!(not_negative("x", 0.0), Ok(0.0));
        assert!(positive("x", 0.0).is_err() && probability("x", 0.0).is_err() && probability("x", 1.01).is_err());
    }

    #[test]
    fn says_which_number_and_what_is_accepted() {
        let text = positive("speed_mps", -3.0).unwrap_err().to_string();
        assert_eq!(text, "speed_mps = -3: a number from 1e-9 to 1e9");
    }
}
