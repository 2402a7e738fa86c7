//! `overfly completions`: shell completion scripts.

use super::{Cli, Exit, Failure, Output};
use clap::CommandFactory;

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// Which shell.
    shell: clap_complete::Shell,
}

/// Prints the script on standard output.
pub fn run(args: &Args, _output: &Output) -> Result<Exit, Failure> {
    clap_complete::generate(args.shell, &mut Cli::command(), "overfly", &mut std::io::stdout());
    Ok(Exit::Done)
}
