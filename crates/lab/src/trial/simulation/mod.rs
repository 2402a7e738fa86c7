//! `simulation`: flights of hours with stated errors, thousands of them, to hold what `coupling` predicts against what happens.
//!
//! No image is registered. A [`Scenario`] says what registrations cost and err; each flight runs on a virtual clock with its own
//! generator, so that the result does not depend on threads; [`Summary`] holds predicted against simulated, each within an exact band.
//! docs/simulation.md says what is assumed, what was found, and why it departs where it does.

mod adjusted;
mod band;
mod case;
mod comparison;
mod domain;
mod drift;
mod file;
mod flight;
mod ground;
mod prediction;
mod route;
mod scenario;
mod summary;
mod table;
mod tally;
mod track;

pub use adjusted::Adjusted;
pub use comparison::{Comparison, Family};
pub use file::{Variation, read_simulation};
pub use prediction::{Plan, Prediction};
pub use scenario::{
    AfterFailure, AircraftModel, CovarianceModel, DrawnDrift, ErrorModel, ExecutionModel, FailureLaw, FailureModel,
    Scenario, SequentialModel, StoreModel,
};
pub use summary::{CovarianceScore, Simulated, Summary, summarize};
pub use table::write_simulation;
pub use tally::{CHECKPOINTS, Tally, TrackTally};

use super::TrialError;
use case::Case;
use flight::Flight;
use ground::{Ground, StoredGround};
use overfly_core::coupling::Mode;
use overfly_flight::navigate::NavigateError;
use overfly_store::Reader;
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most flights of all cases together: a third of a gigabyte of tallies.
const MOST_FLIGHTS: u64 = 2_000_000;

/// What is to be flown.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// As the file has them.
    pub path: PathBuf,
    /// The first one is the base.
    pub variations: Vec<Variation>,
    /// Flights at a time.
    pub threads: usize,
}

/// All flights of a scenario in a mode.
#[derive(Debug, Clone)]
pub struct Flown {
    /// Name of the scenario.
    pub variation: String,
    /// The mode.
    pub mode: Mode,
    /// Its numbers.
    pub scenario: Scenario,
    /// Mission and n.
    pub plan: Plan,
    /// What of the model's assumptions does not hold.
    pub departures: Vec<&'static str>,
    /// What the models say.
    pub prediction: Prediction,
    /// What they would say with what they leave out.
    pub adjusted: Option<Adjusted>,
    /// What each flight came to, in the order of their numbers.
    pub tallies: Vec<Tally>,
}

impl Simulation {
    /// Flights in all.
    pub fn flights(&self) -> u64 {
        self.variations.iter().map(|v| u64::from(v.scenario.runs) * v.scenario.modes.len() as u64).sum()
    }

    /// Flies everything; `progress` is called after each flight.
    ///
    /// # Errors
    /// [`TrialError::NotASimulation`] with what is missing or too much; a store that cannot be read.
    pub fn run(&self, progress: impl Fn() + Sync) -> Result<Vec<Flown>, TrialError> {
        if self.flights() > MOST_FLIGHTS {
            return Err(
                self.refuse("base", format!("runs: {} flights in all, of at most {MOST_FLIGHTS}", self.flights()))
            );
        }
        let grounds = self.grounds()?;
        let mut cases = Vec::new();
        for (variation, ground) in self.variations.iter().zip(&grounds) {
            for &mode in &variation.scenario.modes {
                let case = Case::new(&variation.name, &variation.scenario, mode, ground, cases.len() as u64)
                    .map_err(|reason| self.refuse(&variation.name, reason))?;
                cases.push(case);
            }
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build().map_err(|_| {
            let expected = "a number of threads that this machine can start";
            TrialError::Option { name: "threads", value: self.threads as f64, expected }
        })?;
        pool.install(|| cases.iter().map(|case| flown(case, &progress)).collect())
    }

    /// What each variation flies over; a layer that several fly over is read once.
    fn grounds(&self) -> Result<Vec<Ground>, TrialError> {
        let mut loaded: HashMap<(&Path, Option<&str>), Arc<StoredGround>> = HashMap::new();
        let mut grounds = Vec::new();
        for variation in &self.variations {
            let Some(model) = &variation.scenario.store else {
                grounds.push(Ground::Endless);
                continue;
            };
            let Some(path) = &model.path else {
                let reason = "store.path: state it, or name the store with --db";
                return Err(self.refuse(&variation.name, reason.into()));
            };
            let key = (path.as_path(), model.layer.as_deref());
            let ground = match loaded.get(&key) {
                Some(ground) => ground.clone(),
                None => Arc::new(StoredGround::load(&Reader::open(path)?, model.layer.as_deref())?),
            };
            loaded.insert(key, ground.clone());
            grounds.push(Ground::Stored(ground));
        }
        Ok(grounds)
    }

    fn refuse(&self, variation: &str, reason: String) -> TrialError {
        let reason = if variation == "base" { reason } else { format!("variation {variation}: {reason}") };
        TrialError::NotASimulation { path: self.path.clone(), reason }
    }
}

fn flown(case: &Case, progress: &(impl Fn() + Sync)) -> Result<Flown, TrialError> {
    let tallies: Result<Vec<Tally>, TrialError> = (0..case.scenario.runs)
        .into_par_iter()
        .map(|run| {
            let tally = Flight::fly(case, run).map_err(|cause| TrialError::Navigate {
                image: format!("{}, {}, flight {run}", case.name, case.mode.word()),
                cause: NavigateError::Filter(cause),
            });
            progress();
            tally
        })
        .collect();
    Ok(Flown {
        variation: case.name.to_owned(),
        mode: case.mode,
        scenario: case.scenario.clone(),
        plan: case.plan,
        departures: case.departures(),
        prediction: case.prediction.clone(),
        adjusted: case.adjusted,
        tallies: tallies?,
    })
}
