//! `overfly layer rename`: gives a layer another name.

use super::outcome::Outcome;
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use overfly_store::{LayerChange, change_layer, preview_layer_change};
use std::path::PathBuf;

const HELP: &str = "\
The name is part of every hash of the layer: the digest changes, and a patch from an older export holds all its tiles. No tile is
computed again, and a later `overfly build --layer NEW` goes on from there.

Example:
  overfly layer rename --db map.gpkg ortho y2018 --dry-run";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store, as it was built.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// The layer.
    #[arg(value_name = "OLD")]
    old: String,
    /// Its new name: 1 to 40 of the characters a-z 0-9 _ -.
    #[arg(value_name = "NEW")]
    new: String,
    /// State what would change; write nothing.
    #[arg(long)]
    dry_run: bool,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let change = LayerChange::Rename { to: args.new.clone() };
    let changed = if args.dry_run {
        preview_layer_change(&args.db, &args.old, &change)?
    } else {
        change_layer(&args.db, &args.old, &change)?
    };
    let outcome = Outcome::new("rename", &args.db, &args.old, args.dry_run, changed).renamed_to(&args.new);
    outcome.say(output, &format!("its name is now {}", args.new), &format!("its name would be {}", args.new));
    Ok(Exit::Done)
}
