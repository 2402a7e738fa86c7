//! (skeleton)

use super::{Exit, Failure, Output};

/// Arguments.
#[derive(clap::Args)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: &Args, _output: &Output) -> Result<Exit, Failure> {
    Err(Failure::failed("not_built", anyhow::anyhow!("not built yet")))
}
