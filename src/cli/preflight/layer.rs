//! `overfly layer`: renames, describes and removes the layers of a built store.

mod describe;
mod outcome;
mod remove;
mod rename;

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use clap::Subcommand;

/// Help that applies to all three.
pub const HELP: &str = "\
Only a store that was built can be changed: an export is sealed by its digest. Each change is one transaction: a stopped one leaves
the store as it was. What changes the digest of the store (all but a description) leaves the exports made before with the old one:
make and sign them anew.

Examples:
  overfly layer rename --db map.gpkg ortho y2018 --dry-run
  overfly layer describe --db map.gpkg y2018 --date 2018-07-16 --licence CC-BY-4.0 --attribution 'Survey of Lower Austria'
  overfly layer remove --db map.gpkg y2018

`overfly info` lists the layers; `overfly build --layer NAME` makes one.";

/// What to do with a layer.
#[derive(Subcommand)]
pub enum LayerCommand {
    /// Give a layer another name.
    Rename(rename::Args),
    /// State description, licence, attribution or date of a layer anew, without its orthophotos.
    Describe(describe::Args),
    /// Remove a layer; asks first.
    Remove(remove::Args),
}

/// Runs the command.
pub fn run(command: &LayerCommand, output: &Output) -> Result<Exit, Failure> {
    match command {
        LayerCommand::Rename(args) => rename::run(args, output),
        LayerCommand::Describe(args) => describe::run(args, output),
        LayerCommand::Remove(args) => remove::run(args, output),
    }
}
