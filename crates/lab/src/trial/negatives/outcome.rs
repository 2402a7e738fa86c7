//! `NegativeOutcome`: one trial and its result.

use super::kind::NegativeKind;
use overfly_core::geodesy::Geodetic;
use overfly_flight::locate::Answer;

/// One trial and what came of it.
#[derive(Debug, Clone)]
pub struct NegativeOutcome {
    /// Counted from 0.
    pub number: usize,
    /// Why a fix is false.
    pub kind: NegativeKind,
    /// Area searched, in usual squares, as asked for.
    pub region: f64,
    /// The frame, as `flight.csv` names it.
    pub image: String,
    /// Whether the heading was stated.
    pub is_heading_known: bool,
    /// The search; `None` where the layer has no room for such a region away from the frame.
    pub search: Option<NegativeSearch>,
}

/// A search that was made.
#[derive(Debug, Clone)]
pub struct NegativeSearch {
    /// The middle of the square.
    pub prior: Geodetic,
    /// Area of the imagery within the square, in usual squares.
    pub searched_ratio: f64,
    /// What came of it.
    pub answer: Answer,
    /// From the frame in memory to the answer, milliseconds.
    pub elapsed_ms: f64,
}

impl NegativeOutcome {
    /// Whether the search was falsely sure.
    pub fn is_accepted(&self) -> bool {
        self.search.as_ref().is_some_and(|s| matches!(s.answer, Answer::Fix(_)))
    }

    /// What the search itself expected of such an accident; `None` where it was not made, or found nothing that agrees.
    pub fn log10_false_alarms(&self) -> Option<f64> {
        match &self.search.as_ref()?.answer {
            Answer::Fix(fix) => fix.log10_false_alarms,
            Answer::NoFix(no_fix) => no_fix.log10_false_alarms,
        }
    }
}
