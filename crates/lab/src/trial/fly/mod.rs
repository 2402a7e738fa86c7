//! `fly`: a recorded flight replayed in a closed loop. The truth starts and scores the flight; navigation never sees it between.

mod disturbance;
mod outcome;
mod scale;
mod score;
mod table;
mod trial;

pub use disturbance::Disturbances;
pub use outcome::FlyOutcome;
pub use scale::{FlightScale, ScaleSource};
pub use score::{FlyScore, RunScore};
pub use table::write_positions;
pub use trial::FlyTrial;
