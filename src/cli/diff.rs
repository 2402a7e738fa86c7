//! `overfly diff`: compares two stores and writes the patch between them.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use overfly_store::Reader;
use overfly_store::package::{Difference, diff, write_patch};
use std::path::PathBuf;

const HELP: &str = "\
Compares finished layers tile by tile. With --out, writes the patch that turns OLD into NEW: for each tile that differs, only the
parts that differ (imagery, descriptors, cells, metadata). If NEW is an exported store, the patch also holds its manifest, seal and
signature, and `overfly apply` makes the same file, byte for byte. Equal stores give equal patches.

Examples:
  overfly diff spring.gpkg summer.gpkg
  overfly diff flight-1.gpkg flight-2.gpkg --out flight-1-2.patch";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The old store.
    #[arg(value_name = "OLD")]
    old: PathBuf,
    /// The new store.
    #[arg(value_name = "NEW")]
    new: PathBuf,
    /// Write the patch to this file.
    #[arg(long, value_name = "PATCH")]
    out: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let (old, new) = (Reader::open(&args.old)?, Reader::open(&args.new)?);
    let found = match &args.out {
        None => diff(&old, &new)?,
        Some(out) => output.during("tiles", |tell| write_patch(&old, &new, out, tell))?,
    };
    output.say(&found, || text(args, &found));
    Ok(Exit::Done)
}

fn text(args: &Args, found: &Difference) -> String {
    let mut text = String::from("layer                   added  changed  removed     same\n");
    for layer in &found.layers {
        let row = format!(
            "{:<20} {:>8} {:>8} {:>8} {:>8}\n",
            layer.layer, layer.added, layer.changed, layer.removed, layer.same
        );
        text.push_str(&row);
    }
    text.push_str(&match (&args.out, found.patch_bytes) {
        (Some(out), Some(bytes)) => {
            format!("{}: {bytes} bytes; the new store takes {}", out.display(), found.result_bytes)
        }
        _ if found.base == found.result && found.other_manifest => {
            "the stores hold the same tiles; their manifests differ (route, last day, signer), or only one is exported"
                .to_owned()
        }
        _ if found.base == found.result => {
            "the stores have the same digests; `overfly verify` checks that their content is intact".to_owned()
        }
        _ => format!("digest {} becomes {}", found.base, found.result),
    });
    text
}
