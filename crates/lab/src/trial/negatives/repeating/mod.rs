//! Ground that repeats itself on the map and in the frame together.
//!
//! A world is a part of the given map with patterns drawn into it, as a store of its own. The frames of the flight get the same
//! patterns by their true projection, with the noise, the brightness and some defects of another epoch.

mod look;
mod pattern;
mod pattern_kind;
mod real_map;
mod repeated_frame;
mod scene;
mod scene_plan;
mod trials;
mod world;

pub use pattern::RepeatingPattern;
pub use pattern_kind::PatternKind;
pub use trials::{RepeatingTrials, TRIALS_PER_WORLD, WorldTrial};
