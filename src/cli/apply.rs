//! `overfly apply`: makes the new store from the old one and a patch.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::mission_text::mission_text;
use crate::cli::output::Output;
use crate::cli::replaced::newer_note;
use crate::today::today;
use overfly_store::package::{Applied, ApplyRequest, PublicKey, apply, stated_serial};
use std::path::PathBuf;

const HELP: &str = "\
PATCH comes from `overfly diff OLD NEW --out PATCH`. STORE must hold what OLD held; its digest is checked. The new store is written
beside STORE (there must be room for both), compared with the digest that the patch states (for an exported store: the digest of the
whole file), and renamed into place. If the command is interrupted, STORE is still either the old one or the new one. Applying a patch
twice changes nothing. A map that was built is not made an export in place: write that to another file with --out.

A patch does not prove who made it. If stores are signed, give --key. Without --key, a signed STORE can be replaced only by a store
that the same key signed.

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
    /// Write the new store to this file and leave STORE unchanged.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Refuse the new store unless this public key verifies its signature.
    #[arg(long, value_name = "PUB")]
    key: Option<PathBuf>,
    /// Accept a new store whose serial is lower than that of the old one: to go back on purpose.
    #[arg(long)]
    allow_older: bool,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let key = args.key.as_deref().map(PublicKey::read).transpose().map_err(Failure::of_crew)?;
    let out = args.out.as_ref().unwrap_or(&args.store);
    let request = ApplyRequest {
        store: &args.store,
        patch: &args.patch,
        out,
        key: key.as_ref(),
        today: today(),
        allow_older: args.allow_older,
    };
    let before = args.out.as_deref().and_then(stated_serial);
    let applied = output.during("tiles", |tell| apply(&request, tell)).map_err(Failure::of_crew)?;
    if let Some(note) = newer_note(out, before, applied.serial) {
        output.note(&format!("WARNING: {note}"));
    }
    output.say(&applied, || text(&request, &applied));
    Ok(Exit::Done)
}

fn text(request: &ApplyRequest<'_>, applied: &Applied) -> String {
    let place = request.out.display();
    if !applied.changed {
        return format!("{place}: already up to date, digest {}", applied.digest);
    }
    let signed = applied.signed_by.as_ref().map_or("not signed".into(), |key| format!("signed by {key}"));
    let mission = mission_text(None, applied.serial, None);
    format!(
        "{place}: {mission}{} tiles kept, {} from the patch; {} bytes, digest {}, {signed}",
        applied.kept_tiles, applied.patched_tiles, applied.bytes, applied.digest
    )
}
