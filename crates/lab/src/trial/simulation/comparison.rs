//! `BandComparison`: one predicted figure, the simulated one, and the band of the simulated one if the prediction is
//! true.

use crate::trial::bands::{count_band, nees_band};
use serde::Serialize;

/// The confidence of all comparisons of a command together.
pub const CONFIDENCE: f64 = 0.95;
/// Figures without random influence must agree to this share.
const EXACTLY: f64 = 1e-6;

/// One predicted figure and the simulated one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BandComparison {
    /// Name of the figure.
    pub what: &'static str,
    /// The predicted value.
    pub predicted: f64,
    /// The simulated value.
    pub simulated: f64,
    /// The band of the simulated value if the prediction is true. The comparisons of a command share its confidence.
    pub band: [f64; 2],
    /// Whether the simulated value lies in the band.
    pub inside: bool,
}

/// A predicted figure, and how it scatters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Claim {
    pub what: &'static str,
    pub predicted: f64,
    pub simulated: f64,
    pub kind: ClaimKind,
}

/// How a figure scatters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClaimKind {
    /// A count of at most `trials` independent events, divided by `per`.
    Count { trials: u64, per: f64 },
    /// The mean of `count` chi-square variables of two degrees of freedom.
    Nees { count: u64 },
    /// The figure does not scatter.
    Exact,
}

impl Claim {
    /// Compares the figure with its band at a confidence.
    pub fn judged(&self, confidence: f64) -> BandComparison {
        let band = match self.kind {
            ClaimKind::Count { trials, per } => {
                let rate = self.predicted * per / trials as f64;
                count_band(trials, rate, confidence).map(|count| count as f64 / per)
            }
            ClaimKind::Nees { count } => nees_band(count, confidence),
            ClaimKind::Exact => {
                let slack = EXACTLY * self.predicted.abs();
                [self.predicted - slack, self.predicted + slack]
            }
        };
        // NaN lies in no band, with the comparisons written like this.
        let inside = self.simulated >= band[0] && self.simulated <= band[1];
        BandComparison { what: self.what, predicted: self.predicted, simulated: self.simulated, band, inside }
    }
}

/// All comparisons of a command, the last line of its summary.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Family {
    /// Number of flights.
    pub flights: u64,
    /// Absolute registrations of all flights.
    pub absolute_count: u64,
    /// Number of comparisons.
    pub comparisons: usize,
    /// Comparisons inside their band.
    pub inside: usize,
    /// Least probability that all comparisons are inside, if every prediction is true.
    pub confidence: f64,
    /// Confidence of each band that gives this probability (Bonferroni).
    pub confidence_each: f64,
}

/// The confidence of each of a number of comparisons.
pub fn confidence_each(comparisons: usize) -> f64 {
    1.0 - (1.0 - CONFIDENCE) / comparisons.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_off_by_a_fifth_is_outside_and_no_number_too() {
        let claim = |predicted, simulated| Claim {
            what: "failures",
            predicted,
            simulated,
            kind: ClaimKind::Count { trials: 40_000, per: 1000.0 },
        };
        let judged = claim(2.0, 2.05).judged(0.95);
        assert!(judged.inside && (1.9..1.93).contains(&judged.band[0]), "{judged:?}");
        for predicted in [2.0 * 1.2, 2.0 * 0.8] {
            assert!(!claim(predicted, 2.05).judged(confidence_each(100)).inside);
        }
        assert!(!claim(2.0, f64::NAN).judged(0.95).inside);
        let exact = Claim { kind: ClaimKind::Exact, ..claim(3.0, 3.0 + 1e-9) };
        assert!(exact.judged(0.95).inside && !Claim { simulated: 3.1, ..exact }.judged(0.95).inside);
    }
}
