//! `NegativeOutcome`: one trial and its result.

use super::kind::NegativeKind;
use super::repeating::PatternKind;
use overfly_core::geodesy::{CHI_SQUARE_9999, Geodetic, LocalFrame};
use overfly_flight::locate::{Answer, WeighedPlace};

/// One trial and its result.
#[derive(Debug, Clone)]
pub struct NegativeOutcome {
    /// Number of the trial, from 0.
    pub number: usize,
    /// The reason why a fix is false.
    pub kind: NegativeKind,
    /// Requested area of the region, in usual squares.
    pub region: f64,
    /// Name of the frame in `flight.csv`.
    pub image: String,
    /// Whether the heading was known to the search.
    pub is_heading_known: bool,
    /// The place where a fix is right; `None` if every fix is false.
    pub place: Option<TruePlace>,
    /// The pattern that map and frame repeat.
    pub pattern: Option<DrawnPattern>,
    /// The search; `None` if the layer has no room for such a region away from the frame.
    pub search: Option<NegativeSearch>,
}

/// Where a frame was taken, and how near a fix must be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruePlace {
    /// The true nadir.
    pub truth: Geodetic,
    /// Greatest error of a right fix, metres.
    pub right_m: f64,
}

/// The pattern that map and frame repeat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnPattern {
    /// What repeats.
    pub kind: PatternKind,
    /// The shorter period, metres.
    pub period_m: f64,
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
    /// The best place that the search found, accepted or not.
    pub best: Option<WeighedPlace>,
    /// Duration from the frame in memory to the answer, milliseconds.
    pub elapsed_ms: f64,
}

impl NegativeOutcome {
    /// Whether the search accepted a false fix.
    pub fn is_accepted(&self) -> bool {
        self.is_fix() && !self.is_right()
    }

    /// Whether the accepted false fix does not say so: the true place lies outside its own 99.99 % ellipse. Where there is no true place,
    /// none says so.
    pub fn is_outside(&self) -> bool {
        self.is_accepted() && !self.squared_mahalanobis().is_some_and(|square| square <= CHI_SQUARE_9999)
    }

    /// The squared Mahalanobis distance of the true place from the fix; `None` without a fix or a place.
    pub fn squared_mahalanobis(&self) -> Option<f64> {
        let Answer::Fix(fix) = &self.search.as_ref()?.answer else { return None };
        let error = LocalFrame::at(self.place?.truth).enu_from_geodetic(fix.position);
        Some(fix.covariance.squared_mahalanobis(error))
    }

    /// Whether the search found the frame's true place.
    pub fn is_right(&self) -> bool {
        self.error_m().zip(self.place).is_some_and(|(error_m, place)| error_m <= place.right_m)
    }

    /// Distance of the fix from the true place, metres; `None` without a fix or a place.
    pub fn error_m(&self) -> Option<f64> {
        let Answer::Fix(fix) = &self.search.as_ref()?.answer else { return None };
        Some(LocalFrame::at(self.place?.truth).enu_from_geodetic(fix.position).length_m())
    }

    /// Distance of the best place, accepted or not, from the true one, metres; `None` where either is missing.
    pub fn best_error_m(&self) -> Option<f64> {
        let best = self.search.as_ref()?.best.as_ref()?;
        Some(LocalFrame::at(self.place?.truth).enu_from_geodetic(best.nadir).length_m())
    }

    fn is_fix(&self) -> bool {
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
