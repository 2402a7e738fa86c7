//! `TrialArgs`: what a trial of fixes is told, by every command that makes one.

use crate::cli::failure::Failure;
use crate::cli::lab::fix_score::default_right_m;
use crate::cli::lab::over_store::FlightOverStore;
use crate::cli::number::{positive, positive_metres};
use crate::cli::output::Output;
use crate::cli::threads::default_threads;
use overfly_flight::locate::Parts;
use overfly_lab::trial::{FixTrial, RecordedFlight, TruthPoint};
use overfly_store::Reader;
use std::num::NonZeroUsize;

/// Arguments of a trial of fixes.
#[derive(clap::Args)]
pub struct TrialArgs {
    #[command(flatten)]
    over: FlightOverStore,
    /// The prior is displaced by a uniform error of at most this per axis, metres.
    #[arg(long, value_name = "M", value_parser = positive_metres, default_value_t = 500.0)]
    prior_error_m: f64,
    /// Seed of the displacements: equal seeds give equal priors.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Greatest error that counts as right, metres [default: 3 ground pixels of the coarsest source].
    #[arg(long, value_name = "M", value_parser = positive_metres)]
    right_m: Option<f64>,
    #[command(flatten)]
    sensors: SensorArgs,
    /// Search without a heading prior.
    #[arg(long)]
    unknown_heading: bool,
    /// Search without a position prior: over the whole layer.
    #[arg(long)]
    unknown_position: bool,
    /// The point of the ground that the true columns are, and at which fixes are judged.
    #[arg(long, value_enum, default_value_t = TruthArg::Nadir)]
    truth: TruthArg,
    /// Threads of each search.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
}

/// How well heading and height are known.
#[derive(clap::Args)]
pub struct SensorArgs {
    /// One standard deviation of the heading prior, degrees.
    #[arg(long, value_name = "DEG", value_parser = positive, default_value_t = 3.0)]
    pub heading_sigma_deg: f64,
    /// One standard deviation of the height, as a ratio.
    #[arg(long, value_name = "RATIO", value_parser = positive, default_value_t = 0.03)]
    pub height_sigma_ratio: f64,
}

/// `--truth`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum TruthArg {
    /// Straight below the camera.
    Nadir,
    /// Under the image's centre.
    Centre,
}

impl From<TruthArg> for TruthPoint {
    fn from(point: TruthArg) -> Self {
        match point {
            TruthArg::Nadir => Self::Nadir,
            TruthArg::Centre => Self::Centre,
        }
    }
}

/// A trial ready to run.
pub struct Opened {
    /// The flight.
    pub flight: RecordedFlight,
    /// The store.
    pub store: Reader,
    /// The trial.
    pub trial: FixTrial,
    /// The greatest error of a right fix, metres.
    pub right_m: f64,
}

impl TrialArgs {
    /// Reads the flight and opens the store.
    ///
    /// # Errors
    /// If either cannot be read.
    pub fn open(&self, output: &Output) -> Result<Opened, Failure> {
        let (flight, store) = self.over.open(output)?;
        let layer = self.over.layer(&store)?;
        let right_m = match self.right_m {
            Some(right_m) => right_m,
            None => default_right_m(&store, layer)?,
        };
        let trial = FixTrial {
            layer: layer.name.clone(),
            prior_error_m: self.prior_error_m,
            seed: self.seed,
            heading_sigma_deg: (!self.unknown_heading).then_some(self.sensors.heading_sigma_deg),
            height_sigma_ratio: self.sensors.height_sigma_ratio,
            unknown_position: self.unknown_position,
            truth: self.truth.into(),
            parts: Parts::ALL,
            threads: self.threads.get(),
        };
        Ok(Opened { flight, store, trial, right_m })
    }
}
