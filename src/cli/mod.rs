//! The command line: one file per command. This file declares them and dispatches to them.
//!
//! Commands that need the feature `preflight` or `lab` are in the folder of that name.

mod attitude_note;
mod camera_file;
mod chosen_layer;
mod exit;
mod failure;
mod fix_text;
mod folder;
mod mission_text;
mod number;
mod output;
mod outside_map;
#[cfg(feature = "lab")]
mod pictures;
#[cfg(not(feature = "lab"))]
#[path = "no_pictures.rs"]
mod pictures;
mod remedy;
mod replaced;
mod stop_signal;
mod threads;
mod usage;
mod viewpoint;

mod apply;
mod candidates;
mod completions;
mod cross_check;
mod diff;
mod fix;
mod info;
mod keygen;
mod motion;
mod serve;
mod sign;
mod verify;

#[cfg(feature = "lab")]
mod lab;
#[cfg(feature = "preflight")]
mod preflight;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use exit::Exit;
use failure::Failure;
use output::Output;
use std::process::ExitCode;
use usage::usage_failure;

/// Help that applies to every command.
const HELP: &str = "\
Before the flight: build, layer, merge, verify, evaluate, calibrate, experiment, simulate, plan, export, sign, diff, apply.
In flight: candidates, fix, motion; or serve, which offers all three over HTTP.

  overfly demo                                       everything, on the project's own tiles
  overfly build --db map.gpkg ORTHOPHOTOS            make a store from files or folders
  overfly fix --db map.gpkg --image FRAME ...        where was this frame taken?

The name of every flag and key ends in its unit: _m, _deg, _px, _m_per_px, _s. Positions are WGS84 degrees; a position is the
point straight below the camera, except in `candidates`, where it is the image's centre. Headings run clockwise from true
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
    /// Show no progress bars.
    #[arg(long, short, global = true, help_heading = "Output")]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    #[cfg(feature = "preflight")]
    #[command(flatten)]
    Preflight(preflight::Command),
    /// Show what is in a store.
    Info(info::Args),
    /// Check every hash, the digests, the signature, and the SQLite and GeoPackage rules.
    Verify(verify::Args),
    /// List the tiles to search for a position and its uncertainty.
    Candidates(candidates::Args),
    /// Locate one image (absolute registration).
    Fix(Box<fix::Args>),
    /// Register one image against another (relative registration).
    Motion(motion::Args),
    /// Compare two stores, and write the patch that makes the second from the first.
    Diff(diff::Args),
    /// Make the new store from the old one and a patch.
    Apply(apply::Args),
    /// Make a pair of keys to sign exported stores with.
    Keygen(keygen::Args),
    /// Sign an export that was made without a key.
    Sign(sign::Args),
    /// Serve a store over HTTP.
    Serve(serve::Args),
    #[cfg(feature = "lab")]
    #[command(flatten)]
    Lab(lab::Command),
    /// Print a shell completion script.
    Completions(completions::Args),
}

/// Prints why the usage is wrong, with its code word; or the help or version that was asked for.
fn refuse(usage: clap::Error) -> ExitCode {
    let is_help = usage.kind() == clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
    if is_help || !usage.use_stderr() {
        usage.exit();
    }
    // Arguments that cannot be parsed do not say whether JSON is requested.
    let json = std::env::args_os().any(|word| word == "--json");
    let failure = usage_failure(usage);
    Output::new(json, true).failure(&failure);
    failure.exit.into()
}

/// Parses the command line. A negative number is a value, never a flag.
fn parse() -> Result<Cli, clap::Error> {
    let command = with_negative_numbers(Cli::command());
    Cli::from_arg_matches(&command.try_get_matches()?)
}

fn with_negative_numbers(command: clap::Command) -> clap::Command {
    command.mut_subcommands(with_negative_numbers).allow_negative_numbers(true)
}

fn dispatch(command: &Command, output: &Output) -> Result<Exit, Failure> {
    match command {
        #[cfg(feature = "preflight")]
        Command::Preflight(command) => preflight::run(command, output),
        Command::Info(args) => info::run(args, output),
        Command::Verify(args) => verify::run(args, output),
        Command::Candidates(args) => candidates::run(args, output),
        Command::Fix(args) => fix::run(args, output),
        Command::Motion(args) => motion::run(args, output),
        Command::Diff(args) => diff::run(args, output),
        Command::Apply(args) => apply::run(args, output),
        Command::Keygen(args) => keygen::run(args, output),
        Command::Sign(args) => sign::run(args, output),
        Command::Serve(args) => serve::run(args, output),
        #[cfg(feature = "lab")]
        Command::Lab(command) => lab::run(command, output),
        Command::Completions(args) => completions::run(args, Cli::command()),
    }
}

/// Runs the program and returns its exit code.
pub fn run() -> ExitCode {
    let cli = match parse() {
        Ok(cli) => cli,
        Err(usage) => return refuse(usage),
    };
    let output = Output::new(cli.json, cli.quiet);
    match dispatch(&cli.command, &output) {
        Ok(exit) => exit.into(),
        Err(failure) => {
            output.failure(&failure);
            failure.exit.into()
        }
    }
}
