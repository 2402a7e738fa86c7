//! `overfly merge`: stores that were built apart, as one.

use super::{Exit, Failure, Output};
use overfly_ingest::build::{Conflict, MergeRequest, Merged, merge};
use std::path::PathBuf;

const HELP: &str = "\
Layers of different names stand side by side. A layer that several stores have becomes one of all their sources: a tile that only
one has, or that is the same in all, is taken as it is; else one store's pixels cover and the others fill what it does not show, and
overviews above are made anew. No orthophoto is read. Where the sources of one store are all newer than the other's, and along the
edges of areas that were built apart, that is what one build of all would have made, and a later `overfly build` knows it; other
tiles it makes anew, where it has the orthophotos.

Examples:
  overfly merge north.gpkg south.gpkg --out country.gpkg
  overfly merge 2018.gpkg 2020.gpkg --out both.gpkg --on-conflict refuse";

/// Which store covers, as the command line spells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Covers {
    /// The one with the newer source there, as within a build; unknown dates are the oldest.
    Newest,
    /// The one that is named first.
    First,
    /// None: refuse stores whose tiles differ.
    Refuse,
}

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The stores.
    #[arg(value_name = "STORE", required = true, num_args = 2..)]
    stores: Vec<PathBuf>,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Which store covers where tiles of one layer differ.
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
    let mut text = String::from("layer                  stores    taken  blended  overviews made anew\n");
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
