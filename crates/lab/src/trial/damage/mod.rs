//! `evaluate damage`: what becomes of frames whose files were damaged.
//!
//! A trial takes a frame of a flight, writes it in one of the formats of [`FrameFormat`], changes the bytes in one of the ways of
//! [`FileChange`], and locates what can still be read. A refused frame and "no fix" are good answers; a false fix is not.

mod change;
mod format;
mod outcome;
mod runner;
mod score;
mod table;
mod trial;

pub use change::FileChange;
pub use format::FrameFormat;
pub use outcome::{DamageOutcome, DamageResult};
pub use score::{DamageScore, DamageScoreRow};
pub use table::write_damage;
pub use trial::DamageTrial;
