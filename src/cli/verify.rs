//! `overfly verify`: checks every hash, the digests, the signature, and the rules of SQLite and GeoPackage.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::remedy::spell;
use crate::cli::today::today;
use overfly_store::package::{PackageVerification, PublicKey, VerifyOptions, verify_package};
use std::path::PathBuf;
use std::time::Instant;

const HELP: &str = "\
For an exported store, checks the digest of the whole file (every byte counts), the seal, manifest and signature, the last day, and
every footprint. If the file's digest is wrong, with --every-tile, and for a store that is not exported, also checks every tile by
itself, the indexes, and the rules of SQLite and GeoPackage; then all damaged tiles are listed.

Exit codes: 0 good, 2 not a store, 3 damaged or not verified.

Examples:
  overfly verify map.gpkg
  overfly verify flight.gpkg --key ground.key.pub";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The public key that must verify the signature (see `overfly keygen`).
    #[arg(long, value_name = "PUB")]
    key: Option<PathBuf>,
    /// Check every tile by itself even if the digest of the whole file is right.
    #[arg(long)]
    every_tile: bool,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let key = args.key.as_deref().map(PublicKey::read).transpose()?;
    let options = VerifyOptions { key: key.as_ref(), today: today(), every_tile: args.every_tile };
    let start = Instant::now();
    let outcome = output.during("", |tell| verify_package(&args.file, &options, tell));
    let elapsed_s = start.elapsed().as_secs_f64();
    let found = outcome.map_err(|e| {
        let exit = if e.is_unusable_input() { Exit::Unusable } else { Exit::NoFix };
        let remedy = e.remedy().map(|remedy| spell(remedy).to_owned());
        Failure { exit, code: e.code(), error: e.into(), remedy }
    })?;
    let mut json = serde_json::to_value(&found).expect("results serialise");
    json["elapsed_s"] = elapsed_s.into();
    output.say(&json, || describe(args, &found));
    Ok(if found.store.ok { Exit::Done } else { Exit::NoFix })
}

fn describe(args: &Args, found: &PackageVerification) -> String {
    let (file, store) = (args.file.display(), &found.store);
    if store.ok {
        let exported = match (&found.signed_by, found.sealed) {
            (Some(key), _) => format!(", whole file, signed by {key}"),
            (None, true) => ", whole file, not signed".into(),
            (None, false) => String::new(),
        };
        return format!("{file}: good: {} tiles, digest {}{exported}", store.tiles, store.digest);
    }
    let code = found.code.unwrap_or("damaged_store");
    let remedy = found.remedy.map(|remedy| format!("; {}", spell(remedy))).unwrap_or_default();
    let mut text = format!("{file}: NOT good [{code}]{remedy}");
    for problem in &store.problems {
        text.push_str(&format!("\n  {problem}"));
    }
    for (index, tile) in store.bad_tiles.iter().enumerate() {
        let first = if index == 0 { "first wrong: " } else { "" };
        text.push_str(&format!("\n  {first}tile {} of layer {}: {}", tile.id, tile.layer, tile.reason));
    }
    text
}
