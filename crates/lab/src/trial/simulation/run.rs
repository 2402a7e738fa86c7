//! `Simulation`: runs all flights of a file's scenarios.

use super::case::ScenarioCase;
use super::file::Variation;
use super::flight_tally::FlightTally;
use super::map::{SimulatedMap, StoredMap};
use super::simulated_flight::SimulatedFlight;
use super::simulated_flights::SimulatedFlights;
use crate::trial::error::TrialError;
use overfly_flight::navigate::NavigateError;
use overfly_store::Reader;
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most flights of all cases together: their tallies take a third of a gigabyte.
const MOST_FLIGHTS: u64 = 2_000_000;

/// The scenarios to fly.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// The file of the scenarios.
    pub path: PathBuf,
    /// The scenarios; the first one is the base.
    pub variations: Vec<Variation>,
    /// Flights at the same time.
    pub threads: usize,
}

impl Simulation {
    /// Number of all flights.
    pub fn flights(&self) -> u64 {
        self.variations.iter().map(|v| u64::from(v.scenario.runs) * v.scenario.modes.len() as u64).sum()
    }

    /// Runs all flights; calls `progress` after each.
    ///
    /// # Errors
    /// [`TrialError::NotASimulation`] with what is missing or too much; if a store cannot be read.
    pub fn run(&self, progress: impl Fn() + Sync) -> Result<Vec<SimulatedFlights>, TrialError> {
        if self.flights() > MOST_FLIGHTS {
            return Err(
                self.refuse("base", format!("runs: {} flights in all, of at most {MOST_FLIGHTS}", self.flights()))
            );
        }
        let maps = self.maps()?;
        let mut cases = Vec::new();
        for (variation, map) in self.variations.iter().zip(&maps) {
            for &mode in &variation.scenario.modes {
                let case = ScenarioCase::new(&variation.name, &variation.scenario, mode, map, cases.len() as u64)
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

    /// The map of each variation. A layer of several variations is read once.
    fn maps(&self) -> Result<Vec<SimulatedMap>, TrialError> {
        let mut loaded: HashMap<(&Path, Option<&str>), Arc<StoredMap>> = HashMap::new();
        let mut maps = Vec::new();
        for variation in &self.variations {
            let Some(model) = &variation.scenario.store else {
                maps.push(SimulatedMap::Endless);
                continue;
            };
            let Some(path) = &model.path else {
                let scenario = variation.name.clone();
                return Err(TrialError::NoStorePath { path: self.path.clone(), scenario });
            };
            let key = (path.as_path(), model.layer.as_deref());
            let map = match loaded.get(&key) {
                Some(map) => map.clone(),
                None => Arc::new(StoredMap::load(&Reader::open(path)?, model.layer.as_deref())?),
            };
            loaded.insert(key, map.clone());
            maps.push(SimulatedMap::Stored(map));
        }
        Ok(maps)
    }

    fn refuse(&self, variation: &str, reason: String) -> TrialError {
        let reason = if variation == "base" { reason } else { format!("variation {variation}: {reason}") };
        TrialError::NotASimulation { path: self.path.clone(), reason }
    }
}

fn flown(case: &ScenarioCase, progress: &(impl Fn() + Sync)) -> Result<SimulatedFlights, TrialError> {
    let tallies: Result<Vec<FlightTally>, TrialError> = (0..case.scenario.runs)
        .into_par_iter()
        .map(|run| {
            let tally = SimulatedFlight::fly(case, run).map_err(|cause| TrialError::Navigate {
                image: format!("{}, {}, flight {run}", case.name, case.mode.word()),
                cause: NavigateError::Filter(cause),
            });
            progress();
            tally
        })
        .collect();
    Ok(SimulatedFlights {
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
