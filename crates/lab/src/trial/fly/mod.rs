//! `fly`: a recorded flight replayed in a closed loop. The truth starts and scores the flight; navigation never sees it between.

mod disturbance;
mod outcome;
mod scale;
mod score;
mod sequence_fault;
mod sequences;
mod table;
mod tape;
mod trial;

pub use disturbance::Disturbances;
pub use outcome::FlyOutcome;
pub use scale::{FlightScale, ScaleSource};
pub use score::{FlyScore, RunScore, SourceScore, SourceScores};
pub use sequence_fault::SequenceFault;
pub use sequences::{FaultScore, SequenceTrial};
pub use table::write_positions;
pub use tape::Drawing;
pub use trial::FlyTrial;
