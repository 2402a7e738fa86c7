//! `overfly verify`: every hash, the digest, the SQLite and GeoPackage rules.

use super::{Exit, Failure, Output};
use overfly::store::{Verification, verify};
use std::path::PathBuf;

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// The store.
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let bar = output.progress(0, "tiles");
    let outcome = verify(&args.file, &|done, total| {
        bar.set_length(total);
        bar.set_position(done);
    });
    bar.finish_and_clear();
    let found = outcome.map_err(|e| {
        let exit = if e.is_unusable_input() { Exit::Unusable } else { Exit::NoFix };
        Failure { exit, code: e.code(), error: e.into() }
    })?;
    output.say(&found, || describe(args, &found));
    Ok(if found.ok { Exit::Done } else { Exit::NoFix })
}

fn describe(args: &Args, found: &Verification) -> String {
    let file = args.file.display();
    if found.ok {
        return format!("{file}: good: {} tiles, digest {}", found.tiles, found.digest);
    }
    let remedy = if found.bad_tiles.is_empty() { "" } else { "; restore it from a copy or build it anew" };
    let mut text = format!("{file}: NOT good{remedy}");
    for problem in &found.problems {
        text.push_str(&format!("\n  {problem}"));
    }
    for tile in &found.bad_tiles {
        text.push_str(&format!("\n  tile {} of layer {}: {}", tile.id, tile.layer, tile.reason));
    }
    text
}
