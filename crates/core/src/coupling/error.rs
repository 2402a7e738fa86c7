//! `CouplingError`: why a model has no result, and the checks of its parameters.

/// A condition of the models that does not hold, with its values.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CouplingError {
    /// A number is outside the models' domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// The field or argument.
        name: &'static str,
        /// The given value.
        value: f64,
        /// The accepted values.
        expected: &'static str,
    },
    /// An absolute registration takes longer than the flight over one image even without drift (equation 7).
    #[error("at {speed_mps} m/s every absolute registration comes too late; this mode ends at {max_speed_mps:.3} m/s")]
    SpeedAboveMax {
        /// v, metres per second.
        speed_mps: f64,
        /// v_max, metres per second.
        max_speed_mps: f64,
    },
    /// After this many relative registrations an absolute one takes longer than the flight over one image (equation 8).
    #[error(
        "after {relative_count} relative registrations the absolute one comes too late; at most {max_relative_count:.3}"
    )]
    CountAboveMax {
        /// n.
        relative_count: f64,
        /// n_max.
        max_relative_count: f64,
    },
    /// Every search takes longer than the one before (conditions 1 and 2 of the parallel mode, condition 1 of the combined
    /// mode).
    #[error("no execution time reproduces itself: every search takes longer than the one before it")]
    NoFixedPoint,
    /// The time since the last fix is too long (condition 3 of the parallel mode, condition 2 of the combined mode).
    #[error("started from {start_s} s the searches take longer and longer; they settle from below {limit_s:.6} s only")]
    StartsTooLate {
        /// t_exe(1), seconds.
        start_s: f64,
        /// The unstable fixed point: t2, s1.
        limit_s: f64,
    },
    /// The flight turns by more than the quarter of a turn up to which the shape of the area is known (in place of
    /// condition 24).
    #[error("{path_m} m of flight at a radius of {min_turn_radius_m} m is more than a quarter of a turn")]
    BeyondQuarterTurn {
        /// v t_exe, metres.
        path_m: f64,
        /// R_min, metres.
        min_turn_radius_m: f64,
    },
    /// A relative registration without any descriptor already takes too long (section III).
    #[error("a relative registration takes {least_s:.6} s before its first descriptor, and {limit_s:.6} s are left")]
    NoTime {
        /// Time of a registration without descriptors, seconds.
        least_s: f64,
        /// Available time, seconds.
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

/// The smallest and the largest length, time, speed or count of the models. The range covers every aircraft, and products of
/// a few such numbers do not overflow.
const LEAST: f64 = 1e-9;
const MOST: f64 = 1e9;

/// Returns `value` if it is a number from 1e-9 to 1e9.
pub(super) fn positive(name: &'static str, value: f64) -> Result<f64, CouplingError> {
    let holds = (LEAST..=MOST).contains(&value);
    if holds {
        Ok(value)
    } else {
        Err(CouplingError::OutOfDomain { name, value, expected: "a number from 1e-9 to 1e9" })
    }
}

/// Returns `value` if it is a number from 0 to 1e9.
pub(super) fn not_negative(name: &'static str, value: f64) -> Result<f64, CouplingError> {
    let holds = (0.0..=MOST).contains(&value);
    if holds { Ok(value) } else { Err(CouplingError::OutOfDomain { name, value, expected: "a number from 0 to 1e9" }) }
}

/// Returns `value` if it is a number from 1e-9 to 1e9, or infinity.
pub(super) fn positive_or_infinite(name: &'static str, value: f64) -> Result<f64, CouplingError> {
    let holds = value == f64::INFINITY || (LEAST..=MOST).contains(&value);
    let expected = "a number from 1e-9 to 1e9, or infinity";
    if holds { Ok(value) } else { Err(CouplingError::OutOfDomain { name, value, expected }) }
}

/// Returns `value` if it is above 0 and at most 1.
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
