//! `overfly apply`: the new store from the old one and a patch.

use super::verify::today;
use super::{Exit, Failure, Output};
use overfly_store::package::{Applied, ApplyRequest, PublicKey, apply};
use std::path::PathBuf;

const HELP: &str = "\
The patch is one of `overfly diff OLD NEW --out PATCH`, and STORE holds what OLD held: any other is refused by its digest. The new
store is written beside STORE (so there must be room for both), held against the digest that the patch states (of an exported store
that of the whole file), and renamed into place. Whatever happens on the way, STORE is the old one or the new one. Applied once
more, nothing changes.

A patch proves nothing of who made it: give --key where stores are signed. Without it a signed STORE is replaced only by one that
the same key signed.

Examples:
  overfly apply flight.gpkg flight-1-2.patch --key ground.key.pub
  overfly apply map.gpkg spring-summer.patch --out summer.gpkg";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The old store; replaced unless --out is given.
    #[arg(value_name = "STORE")]
    store: PathBuf,
    /// The patch.
    #[arg(value_name = "PATCH")]
    patch: PathBuf,
    /// Write the new store to this file, and leave STORE as it is.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Refuse the new store unless it is signed by this public key.
    #[arg(long, value_name = "PUB")]
    key: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let key = args.key.as_deref().map(PublicKey::read).transpose()?;
    let out = args.out.as_ref().unwrap_or(&args.store);
    let request = ApplyRequest { store: &args.store, patch: &args.patch, out, key: key.as_ref(), today: today() };
    let applied = output.during("tiles", |tell| apply(&request, tell))?;
    output.say(&applied, || text(&request, &applied));
    Ok(Exit::Done)
}

fn text(request: &ApplyRequest<'_>, applied: &Applied) -> String {
    let place = request.out.display();
    if !applied.changed {
        return format!("{place}: is what the patch makes already, digest {}", applied.digest);
    }
    let signed = applied.signed_by.as_ref().map_or("not signed".into(), |key| format!("signed by {key}"));
    format!(
        "{place}: {} tiles kept, {} of the patch; {} bytes, digest {}, {signed}",
        applied.kept_tiles, applied.patched_tiles, applied.bytes, applied.digest
    )
}
