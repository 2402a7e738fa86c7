//! `overfly completions`: shell completion scripts.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// The shell.
    shell: clap_complete::Shell,
}

/// Prints the completion script of `program` on standard output.
pub fn run(args: &Args, mut program: clap::Command) -> Result<Exit, Failure> {
    clap_complete::generate(args.shell, &mut program, "overfly", &mut std::io::stdout());
    Ok(Exit::Done)
}
