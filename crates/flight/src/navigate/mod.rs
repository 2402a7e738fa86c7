//! A flight: relative and absolute registration run by a coupling mode, in a closed loop.
//!
//! [`Navigator`] takes image after image and answers with a position each. What it knows is an [`Estimate`]: relative
//! registrations move it, absolute ones correct it when their execution time is over, the last velocity carries it over images
//! that show nothing. Time is the images' own, and a [`Clock`]'s: a replay is the same on every machine.

mod anchor;
mod clock;
mod error;
mod estimate;
mod image;
mod moves;
mod navigator;
mod options;
mod position;
mod search;
mod velocity;

pub use clock::Clock;
pub use error::NavigateError;
pub use estimate::{Estimate, Sensed, SensorSigmas, Step};
pub use image::Image;
pub use moves::Move;
pub use navigator::Navigator;
pub use options::NavigateOptions;
pub use position::{Position, Source};
