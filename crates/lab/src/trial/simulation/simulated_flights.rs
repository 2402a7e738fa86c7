//! `SimulatedFlights`: all flights of a scenario in one mode.

use super::adjusted::Adjusted;
use super::flight_tally::FlightTally;
use super::prediction::{MissionPlan, Prediction};
use super::scenario::Scenario;
use overfly_core::coupling::Mode;

/// All flights of a scenario in a mode.
#[derive(Debug, Clone)]
pub struct SimulatedFlights {
    /// Name of the scenario.
    pub variation: String,
    /// The mode.
    pub mode: Mode,
    /// The parameters.
    pub scenario: Scenario,
    /// Mission time and n.
    pub plan: MissionPlan,
    /// The assumptions of the model that do not hold.
    pub departures: Vec<&'static str>,
    /// The predictions of the models.
    pub prediction: Prediction,
    /// The predictions with what the models leave out.
    pub adjusted: Option<Adjusted>,
    /// The counts of each flight, in the order of flight numbers.
    pub tallies: Vec<FlightTally>,
}
