//! `overfly evaluate`: registration scored against truth.

mod ablation;
mod cost;
mod damage;
mod disturbed;
mod fixes;
mod motions;
mod negatives;
mod sequences;
mod trial_args;

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;

/// What to score.
#[derive(clap::Subcommand)]
pub enum Evaluate {
    /// Absolute registration: every frame of a flight on its own, from a displaced prior.
    Fixes(Box<fixes::Args>),
    /// The same frames located without one part of the method after another: what each part brings.
    Ablation(Box<ablation::Args>),
    /// Absolute registration where every fix is false: the rate of false fixes.
    Negatives(Box<negatives::Args>),
    /// Frames whose files were damaged: refused, or located rightly, but never falsely.
    Damage(Box<damage::Args>),
    /// The time of a search against the number of tiles it searches.
    Cost(cost::Args),
    /// Relative registration: pairs of known motion, a real flight, or pairs that share no ground.
    Motions(motions::Args),
    /// Flights in a closed loop with faults of camera, sensors and clock: no position may be falsely sure.
    Sequences(sequences::Args),
}

/// Runs the command.
pub fn run(args: &Evaluate, output: &Output) -> Result<Exit, Failure> {
    match args {
        Evaluate::Fixes(args) => fixes::run(args, output),
        Evaluate::Ablation(args) => ablation::run(args, output),
        Evaluate::Negatives(args) => negatives::run(args, output),
        Evaluate::Damage(args) => damage::run(args, output),
        Evaluate::Cost(args) => cost::run(args, output),
        Evaluate::Motions(args) => motions::run(args, output),
        Evaluate::Sequences(args) => sequences::run(args, output),
    }
}
