//! Disturbed frames: real frames of a flight, altered as cameras, lenses, links and weather alter them, with exact truth.
//!
//! `evaluate fixes --disturb` locates them. A new kind needs a word in [`DisturbanceKind`] and an arm in `disturbed_frame` (what is
//! stated of the camera, its geometry) or in `pixel_disturbance` (the pixels).

mod disturbed_frame;
mod kind;
mod pixel_disturbance;
mod score;
mod table;
mod trial;
mod virtual_camera;

pub use disturbed_frame::{DisturbedFrame, SourceFrame};
pub use kind::DisturbanceKind;
pub use score::{DisturbanceScore, DisturbedKindScore};
pub use table::write_disturbed;
pub use trial::{DisturbedErrors, DisturbedOutcome, DisturbedTrial};
