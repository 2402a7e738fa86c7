//! The command line: one file per subcommand; printing and exit codes here.

mod exit;
mod output;

mod build;
mod candidates;
mod completions;
mod demo;
mod evaluate;
mod fix;
mod info;
mod motion;
mod number;
mod serve;
mod verify;
mod viewpoint;

use clap::{Parser, Subcommand};
pub use exit::{Exit, Failure};
pub use output::Output;
use std::process::ExitCode;

/// The tile database that lets an aircraft fly without GPS.
#[derive(Parser)]
#[command(name = "overfly", version, about, long_about = None, propagate_version = true, arg_required_else_help = true)]
struct Cli {
    /// Print JSON Lines on standard output; the last line is the summary.
    #[arg(long, global = true)]
    json: bool,
    /// No progress bars.
    #[arg(long, short, global = true)]
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
    /// Check every hash, the digest, and the SQLite and GeoPackage rules.
    Verify(verify::Args),
    /// List the tiles to search for a position and its uncertainty.
    Candidates(candidates::Args),
    /// Locate one image (absolute registration).
    Fix(fix::Args),
    /// Register one image against another (relative registration).
    Motion(motion::Args),
    /// Score registration against truth.
    #[command(subcommand)]
    Evaluate(evaluate::Evaluate),
    /// Serve a store over HTTP.
    Serve(serve::Args),
    /// Print a shell completion script.
    Completions(completions::Args),
}

/// As many threads as the machine runs at once.
fn default_threads() -> std::num::NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(std::num::NonZeroUsize::MIN)
}

/// Runs the program and says how it ended.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
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
