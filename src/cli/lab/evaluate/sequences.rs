//! `overfly evaluate sequences`: flights with faults of camera, sensors and clock.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::lab::fix_score::default_right_m;
use crate::cli::lab::over_store::FlightOverStore;
use crate::cli::number::{positive, positive_metres};
use crate::cli::output::Output;
use crate::cli::threads::default_threads;
use overfly_core::coupling::Mode;
use overfly_flight::navigate::NavigateOptions;
use overfly_lab::trial::{FaultScore, SequenceFault, SequenceTrial};
use std::num::NonZeroUsize;

const HELP: &str = "\
Flies a recorded flight in a closed loop, as `fly` does. At a place drawn by the seed something goes wrong: the camera shows frozen,
replayed, reversed or exchanged images; compass, altimeter or clock lie; rows are absurd; something stands still in all images.

Every position should have the truth in its own 99.9 % ellipse, or call itself `lost`. The table counts those outside by what they call
themselves. `recovered`: flights that end within --right-m and not lost.

With --json: one object per kind of fault, with every position outside.

Example:
  overfly evaluate sequences --db map.gpkg --flight flights/0716 --seeds 20";

/// Arguments of `evaluate sequences`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    #[command(flatten)]
    over: FlightOverStore,
    /// Kinds of faults [default: all].
    #[arg(long, value_name = "FAULT,...", value_delimiter = ',')]
    faults: Option<Vec<SequenceFault>>,
    /// Flights of each kind.
    #[arg(long, value_name = "N", default_value_t = 20)]
    seeds: u64,
    /// The first seed: equal seeds give equal faults.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How to couple absolute and relative registration.
    #[arg(long, value_name = "MODE", value_enum, default_value_t = ModeArg::Auto)]
    mode: ModeArg,
    /// Initial ground speed, m/s; its standard deviation is half of it.
    #[arg(long, value_name = "MPS", value_parser = positive, default_value_t = 40.0)]
    speed_mps: f64,
    /// Smallest turn radius, metres.
    #[arg(long, value_name = "M", value_parser = positive_metres, default_value_t = 500.0)]
    min_turn_radius_m: f64,
    /// Greatest error of a flight that has recovered, metres [default: 3 ground pixels of the coarsest source].
    #[arg(long, value_name = "M", value_parser = positive_metres)]
    right_m: Option<f64>,
    /// Flights at the same time; each uses one thread.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
}

/// The coupling mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ModeArg {
    Sequential,
    Parallel,
    Combined,
    Auto,
}

impl From<ModeArg> for Mode {
    fn from(mode: ModeArg) -> Self {
        match mode {
            ModeArg::Sequential => Self::Sequential,
            ModeArg::Parallel => Self::Parallel,
            ModeArg::Combined => Self::Combined,
            ModeArg::Auto => Self::Auto,
        }
    }
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let (flight, store) = args.over.open_with_absurd_rows(output)?;
    let layer = args.over.layer(&store)?;
    let right_m = args.right_m.map_or_else(|| default_right_m(&store, layer), Ok)?;
    let options = NavigateOptions {
        layer: layer.name.clone(),
        mode: args.mode.into(),
        speed_mps: args.speed_mps,
        speed_sigma_mps: args.speed_mps / 2.0,
        min_turn_radius_m: args.min_turn_radius_m,
        ..NavigateOptions::default()
    };
    let faults = args.faults.clone().unwrap_or_else(|| SequenceFault::ALL.to_vec());
    let bar = output.progress(args.seeds * faults.len() as u64, "flights");
    let (seeds, first_seed) = (args.seeds, args.seed);
    let trial = SequenceTrial { store: &store, flight: &flight, faults, seeds, first_seed };
    let scores = trial.run(&options, right_m, args.threads.get(), || bar.inc(1))?;
    bar.finish_and_clear();
    for (i, score) in scores.iter().enumerate() {
        output.say(score, || if i == 0 { format!("{HEADER}\n{}", text(score)) } else { text(score) });
    }
    Ok(Exit::Done)
}

const HEADER: &str = "\
fault                flights  outside the 99.9 % ellipse: absolute   propagated         lost  max error m  recovered";

fn text(score: &FaultScore) -> String {
    let s = &score.sources;
    let [absolute, propagated, lost] =
        [s.absolute, s.propagated, s.lost].map(|s| format!("{} of {}", s.outside, s.positions));
    format!(
        "{:<20} {:>7}  {absolute:>36} {propagated:>12} {lost:>12} {:>12.1} {:>10}",
        score.fault, score.flights, score.max_error_m, score.recovered
    )
}
