//! `NegativeOutcome`: one trial and its result.

use super::kind::NegativeKind;
use overfly_core::geodesy::Geodetic;
use overfly_flight::locate::Answer;

/// One trial and its result.
#[derive(Debug, Clone)]
pub struct NegativeOutcome {
    /// Number of the trial, from 0.
    pub number: usize,
    /// The reason why any fix is false.
    pub kind: NegativeKind,
    /// Requested area of the region, in usual squares.
    pub region: f64,
    /// Name of the frame in `flight.csv`.
    pub image: String,
    /// Whether the heading was known to the search.
    pub is_heading_known: bool,
    /// The search; `None` if the layer has no room for such a region away from the frame.
    pub search: Option<NegativeSearch>,
}

/// A search and its answer.
#[derive(Debug, Clone)]
pub struct NegativeSearch {
    /// Centre of the searched square.
    pub prior: Geodetic,
    /// Area of the imagery within the square, in usual squares.
    pub searched_ratio: f64,
    /// The answer.
    pub answer: Answer,
    /// Duration from the frame in memory to the answer, milliseconds.
    pub elapsed_ms: f64,
}

impl NegativeOutcome {
    /// Whether the search accepted a false fix.
    pub fn is_accepted(&self) -> bool {
        self.search.as_ref().is_some_and(|s| matches!(s.answer, Answer::Fix(_)))
    }

    /// The log10 of the false alarms that the search stated; `None` if there was no search, or nothing agreed.
    pub fn log10_false_alarms(&self) -> Option<f64> {
        match &self.search.as_ref()?.answer {
            Answer::Fix(fix) => fix.log10_false_alarms,
            Answer::NoFix(no_fix) => no_fix.log10_false_alarms,
        }
    }
}
