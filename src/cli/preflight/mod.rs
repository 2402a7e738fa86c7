//! The commands of the feature `preflight`: from orthophotos to the store that flies.

mod build;
mod export;
mod export_warnings;
mod failure;
mod interrupt;
mod layer;
mod merge;
pub(super) mod remedy;

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use clap::Subcommand;

/// What can be done before the flight.
#[derive(Subcommand)]
pub enum Command {
    /// Build a store from orthophotos.
    Build(build::Args),
    /// Rename, describe or remove a layer of a store that was built.
    #[command(subcommand, after_help = layer::HELP)]
    Layer(layer::LayerCommand),
    /// Merge stores that were built separately into one.
    Merge(merge::Args),
    /// Cut out what one flight needs, for the aircraft's storage.
    Export(Box<export::Args>),
}

/// Runs the command.
pub fn run(command: &Command, output: &Output) -> Result<Exit, Failure> {
    match command {
        Command::Build(args) => build::run(args, output),
        Command::Layer(command) => layer::run(command, output),
        Command::Merge(args) => merge::run(args, output),
        Command::Export(args) => export::run(args, output),
    }
}
