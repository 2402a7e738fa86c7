//! `simulation`: thousands of flights of hours with stated errors, to compare the predictions of `coupling` with what happens.
//!
//! No image is registered. A [`Scenario`] states the cost and the errors of registrations. Each flight runs on a virtual clock with a
//! random generator of its own, so the result does not depend on threads. [`SimulationSummary`] compares each predicted figure with the
//! simulated one inside an exact band. docs/simulation.md states the assumptions, the results, and the departures from the paper.

mod adjusted;
mod case;
mod comparison;
mod domain;
mod drift;
mod file;
mod flight_tally;
mod map;
mod prediction;
mod route;
mod run;
mod scenario;
mod search;
mod simulated_flight;
mod simulated_flights;
mod summary;
mod table;
mod track;

pub use adjusted::Adjusted;
pub use comparison::{BandComparison, Family};
pub use file::{Variation, read_simulation};
pub use flight_tally::{CHECKPOINTS, FlightTally, TrackTally};
pub use prediction::{MissionPlan, Prediction};
pub use run::Simulation;
pub use scenario::{
    AfterFailure, AircraftModel, CovarianceModel, DrawnDrift, ErrorModel, ExecutionModel, FailureLaw, FailureModel,
    Scenario, SequentialModel, StoreModel,
};
pub use simulated_flights::SimulatedFlights;
pub use summary::{CovarianceScore, Simulated, SimulationSummary, summarize};
pub use table::write_simulation;
