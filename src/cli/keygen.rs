//! `overfly keygen`: makes a pair of keys to sign stores with.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use overfly_store::package::generate;
use std::path::PathBuf;

const HELP: &str = "\
Writes an Ed25519 key pair in the formats of OpenSSL: KEY signs (PKCS#8 PEM, readable only by its owner), KEY.pub verifies
(SPKI PEM). Existing files are not overwritten.

Examples:
  overfly keygen --out ground.key
  overfly export ... --serial 1 --sign ground.key
  overfly verify flight.gpkg --key ground.key.pub
  overfly serve --db flight.gpkg --onboard --require-signature ground.key.pub";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The file for the secret key; the public key is written beside it, with .pub appended to the name.
    #[arg(long, value_name = "KEY")]
    out: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let (public_path, public) = generate(&args.out)?;
    let json = serde_json::json!({"key": args.out, "public_key": public_path, "public_key_hex": public.to_hex()});
    output.say(&json, || {
        let (secret, public_path) = (args.out.display(), public_path.display());
        format!(
            "{secret} (keep it secret) and {public_path} ({})\nfingerprint {}",
            public.to_hex(),
            public.fingerprint()
        )
    });
    Ok(Exit::Done)
}
