//! `overfly evaluate fixes`: absolute registration scored against truth.

use super::disturbed::{self, DisturbanceKinds};
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::lab::fix_score::{default_right_m, fix_text};
use crate::cli::lab::over_store::FlightOverStore;
use crate::cli::number::{positive, positive_metres};
use crate::cli::output::Output;
use crate::cli::threads::default_threads;
use crate::server::dto::AnswerJson;
use overfly_lab::trial::{FixOutcome, FixScore, FixTrial, TruthPoint, write_fixes};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::PathBuf;

const HELP: &str = "\
A flight is a folder with flight.csv, camera.toml and the images. The columns of flight.csv are image,time_s,true_latitude_deg,
true_longitude_deg,true_heading_deg,height_agl_m,heading_deg,pitch_deg,roll_deg; heading_deg and height_agl_m are sensor values.

pitch_deg and roll_deg may be absent or empty: then they are unknown. attitude_sigma_deg, one standard deviation of both, may stand
in flight.csv or in camera.toml; --attitude-sigma-deg overrides both.

A fix is right if it lies within --right-m of the truth, and false otherwise. No fix is neither right nor false.

--disturb alters the frames first: another tilt, lens, exposure, weather, damage by a link, ... The truth of nadir and image's centre
stays exact. Such a fix is right if its image's centre lies within --right-m or inside its own 99.99 % ellipse, and false otherwise.

Example:
  overfly evaluate fixes --db map.gpkg --flight flights/0716 --prior-error-m 300 --out scored";

/// Arguments of `evaluate fixes`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
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
    /// One standard deviation of the heading prior, degrees.
    #[arg(long, value_name = "DEG", value_parser = positive, default_value_t = 3.0)]
    heading_sigma_deg: f64,
    /// One standard deviation of the height, as a ratio.
    #[arg(long, value_name = "RATIO", value_parser = positive, default_value_t = 0.03)]
    height_sigma_ratio: f64,
    /// Search without a heading prior.
    #[arg(long)]
    unknown_heading: bool,
    /// Search without a position prior: over the whole layer.
    #[arg(long)]
    unknown_position: bool,
    /// The point of the ground that the true columns are, and at which fixes are judged.
    #[arg(long, value_enum, default_value_t = TruthArg::Nadir)]
    truth: TruthArg,
    /// Locate disturbed frames instead, and score them by kind: `all`, or kinds separated by commas.
    #[arg(long, value_name = "KIND,...", conflicts_with = "truth")]
    disturb: Option<DisturbanceKinds>,
    /// Frames of each kind of disturbance.
    #[arg(long, value_name = "N", default_value_t = 100, requires = "disturb")]
    disturb_frames: usize,
    /// Threads of each search; with --disturb, frames at a time.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
    /// Write fixes.csv here: one row per frame, from which the score can be recomputed.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
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

/// One frame as a JSON line.
#[derive(Serialize)]
struct FrameLine<'a> {
    image: &'a str,
    #[serde(flatten)]
    answer: AnswerJson,
    error_m: Option<f64>,
    in_ellipse95: Option<bool>,
    decode_ms: f64,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let (flight, store) = args.over.open(output)?;
    let layer = args.over.layer(&store)?;
    let right_m = match args.right_m {
        Some(right_m) => right_m,
        None => default_right_m(&store, layer)?,
    };
    let trial = FixTrial {
        layer: layer.name.clone(),
        prior_error_m: args.prior_error_m,
        seed: args.seed,
        heading_sigma_deg: (!args.unknown_heading).then_some(args.heading_sigma_deg),
        height_sigma_ratio: args.height_sigma_ratio,
        unknown_position: args.unknown_position,
        truth: args.truth.into(),
        threads: args.threads.get(),
    };
    args.out.as_deref().map_or(Ok(()), make_folder)?;
    if let Some(kinds) = &args.disturb {
        let judged = (right_m, args.out.as_deref());
        disturbed::run(trial, kinds, args.disturb_frames, (&store, &flight), judged, output)?;
        return Ok(Exit::Done);
    }
    let bar = output.progress(flight.frames.len() as u64, "frames");
    let outcomes = trial.run(&store, &flight, |outcome| {
        bar.inc(1);
        if output.is_json() {
            output.say(&frame_line(outcome), String::new);
        }
    })?;
    bar.finish_and_clear();
    if let Some(folder) = &args.out {
        output.note(&format!("wrote {}", write_fixes(folder, &outcomes)?.display()));
    }
    let score = FixScore::from_outcomes(&outcomes, right_m, args.threads.get());
    output.say(&score, || fix_text(&score));
    Ok(Exit::Done)
}

fn frame_line(outcome: &FixOutcome) -> FrameLine<'_> {
    FrameLine {
        image: &outcome.image,
        answer: AnswerJson::new(outcome.answer.clone(), outcome.elapsed_ms),
        error_m: outcome.error.map(overfly_core::geodesy::Enu::length_m),
        in_ellipse95: outcome.is_in_ellipse95(),
        decode_ms: outcome.decode_ms,
    }
}
