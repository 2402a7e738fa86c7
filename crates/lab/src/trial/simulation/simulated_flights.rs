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
    /// Its numbers.
    pub scenario: Scenario,
    /// Mission and n.
    pub plan: MissionPlan,
    /// What of the model's assumptions does not hold.
    pub departures: Vec<&'static str>,
    /// What the models say.
    pub prediction: Prediction,
    /// What they would say with what they leave out.
    pub adjusted: Option<Adjusted>,
    /// What each flight came to, in the order of their numbers.
    pub tallies: Vec<FlightTally>,
}
