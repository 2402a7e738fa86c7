//! `overfly evaluate fixes`: absolute registration scored against truth.

use super::disturbed::{self, DisturbanceKinds};
use super::trial_args::{Opened, TrialArgs};
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::lab::fix_score::fix_text;
use crate::cli::lab::integrity_args::IntegrityArgs;
use crate::cli::output::Output;
use crate::server::dto::AnswerJson;
use overfly_lab::report::stanford_svg;
use overfly_lab::trial::{FixOutcome, FixScore, write_fixes};
use serde::Serialize;
use std::path::PathBuf;

const HELP: &str = "\
A flight is a folder with flight.csv, camera.toml and the images. The columns of flight.csv are image,time_s,true_latitude_deg,
true_longitude_deg,true_heading_deg,height_agl_m,heading_deg,pitch_deg,roll_deg; heading_deg and height_agl_m are sensor values.

pitch_deg and roll_deg may be absent or empty: then they are unknown. attitude_sigma_deg, one standard deviation of both, may stand
in flight.csv or in camera.toml; --attitude-sigma-deg overrides both.

A fix is right if it lies within --right-m of the truth, and false otherwise. No fix is neither right nor false.

--disturb alters the frames first: another tilt, lens, exposure, weather, damage by a link, ... The truth of nadir and image's centre
stays exact, and --threads counts frames at a time. Such a fix is right if its image's centre lies within --right-m or inside its own 99.99 % ellipse, and false otherwise.

Example:
  overfly evaluate fixes --db map.gpkg --flight flights/0716 --prior-error-m 300 --out scored";

/// Arguments of `evaluate fixes`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    #[command(flatten)]
    trial: TrialArgs,
    /// Locate disturbed frames instead, and score them by kind: `all`, or kinds separated by commas.
    #[arg(long, value_name = "KIND,...", conflicts_with = "truth")]
    disturb: Option<DisturbanceKinds>,
    /// Frames of each kind of disturbance.
    #[arg(long, value_name = "N", default_value_t = 100, requires = "disturb")]
    disturb_frames: usize,
    #[command(flatten)]
    integrity: IntegrityArgs,
    /// Write fixes.csv and stanford.svg (errors against protection levels) here: fixes.csv has one row per frame, from which the score can be recomputed.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
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
    let Opened { flight, store, trial, right_m } = args.trial.open(output)?;
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
            output.say(&frame_line(outcome, args.integrity.integrity_risk), String::new);
        }
    })?;
    bar.finish_and_clear();
    let risk = args.integrity.integrity_risk;
    let protected = FixOutcome::protected_errors(&outcomes, risk);
    if let Some(folder) = &args.out {
        output.note(&format!("wrote {}", write_fixes(folder, &outcomes, risk)?.display()));
        let plot = stanford_svg(&protected, args.integrity.alert_limit_m);
        output.write(&folder.join("stanford.svg"), plot.as_bytes())?;
    }
    let integrity = args.integrity.score(&protected);
    let score = FixScore { integrity, ..FixScore::from_outcomes(&outcomes, right_m, trial.threads) };
    output.say(&score, || fix_text(&score));
    Ok(Exit::Done)
}

fn frame_line(outcome: &FixOutcome, integrity_risk: f64) -> FrameLine<'_> {
    FrameLine {
        image: &outcome.image,
        answer: AnswerJson::new(outcome.answer.clone(), outcome.elapsed_ms, integrity_risk),
        error_m: outcome.error.map(overfly_core::geodesy::Enu::length_m),
        in_ellipse95: outcome.is_in_ellipse95(),
        decode_ms: outcome.decode_ms,
    }
}
