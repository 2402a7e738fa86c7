//! `overfly verify`: every hash, the digests, the signature, the SQLite and GeoPackage rules.

use super::remedy::spell;
use super::{Exit, Failure, Output};
use overfly_store::package::{Date, PackageVerification, PublicKey, VerifyOptions, utc_day, verify_package};
use std::path::PathBuf;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

const HELP: &str = "\
Of an exported store: the digest of the whole file (so that no byte is outside), its seal, manifest and signature, its last day,
and every footprint. Where the file's digest is wrong, or with --every-tile, and of any other store: every tile by itself, the
indexes, and the rules of SQLite and GeoPackage; the first wrong tile is named first, and all others after it.

Exit codes: 0 good, 2 no store at all, 3 not good.

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
    /// The public key of who must have signed it (see `overfly keygen`).
    #[arg(long, value_name = "PUB")]
    key: Option<PathBuf>,
    /// Read every tile by itself even where the whole file's digest is right.
    #[arg(long)]
    every_tile: bool,
}

/// This day by the system's clock, UTC.
pub fn today() -> Date {
    // A clock before 1970 is as wrong as one in 1970.
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    utc_day(i64::try_from(since.as_secs()).unwrap_or(i64::MAX))
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
        Failure { exit, code: e.code(), error: e.into() }
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
