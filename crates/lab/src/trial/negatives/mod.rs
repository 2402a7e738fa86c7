//! `evaluate negatives`: searches in which every fix is false.
//!
//! A trial takes a frame of a flight and spoils the frame or the region in one of the ways of [`NegativeKind`]. The answers show how
//! often the search accepts a false fix, and whether the stated number of false alarms is true.

mod altered;
mod bound;
mod drawn;
mod kind;
mod outcome;
mod runner;
mod score;
mod table;
mod trial;

pub use kind::NegativeKind;
pub use outcome::{NegativeOutcome, NegativeSearch};
pub use score::{CalibrationStep, KindScore, NegativeScore, RegionScore};
pub use table::write_negatives;
pub use trial::NegativeTrial;
