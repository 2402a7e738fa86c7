//! `evaluate negatives`: searches in which every fix is false, or every fix but one at the frame's true place.
//!
//! A trial takes a frame of a flight and spoils the frame or the region in one of the ways of [`NegativeKind`], or draws a pattern
//! into the frame and the map. The answers show how often the search accepts a false fix, and whether the stated number of false
//! alarms is true.

mod altered;
mod cell_hash;
mod drawn;
mod kind;
mod outcome;
mod probability;
mod repeating;
mod runner;
mod score;
mod search;
mod table;
mod trial;

pub use kind::NegativeKind;
pub use outcome::{DrawnPattern, NegativeOutcome, NegativeSearch, TruePlace};
pub use probability::ProbabilityBin;
pub use repeating::{PatternKind, RepeatingPattern};
pub use score::{CalibrationStep, KindScore, NegativeScore, PatternScore, RegionScore};
pub use table::write_negatives;
pub use trial::NegativeTrial;
