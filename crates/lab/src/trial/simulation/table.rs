//! `simulation.csv`: a row per flight, from which others can recompute the summary.

use super::flight_tally::FlightTally;
use super::simulated_flights::SimulatedFlights;
use crate::trial::csv_file::{Decimals, write_csv};
use crate::trial::error::TrialError;
use overfly_core::coupling::Mode;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A row of `simulation.csv`.
#[derive(Serialize, Default)]
struct SimulationRow<'a> {
    variation: &'a str,
    mode: &'static str,
    flight: usize,
    absolute_count: u64,
    failures: u64,
    drawn: u64,
    outside_region: u64,
    no_map: u64,
    false_fixes: u64,
    after_failure_count: u64,
    after_failure_failures: u64,
    first_failure_s: Option<Decimals<3>>,
    execution_s: Decimals<6>,
    last_execution_s: Option<Decimals<9>>,
    nominal_count: Decimals<6>,
    lost: u8,
    nees: Option<Decimals<6>>,
    error_m: Option<Decimals<4>>,
}

impl<'a> SimulationRow<'a> {
    fn new(variation: &'a str, mode: Mode, flight: usize, t: &FlightTally) -> Self {
        let track = t.track.as_deref();
        Self {
            variation,
            mode: mode.word(),
            flight,
            absolute_count: t.absolute_count,
            failures: t.failures,
            drawn: t.drawn,
            outside_region: t.outside_region,
            no_map: t.no_map,
            false_fixes: t.false_fixes,
            after_failure_count: t.after_failure[0],
            after_failure_failures: t.after_failure[1],
            first_failure_s: t.first_failure_s.map(Decimals),
            execution_s: Decimals(t.execution_s),
            last_execution_s: t.last_execution_s.map(Decimals),
            nominal_count: Decimals(t.nominal_count),
            lost: u8::from(t.is_lost),
            nees: track.and_then(|t| t.nees).map(Decimals),
            error_m: track.and_then(|t| t.error_m).map(Decimals),
        }
    }
}

/// Writes `simulation.csv` into a folder, which is made if absent, and returns the path of the file. `execution_s` and
/// `nominal_count` are sums over a flight; the summary has means.
///
/// # Errors
/// [`TrialError::Unwritable`].
pub fn write_simulation(folder: &Path, flown: &[SimulatedFlights]) -> Result<PathBuf, TrialError> {
    let rows = flown.iter().flat_map(|f| {
        let tallies = f.tallies.iter().enumerate();
        tallies.map(|(flight, tally)| SimulationRow::new(&f.variation, f.mode, flight, tally))
    });
    write_csv(folder, "simulation.csv", rows)
}
