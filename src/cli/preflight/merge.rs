//! `overfly merge`: makes one store from stores that were built separately.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use overfly_ingest::build::{Conflict, MergeRequest, Merged, merge};
use std::path::PathBuf;

const HELP: &str = "\
Layers with different names are kept side by side. A layer that several stores have becomes one layer of all their sources: a tile that
only one store has, or that is equal in all, is copied; otherwise the pixels of one store cover, the others fill the gaps, and the
overviews above are computed again. No orthophoto is read. If all sources of one store are newer than those of the other, and along the
edges of separately built areas, the result equals one build of all sources, and a later `overfly build` keeps it. A later build computes
the other tiles again, if it has the orthophotos.

Examples:
  overfly merge north.gpkg south.gpkg --out country.gpkg
  overfly merge 2018.gpkg 2020.gpkg --out both.gpkg --on-conflict refuse";

/// Which store covers the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Covers {
    /// The one with the newer source at that tile, as in a build; unknown dates count as oldest.
    Newest,
    /// The one that is given first.
    First,
    /// None: stores whose tiles differ are refused.
    Refuse,
}

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The stores to merge.
    #[arg(value_name = "STORE", required = true, num_args = 2..)]
    stores: Vec<PathBuf>,
    /// The file to write; no store there is replaced.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Which store covers if tiles of one layer differ.
    #[arg(long, value_name = "RULE", default_value = "newest")]
    on_conflict: Covers,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let conflict = match args.on_conflict {
        Covers::Newest => Conflict::Newest,
        Covers::First => Conflict::First,
        Covers::Refuse => Conflict::Refuse,
    };
    let request = MergeRequest { stores: args.stores.clone(), out: args.out.clone(), conflict };
    let merged = output.during("tiles", |tell| merge(&request, tell))?;
    output.say(&merged, || text(args, &merged));
    Ok(Exit::Done)
}

fn text(args: &Args, merged: &Merged) -> String {
    let mut text = String::from("layer                  stores    taken  blended      remade overviews\n");
    for layer in &merged.layers {
        let row = format!(
            "{:<20} {:>8} {:>8} {:>8} {:>20}\n",
            layer.layer, layer.stores, layer.taken_tiles, layer.blended_tiles, layer.remade_overviews
        );
        text.push_str(&row);
    }
    text.push_str(&format!("{}: {} bytes, digest {}", args.out.display(), merged.bytes, merged.digest));
    text
}
