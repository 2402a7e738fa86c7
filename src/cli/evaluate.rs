//! (skeleton)

use super::{Exit, Failure, Output};

/// What to score.
#[derive(clap::Subcommand)]
pub enum Evaluate {
    /// Absolute registration, frame by frame.
    Fixes,
    /// Relative registration, pair by pair.
    Motions,
}

/// Runs the command.
pub fn run(_args: &Evaluate, _output: &Output) -> Result<Exit, Failure> {
    Err(Failure::failed("not_built", anyhow::anyhow!("not built yet")))
}
