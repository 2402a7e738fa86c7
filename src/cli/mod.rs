//! The command line: one file per subcommand; printing and exit codes here.

mod exit;
mod output;

mod apply;
mod build;
mod calibrate;
mod candidates;
mod completions;
mod cost;
mod demo;
mod diff;
mod evaluate;
mod evaluate_motions;
mod experiment;
mod export;
mod fix;
mod fly;
mod info;
mod ingest_remedy;
mod keygen;
mod merge;
mod motion;
mod negatives;
mod number;
mod plan;
mod relative;
mod remedy;
mod serve;
mod simulate;
mod verify;
mod viewpoint;

use clap::{Parser, Subcommand};
pub use exit::{Exit, Failure};
pub use output::Output;
use overfly_flight::locate::candidates::default_layer;
use overfly_store::{Layer, Reader};
use std::process::ExitCode;

/// What every command has in common.
const HELP: &str = "\
Before the flight: build, merge, verify, evaluate, calibrate, experiment, plan, export, diff, apply. In flight: candidates, fix, motion, or serve, which does all three over HTTP.

  overfly demo                                       all of it, on the project's own tiles
  overfly build --db map.gpkg ORTHOPHOTOS            a store from files or folders
  overfly fix --db map.gpkg --image FRAME ...        where was this frame taken?

Every flag and key names its unit: _m, _deg, _px, _m_per_px, _s. Positions are WGS84 degrees; a position is the point
straight below the camera, except in `candidates`, where it is the image's centre. Headings run clockwise from true
north to the middle of the image's upper edge.

Exit codes: 0 done; 1 failed or partly done; 2 bad usage or nothing usable in the input; 3 no fix, no motion, or a
store that does not verify.";

/// The tile database that lets an aircraft fly without GPS.
#[derive(Parser)]
#[command(name = "overfly", version, about, long_about = None, arg_required_else_help = true, after_help = HELP)]
struct Cli {
    /// Print JSON Lines on standard output; the last line is the summary.
    #[arg(long, global = true, help_heading = "Output")]
    json: bool,
    /// No progress bars.
    #[arg(long, short, global = true, help_heading = "Output")]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Build a store from the project's own tiles, locate the sample flight, write report.html.
    Demo(demo::Args),
    /// Ingest orthophotos into a store.
    Build(build::Args),
    /// Say what is in a store.
    Info(info::Args),
    /// Check every hash, the digests, the signature, and the SQLite and GeoPackage rules.
    Verify(verify::Args),
    /// List the tiles to search for a position and its uncertainty.
    Candidates(candidates::Args),
    /// Locate one image (absolute registration).
    Fix(Box<fix::Args>),
    /// Register one image against another (relative registration).
    Motion(motion::Args),
    /// Score registration against truth.
    #[command(subcommand)]
    Evaluate(evaluate::Evaluate),
    /// Replay a flight in a closed loop, in one coupling mode or all; or simulate thousands.
    Fly(Box<fly::Args>),
    /// Before the flight: which coupling mode, how fast, how long; and where along a route fixes can be had.
    Plan(Box<plan::Args>),
    /// Measure what registrations cost and err on this machine.
    Calibrate(calibrate::Args),
    /// Repeat the paper's experiment on relative registration: its figures 12 to 15, here and as printed.
    Experiment(experiment::Args),
    /// Cut out what one flight needs, for the aircraft's storage.
    Export(Box<export::Args>),
    /// Say how two stores differ, and write the patch that makes one of the other.
    Diff(diff::Args),
    /// Make the new store of the old one and a patch.
    Apply(apply::Args),
    /// Merge stores that were built apart into one.
    Merge(merge::Args),
    /// Make a pair of keys to sign exported stores with.
    Keygen(keygen::Args),
    /// Serve a store over HTTP.
    Serve(serve::Args),
    /// Print a shell completion script.
    Completions(completions::Args),
}

/// As many threads as the machine runs at once.
fn default_threads() -> std::num::NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(std::num::NonZeroUsize::MIN)
}

/// The layer that is named, or the only one, or `ortho`.
fn chosen_layer<'a>(store: &'a Reader, name: Option<&str>) -> Result<&'a Layer, Failure> {
    Ok(match name {
        Some(name) => store.layer(name)?,
        None => default_layer(store)?,
    })
}

/// Bad usage, with its code word; or the help or version that was asked for.
fn refuse(usage: &clap::Error) -> ExitCode {
    let is_help = usage.kind() == clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
    if is_help || !usage.use_stderr() {
        usage.exit();
    }
    let text = usage.to_string();
    let message = text.strip_prefix("error: ").unwrap_or(&text).trim_end();
    // Usage that cannot be parsed does not say whether JSON is wanted either.
    let json = std::env::args_os().any(|word| word == "--json");
    let failure = Failure::unusable("usage", anyhow::anyhow!("{message}"));
    Output::new(json, true).failure(&failure);
    failure.exit.into()
}

/// Runs the program and says how it ended.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(usage) => return refuse(&usage),
    };
    let output = Output::new(cli.json, cli.quiet);
    let result = match &cli.command {
        Command::Demo(args) => demo::run(args, &output),
        Command::Build(args) => build::run(args, &output),
        Command::Info(args) => info::run(args, &output),
        Command::Verify(args) => verify::run(args, &output),
        Command::Candidates(args) => candidates::run(args, &output),
        Command::Fix(args) => fix::run(args, &output),
        Command::Motion(args) => motion::run(args, &output),
        Command::Evaluate(args) => evaluate::run(args, &output),
        Command::Fly(args) => fly::run(args, &output),
        Command::Plan(args) => plan::run(args, &output),
        Command::Calibrate(args) => calibrate::run(args, &output),
        Command::Experiment(args) => experiment::run(args, &output),
        Command::Export(args) => export::run(args, &output),
        Command::Diff(args) => diff::run(args, &output),
        Command::Apply(args) => apply::run(args, &output),
        Command::Merge(args) => merge::run(args, &output),
        Command::Keygen(args) => keygen::run(args, &output),
        Command::Serve(args) => serve::run(args, &output),
        Command::Completions(args) => completions::run(args, &output),
    };
    match result {
        Ok(exit) => exit.into(),
        Err(failure) => {
            output.failure(&failure);
            failure.exit.into()
        }
    }
}
