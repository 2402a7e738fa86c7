//! `overfly keygen`: a pair of keys to sign stores with.

use super::{Exit, Failure, Output};
use overfly_store::package::generate;
use std::path::PathBuf;

const HELP: &str = "\
Writes KEY (PKCS#8 PEM, readable by its owner alone: it signs) and KEY.pub (SPKI PEM: it verifies), both Ed25519 and as
OpenSSL writes them. Nothing is overwritten.

Examples:
  overfly keygen --out ground.key
  overfly export ... --sign ground.key
  overfly verify flight.gpkg --key ground.key.pub
  overfly serve --db flight.gpkg --onboard --require-signature ground.key.pub";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The secret key's file; the public key goes beside it, .pub behind its name.
    #[arg(long, value_name = "KEY")]
    out: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let (public_path, public) = generate(&args.out)?;
    let json = serde_json::json!({"key": args.out, "public_key": public_path, "public_key_hex": public.to_hex()});
    output.say(&json, || {
        format!("{} (keep it secret) and {} ({})", args.out.display(), public_path.display(), public.to_hex())
    });
    Ok(Exit::Done)
}
