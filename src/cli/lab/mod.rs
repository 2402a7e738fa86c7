//! The commands of the feature `lab`: trials against truth, simulation, measurements and plans with their reports.

mod calibrate;
mod demo;
mod evaluate;
mod experiment;
mod failure;
mod fix_score;
mod fly;
mod integrity_args;
mod mosaic;
mod over_store;
mod plan;
mod project_tiles;
mod relative;
mod simulate;

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use clap::Subcommand;

/// What can be tried and measured.
#[derive(Subcommand)]
pub enum Command {
    /// Build a store from the project's own tiles, locate the sample flight, write report.html.
    Demo(demo::Args),
    /// Score registration against truth.
    #[command(subcommand)]
    Evaluate(evaluate::Evaluate),
    /// Replay a flight in a closed loop, in one coupling mode or all.
    Fly(Box<fly::Args>),
    /// Simulate thousands of drawn flights, and compare them with the models' predictions.
    Simulate(simulate::Args),
    /// Before the flight: which coupling mode, how fast, how long; and where along a route fixes can be expected.
    Plan(Box<plan::Args>),
    /// Measure the time and the error of registrations on this machine.
    Calibrate(calibrate::Args),
    /// Repeat the paper's experiment on relative registration: figures 12 to 15, measured here beside the printed ones.
    Experiment(experiment::Args),
}

/// Runs the command.
pub fn run(command: &Command, output: &Output) -> Result<Exit, Failure> {
    match command {
        Command::Demo(args) => demo::run(args, output),
        Command::Evaluate(args) => evaluate::run(args, output),
        Command::Fly(args) => fly::run(args, output),
        Command::Simulate(args) => simulate::run(args, output),
        Command::Plan(args) => plan::run(args, output),
        Command::Calibrate(args) => calibrate::run(args, output),
        Command::Experiment(args) => experiment::run(args, output),
    }
}
