//! `IntegrityScore`: protection levels held against true errors.

use super::quantiles::Quantiles;
use super::rate_bound::upper95;
use serde::Serialize;

/// An error and the protection level that was stated for it, metres; `None` where none was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProtectedError {
    /// The true error, metres.
    pub error_m: f64,
    /// The stated protection level, metres.
    pub protection_level_m: Option<f64>,
}

impl ProtectedError {
    /// Whether the error exceeds the stated level: misleading information.
    pub fn is_misleading(&self) -> bool {
        self.protection_level_m.is_some_and(|level_m| self.error_m > level_m)
    }
}

/// The protection levels of a set of positions against the truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IntegrityScore {
    /// The risk that the levels are stated for.
    pub integrity_risk: f64,
    /// The largest level with which a position is of use, metres, if stated.
    pub alert_limit_m: Option<f64>,
    /// Positions with a protection level.
    #[serde(rename = "protected")]
    pub protected_count: usize,
    /// Those of them whose error exceeds it: misleading information.
    pub misleading: usize,
    /// Exact one-sided 95 % bound on the share of misleading ones (Clopper and Pearson).
    pub misleading_upper95: f64,
    /// Share of all positions that have a protection level, of at most the alert limit.
    pub availability: Option<f64>,
    /// The stated levels, metres.
    pub protection_level_m: Option<Quantiles>,
}

impl IntegrityScore {
    /// Scores positions.
    pub fn from_errors(errors: &[ProtectedError], integrity_risk: f64, alert_limit_m: Option<f64>) -> Self {
        let levels: Vec<f64> = errors.iter().filter_map(|error| error.protection_level_m).collect();
        let misleading = errors.iter().filter(|error| error.is_misleading()).count();
        let limit_m = alert_limit_m.unwrap_or(f64::INFINITY);
        let available = levels.iter().filter(|level_m| **level_m <= limit_m).count();
        Self {
            integrity_risk,
            alert_limit_m,
            protected_count: levels.len(),
            misleading,
            misleading_upper95: upper95(misleading, levels.len()),
            availability: (!errors.is_empty()).then(|| available as f64 / errors.len() as f64),
            protection_level_m: Quantiles::from_values(levels),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_what_exceeds_its_level_and_what_has_none() {
        let error = |error_m, protection_level_m| ProtectedError { error_m, protection_level_m };
        let errors = [error(3.0, Some(10.0)), error(12.0, Some(10.0)), error(500.0, None), error(1.0, Some(80.0))];
        let score = IntegrityScore::from_errors(&errors, 1e-3, None);
        assert_eq!((score.protected_count, score.misleading, score.availability), (3, 1, Some(0.75)));
        let limited = IntegrityScore::from_errors(&errors, 1e-3, Some(50.0));
        assert_eq!((limited.misleading, limited.availability), (1, Some(0.5)));
        let none = IntegrityScore::from_errors(&[], 1e-3, None);
        assert_eq!((none.misleading_upper95, none.availability), (1.0, None));
    }
}
