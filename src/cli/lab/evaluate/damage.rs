//! `overfly evaluate damage`: what becomes of frames whose files were damaged.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::lab::fix_score::default_right_m;
use crate::cli::lab::over_store::FlightOverStore;
use crate::cli::number::positive_metres;
use crate::cli::output::Output;
use crate::cli::threads::default_threads;
use overfly_flight::locate::Parts;
use overfly_lab::trial::{
    DamageOutcome, DamageResult, DamageScore, DamageTrial, FileChange, FixTrial, FrameFormat, TruthPoint, write_damage,
};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::PathBuf;

const HELP: &str = "\
Every trial writes a frame of the flight in a format, changes bytes of the file, and locates what can still be read. A file that is
refused (image_damaged) and no fix are good answers. Formats:
  own  the flight's files   jpeg  jpeg_restarts  jpeg_progressive  jpeg_gray   png   webp_lossless
Changes that damage:
  zeroed  cut  swapped  flipped  overwritten  removed  repeated
Changes that are harmless, after which the frame must have the same pixels:
  trailing      bytes after the file's end
  restart_junk  a few bytes before every restart marker (jpeg_restarts)
  segments      unknown segments (the JPEG formats but own)

A fix beyond --right-m is false. `outside` counts the false ones that do not say so: outside their own 99.99 % ellipse. damage.csv has
both, and the squared Mahalanobis distance of each fix from the truth.

If n trials end in no false fix, the rate is below 3 / n with 95 % confidence. With --json: one line per false fix and per harmless
change that was not read as before, then the summary. Exit code 0 whatever was found.

Example:
  overfly evaluate damage --db map.gpkg --flight flights/0716 --trials 1000 --out damaged";

/// Arguments of `evaluate damage`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    #[command(flatten)]
    over: FlightOverStore,
    /// Trials of each format, spread evenly over the changes.
    #[arg(long, value_name = "N", default_value_t = 200)]
    trials: usize,
    /// Formats to write frames in [default: all].
    #[arg(long, value_name = "FORMAT,...", value_delimiter = ',')]
    formats: Option<Vec<FrameFormat>>,
    /// Changes to make [default: all].
    #[arg(long, value_name = "CHANGE,...", value_delimiter = ',')]
    changes: Option<Vec<FileChange>>,
    /// Seed: equal seeds give equal trials.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The prior is displaced by a uniform error of at most this per axis, metres.
    #[arg(long, value_name = "M", value_parser = positive_metres, default_value_t = 500.0)]
    prior_error_m: f64,
    /// Greatest error that counts as right, metres [default: 3 ground pixels of the coarsest source].
    #[arg(long, value_name = "M", value_parser = positive_metres)]
    right_m: Option<f64>,
    /// Frames that are tried at the same time; each search uses one thread.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
    /// Write damage.csv here: one row per trial.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// A trial that must not be, as a JSON line.
#[derive(Serialize)]
struct Line<'a> {
    trial: usize,
    format: FrameFormat,
    change: FileChange,
    image: &'a str,
    refused: Option<&'static str>,
    error_m: Option<f64>,
    changed_share: f64,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let (flight, store) = args.over.open(output)?;
    let layer = args.over.layer(&store)?;
    let right_m = args.right_m.map_or_else(|| default_right_m(&store, layer), Ok)?;
    let fixes = FixTrial {
        layer: layer.name.clone(),
        prior_error_m: args.prior_error_m,
        seed: args.seed,
        heading_sigma_deg: Some(3.0),
        height_sigma_ratio: 0.03,
        unknown_position: false,
        truth: TruthPoint::Nadir,
        parts: Parts::ALL,
        threads: 1,
    };
    let trial = DamageTrial {
        fixes,
        formats: args.formats.clone().unwrap_or_else(|| FrameFormat::ALL.to_vec()),
        changes: args.changes.clone().unwrap_or_else(|| FileChange::ALL.to_vec()),
        trials: args.trials,
        threads: args.threads.get(),
    };
    args.out.as_deref().map_or(Ok(()), make_folder)?;
    let bar = output.progress((args.trials * trial.formats.len()) as u64, "trials");
    let outcomes = trial.run(&store, &flight, |_| bar.inc(1))?;
    bar.finish_and_clear();
    if let Some(folder) = &args.out {
        output.note(&format!("wrote {}", write_damage(folder, &outcomes)?.display()));
    }
    if output.is_json() {
        outcomes.iter().filter_map(|o| line(o, right_m)).for_each(|line| output.say(&line, String::new));
    }
    let score = DamageScore::from_outcomes(&outcomes, right_m);
    output.say(&score, || text(&score));
    Ok(Exit::Done)
}

fn line(outcome: &DamageOutcome, right_m: f64) -> Option<Line<'_>> {
    let is_lost = outcome.change.is_harmless() && outcome.result != DamageResult::Unchanged;
    let (refused, error_m) = match outcome.result {
        DamageResult::Refused(code) => (Some(code), None),
        DamageResult::Fix { error_m, .. } => (None, Some(error_m)),
        DamageResult::Unchanged | DamageResult::NoFix => (None, None),
    };
    (is_lost || outcome.is_false(right_m)).then_some(Line {
        trial: outcome.number,
        format: outcome.format,
        change: outcome.change,
        image: &outcome.image,
        refused,
        error_m,
        changed_share: outcome.changed_share,
    })
}

/// The score as text.
fn text(score: &DamageScore) -> String {
    let mut text = format!(
        "damaged    {} files: {} refused, {} with the same pixels, {} no fix, {} right fixes (within {:.2} m)\n\
         false      {} (rate below {:.1e} with 95 % confidence), {} of them with the truth outside their own 99.99 % ellipse\nharmless   {} files: {} not read as before\n\n  \
         format            change        trials  refused  same  no fix  right  false outside\n",
        score.trials,
        score.refused,
        score.unchanged,
        score.no_fix,
        score.right,
        score.right_m,
        score.wrong,
        score.false_rate_upper95,
        score.outside,
        score.harmless,
        score.harmless_lost,
    );
    for r in &score.rows {
        text.push_str(&format!(
            "  {:<17} {:<12} {:>7} {:>8} {:>5} {:>7} {:>6} {:>6} {:>7}\n",
            r.format.word(),
            r.change.word(),
            r.trials,
            r.refused,
            r.unchanged,
            r.no_fix,
            r.right,
            r.wrong,
            r.outside
        ));
    }
    text.trim_end().to_owned()
}
