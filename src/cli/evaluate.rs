//! `overfly evaluate`: registration scored against truth.

use super::evaluate_motions::{self, Motions};
use super::number::positive;
use super::{Exit, Failure, Output, chosen_layer, cost, default_threads, negatives};
use anyhow::Context;
use overfly_flight::locate::Answer;
use overfly_lab::trial::{FixOutcome, FixScore, FixTrial, Quantiles, RecordedFlight, write_fixes};
use overfly_store::{Layer, Reader};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// What to score.
#[derive(clap::Subcommand)]
pub enum Evaluate {
    /// Absolute registration: every frame of a flight on its own, from a displaced prior.
    Fixes(Box<Fixes>),
    /// Absolute registration where every fix is false: how often it is falsely sure.
    Negatives(Box<negatives::Args>),
    /// How the time of a search grows with the tiles it searches.
    Cost(cost::Args),
    /// Relative registration: pairs of known motion, a real flight, or pairs that share nothing.
    Motions(Motions),
}

const FIXES_HELP: &str = "\
A flight is a folder: flight.csv (image,time_s,true_latitude_deg,true_longitude_deg,true_heading_deg,height_agl_m,
heading_deg,pitch_deg,roll_deg; heading_deg and height_agl_m are what the sensors say), camera.toml, and the images.
Right: accepted and within --right-m of the truth. False: accepted and not right. No fix is neither.

Example:
  overfly evaluate fixes --db map.gpkg --flight flights/0716 --prior-error-m 300 --out scored";
/// Arguments of `evaluate fixes`.
#[derive(clap::Args)]
#[command(after_help = FIXES_HELP)]
pub struct Fixes {
    /// The store.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// The flight: a folder with flight.csv, camera.toml and images.
    #[arg(long, value_name = "DIR")]
    flight: PathBuf,
    /// Which layer [default: the only one, or ortho].
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// The prior is displaced by a uniform error of up to this per axis, metres.
    #[arg(long, value_name = "M", value_parser = positive, default_value_t = 500.0)]
    prior_error_m: f64,
    /// Seed of the displacements: the same seed, the same priors.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Greatest error that counts as right, metres [default: 3 ground pixels of the coarsest source].
    #[arg(long, value_name = "M", value_parser = positive)]
    right_m: Option<f64>,
    /// One standard deviation stated for the heading, degrees.
    #[arg(long, value_name = "DEG", value_parser = positive, default_value_t = 3.0)]
    heading_sigma_deg: f64,
    /// One standard deviation stated for the height, as a ratio of it.
    #[arg(long, value_name = "RATIO", value_parser = positive, default_value_t = 0.03)]
    height_sigma_ratio: f64,
    /// State no heading.
    #[arg(long)]
    unknown_heading: bool,
    /// State no position: search the whole layer.
    #[arg(long)]
    unknown_position: bool,
    /// Threads of each search.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
    /// Write fixes.csv here: a row per frame, from which others can recompute the score.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Evaluate, output: &Output) -> Result<Exit, Failure> {
    match args {
        Evaluate::Fixes(args) => fixes(args, output),
        Evaluate::Negatives(args) => negatives::run(args, output),
        Evaluate::Cost(args) => cost::run(args, output),
        Evaluate::Motions(args) => evaluate_motions::run(args, output),
    }
}

/// Makes the folder of the results before anything is computed for it.
pub fn make_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))
        .map_err(|e| Failure::failed("unwritable", e))
}

/// One frame as a JSON line.
#[derive(Serialize)]
struct FrameLine<'a> {
    image: &'a str,
    #[serde(flatten)]
    answer: &'a Answer,
    error_m: Option<f64>,
    in_ellipse95: Option<bool>,
    decode_ms: f64,
}

fn fixes(args: &Fixes, output: &Output) -> Result<Exit, Failure> {
    let flight = RecordedFlight::read(&args.flight)?;
    let store = Reader::open(&args.db)?;
    let layer = chosen_layer(&store, args.layer.as_deref())?;
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
        threads: args.threads.get(),
    };
    args.out.as_deref().map_or(Ok(()), make_folder)?;
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
        answer: &outcome.answer,
        error_m: outcome.error.map(overfly_core::geodesy::Enu::length_m),
        in_ellipse95: outcome.is_in_ellipse95(),
        decode_ms: outcome.decode_ms,
    }
}

/// Three ground pixels of the layer's coarsest source.
pub fn default_right_m(store: &Reader, layer: &Layer) -> Result<f64, Failure> {
    let coarsest = store.sources(layer)?.iter().map(|s| s.gsd_m_per_px).fold(0.0, f64::max);
    Ok(3.0 * coarsest)
}

/// The score for people.
pub fn fix_text(score: &FixScore) -> String {
    let spread = |s: &Option<Quantiles>, digits: usize| {
        s.map_or("none".into(), |s| {
            format!("median {:.digits$}, 95 % {:.digits$}, max {:.digits$}", s.median, s.p95, s.max)
        })
    };
    format!(
        "frames     {} ({} fixes, {} no fix)\nright      {} (within {:.2} m)\nfalse      {}\nerror      {} m\n\
         ellipse    {} of the fixes have the truth in their own 95 % ellipse (half axis {} m)\n\
         NEES       {}\n\
         elapsed    {} ms per frame on {} threads (decoding {})\ntiles      {} searched",
        score.frames,
        score.fixes,
        score.no_fix,
        score.right,
        score.right_m,
        score.wrong,
        spread(&score.error_m, 2),
        score.ellipse95_coverage.map_or("none".into(), |c| format!("{:.1} %", 100.0 * c)),
        spread(&score.semi_major_95_m, 2),
        score.nees.map_or("none".into(), |n| {
            let [low, high] = n.band95;
            format!("mean {:.2} (true covariances: {low:.2} to {high:.2}), trimmed {:.2}", n.mean, n.trimmed_mean)
        }),
        spread(&score.elapsed_ms, 0),
        score.threads,
        spread(&score.decode_ms, 1),
        spread(&score.tiles_searched, 0),
    )
}
