//! `overfly sign`: signs an export that was made without a key.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::mission_text::mission_text;
use crate::cli::output::Output;
use crate::cli::replaced::newer_note;
use crate::today::today;
use overfly_store::package::{SecretKey, sign, stated_serial};
use std::path::PathBuf;

const HELP: &str = "\
For exports that are made where the key is not: over HTTP, or by another person. Every byte of STORE is checked first. The result is
byte for byte what `overfly export --sign` writes. An export that is signed already, or past its last day, is refused.

Example:
  overfly sign flight.gpkg --key ground.key --out flight-signed.gpkg";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The export, unsigned.
    #[arg(value_name = "STORE")]
    store: PathBuf,
    /// The secret key to sign with (see `overfly keygen`).
    #[arg(long, value_name = "KEY")]
    key: PathBuf,
    /// The file to write; an export there is replaced, a map is not.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let key = SecretKey::read(&args.key)?;
    if let Some(note) = newer_note(&args.out, stated_serial(&args.out), stated_serial(&args.store)) {
        output.note(&format!("WARNING: {note}"));
    }
    let signed = output.during("tiles", |tell| sign(&args.store, &key, &args.out, today(), tell))?;
    output.say(&signed, || {
        let out = args.out.display();
        let mission = mission_text(signed.name.as_deref(), signed.serial, signed.valid_until.as_deref());
        format!("{out}: {mission}{} bytes, digest {}, signed by {}", signed.bytes, signed.digest, signed.signed_by)
    });
    Ok(Exit::Done)
}
