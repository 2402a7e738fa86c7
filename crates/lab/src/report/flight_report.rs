//! `FlightReport`: what the page of located frames is made from.

use super::mosaic::Mosaic;
use crate::trial::{FixOutcome, FixScore, RecordedFlight};
use overfly_core::pixels::Colour;
use overfly_flight::locate::{Answer, Fix};

/// The content of the page. `to_html` writes the page.
pub struct FlightReport<'a> {
    /// Heading of the page.
    pub title: &'a str,
    /// A sentence or two below it.
    pub introduction: &'a str,
    /// The flight, as read.
    pub flight: &'a RecordedFlight,
    /// The result of each of its frames, in the same order.
    pub outcomes: &'a [FixOutcome],
    /// Their score.
    pub score: &'a FixScore,
    /// Half the width of the square that was searched around each prior, metres.
    pub prior_error_m: f64,
    /// The map.
    pub mosaic: &'a Mosaic,
    /// Frames to show beside the map: index into `outcomes`, and the frame in colour.
    pub shown: &'a [(usize, Colour)],
    /// Names and values of facts about the store and the machine.
    pub facts: &'a [(String, String)],
}

/// The fix of an outcome, if it has one.
pub fn fix_of(outcome: &FixOutcome) -> Option<&Fix> {
    match &outcome.answer {
        Answer::Fix(fix) => Some(fix),
        Answer::NoFix(_) => None,
    }
}
