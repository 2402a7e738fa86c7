//! `SequenceTrial`: a flight with each kind of fault, at many places.

use super::disturbance::Disturbances;
use super::outcome::FlyOutcome;
use super::score::SourceScores;
use super::sequence_fault::SequenceFault;
use super::trial::FlyTrial;
use crate::trial::error::TrialError;
use crate::trial::motions::thread_pool;
use crate::trial::recorded_flight::RecordedFlight;
use overfly_flight::navigate::NavigateOptions;
use overfly_store::Reader;
use rayon::prelude::*;
use serde::Serialize;

/// The faults to try on a flight.
#[derive(Debug, Clone)]
pub struct SequenceTrial<'a> {
    /// The store in which frames are searched.
    pub store: &'a Reader,
    /// The recorded flight.
    pub flight: &'a RecordedFlight,
    /// The kinds of faults.
    pub faults: Vec<SequenceFault>,
    /// Flights of each kind; their seeds count from `first_seed`.
    pub seeds: u64,
    /// The first seed.
    pub first_seed: u64,
}

/// The score of one kind of fault, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaultScore {
    /// The kind.
    pub fault: &'static str,
    /// Flights.
    pub flights: u64,
    /// Positions by what they call themselves, and how many are outside their own 99.9 % ellipse.
    pub sources: SourceScores,
    /// Greatest error of a position that does not call itself lost, metres.
    pub max_error_m: f64,
    /// Flights that end within `right_m` of the truth and do not call themselves lost.
    pub recovered: u64,
    /// The positions outside that do not call themselves lost, as "seed 3: frames/012.jpg absolute, 31 m off".
    pub outside: Vec<String>,
}

impl SequenceTrial<'_> {
    /// Flies every kind of fault with every seed. `right_m`: the greatest error of a flight that has recovered;
    /// `threads`: flights at the same time.
    ///
    /// # Errors
    /// If the flight has no truth or the store cannot be read.
    pub fn run(
        &self,
        options: &NavigateOptions,
        right_m: f64,
        threads: usize,
        progress: impl Fn() + Sync,
    ) -> Result<Vec<FaultScore>, TrialError> {
        let pool = thread_pool(threads)?;
        let one = |fault: SequenceFault| {
            let flights = (0..self.seeds).into_par_iter().map(|i| {
                let seed = self.first_seed + i;
                let disturbances = Disturbances { fault: Some(fault), seed, ..Disturbances::default() };
                let trial = FlyTrial { store: self.store, flight: self.flight, disturbances };
                let outcomes = trial.run(options, |_| {});
                progress();
                outcomes.map(|outcomes| (seed, outcomes))
            });
            Ok(FaultScore::from_flights(fault, &flights.collect::<Result<Vec<_>, _>>()?, right_m))
        };
        pool.install(|| self.faults.iter().map(|fault| one(*fault)).collect())
    }
}

impl FaultScore {
    fn from_flights(fault: SequenceFault, flights: &[(u64, Vec<FlyOutcome>)], right_m: f64) -> Self {
        let is_lost = |o: &FlyOutcome| SourceScores::count([o]).lost.positions > 0;
        let known = || flights.iter().flat_map(|(seed, outcomes)| outcomes.iter().map(move |o| (seed, o)));
        let known = || known().filter(|(_, o)| !is_lost(o));
        let is_outside = |o: &FlyOutcome| {
            let scores = SourceScores::count([o]);
            scores.absolute.outside + scores.propagated.outside > 0
        };
        let named = |(seed, o): (&u64, &FlyOutcome)| {
            format!("seed {seed}: {} {}, {:.0} m off", o.image, o.position.source.word(), o.error.length_m())
        };
        let has_recovered =
            |outcomes: &[FlyOutcome]| outcomes.last().is_some_and(|o| !is_lost(o) && o.error.length_m() <= right_m);
        Self {
            fault: fault.word(),
            flights: flights.len() as u64,
            sources: SourceScores::count(flights.iter().flat_map(|(_, outcomes)| outcomes)),
            max_error_m: known().map(|(_, o)| o.error.length_m()).fold(0.0, f64::max),
            recovered: flights.iter().filter(|(_, outcomes)| has_recovered(outcomes)).count() as u64,
            outside: known().filter(|(_, o)| is_outside(o)).map(named).collect(),
        }
    }
}
