//! `overfly build`: orthophotos into a store.

use super::ingest_remedy::explain_rejected;
use super::{Exit, Failure, Output, number};
use overfly_ingest::build::{self, BuildError, BuildEstimate, BuildSummary, Progress, Rejected, Request};
use overfly_store::remove_layer;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;

const HELP: &str = "\
A layer is one epoch of imagery; a store holds as many as you like. Running build again on a layer adds to it, and goes
on where a stopped build ended. Within a layer the newest source covers; those without a date lie lowest.

Examples:
  overfly build --db map.gpkg photos/ --dry-run
  overfly build --db map.gpkg photos/2018 --layer y2018 --date 2018-07-16 --horizontal-error-m 1.5
  overfly build --db map.gpkg scene_16bit.tif --stretch 0,4000
  overfly build --db map.gpkg --layer y2018 --remove-source photos/2018/old.tif

Exit codes: 0 done; 1 failed, or a source was left out; 2 nothing usable.";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store (a GeoPackage); made where there is none.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// Orthophotos (GeoTIFF, COG, PNG or JPEG with world file), or folders to walk. A source at the same path with
    /// other content replaces the old one.
    #[arg(value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Layer to build.
    #[arg(long, default_value = "ortho", value_name = "NAME")]
    layer: String,
    /// Finest zoom level, of Web Mercator tiles of 512 px, 0 to 23 [default: what keeps the finest source's resolution]
    #[arg(long, value_name = "Z")]
    zoom: Option<u8>,
    /// Acquisition date of the given sources, YYYY-MM-DD [default: their metadata's, else unknown, the oldest]
    #[arg(long, value_name = "D")]
    date: Option<String>,
    /// EPSG code of the given sources, over what they say.
    #[arg(long, value_name = "EPSG")]
    crs: Option<u32>,
    /// Values shown as black and white; needed where a sample has more than 8 bits.
    #[arg(long, value_name = "LO,HI", value_parser = number::stretch, allow_hyphen_values = true)]
    stretch: Option<(f64, f64)>,
    /// One standard deviation per axis, metres, of the given sources' positions, part of every fix made on them; never less than what the shift of their datum leaves open (1 m for NAD83) [default: that]
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    horizontal_error_m: Option<f64>,
    /// Threads that warp and encode [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Say tiles, bytes and time, and write nothing.
    #[arg(long)]
    dry_run: bool,
    /// Make the layer of the given sources only.
    #[arg(long)]
    replace_layer: bool,
    /// Take a source out of the layer: its path, or 8 or more digits of its hash. May be repeated.
    #[arg(long, value_name = "SOURCE")]
    remove_source: Vec<String>,
    /// Take the whole layer out of the store.
    #[arg(long, conflicts_with_all = ["sources", "remove_source", "replace_layer", "dry_run"])]
    remove_layer: bool,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    if args.remove_layer {
        remove_layer(&args.db, &args.layer).map_err(|e| fail(BuildError::Store(e)))?;
        let removed = serde_json::json!({"db": args.db, "removed_layer": args.layer});
        output.say(&removed, || format!("{}: layer {} removed", args.db.display(), args.layer));
        return Ok(Exit::Done);
    }
    let request = request(args);
    if args.dry_run {
        let mut estimate = build::dry_run(&request).map_err(fail)?;
        explain_rejected(&mut estimate.rejected);
        name_rejected(output, &estimate.rejected);
        name_undated(output, estimate.undated_sources, estimate.sources);
        output.say(&estimate, || describe_estimate(&estimate));
        return Ok(exit(&estimate.rejected));
    }
    let bar = output.progress(0, "tiles");
    let mut progress = |state: Progress| {
        bar.set_length(state.total as u64);
        bar.set_position(state.done as u64);
        ControlFlow::Continue(())
    };
    let outcome = build::run(&request, &mut progress);
    bar.finish_and_clear();
    let mut summary = outcome.map_err(fail)?;
    explain_rejected(&mut summary.rejected);
    name_rejected(output, &summary.rejected);
    name_undated(output, summary.undated_sources, summary.sources);
    output.say(&summary, || describe(&summary));
    Ok(exit(&summary.rejected))
}

fn request(args: &Args) -> Request {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    Request {
        db: args.db.clone(),
        layer: args.layer.clone(),
        sources: args.sources.clone(),
        zoom: args.zoom,
        date: args.date.clone(),
        crs: args.crs,
        stretch: args.stretch,
        horizontal_error_m: args.horizontal_error_m,
        threads: args.threads.map_or_else(cores, usize::from),
        replace_layer: args.replace_layer,
        remove_sources: args.remove_source.clone(),
    }
}

fn fail(mut error: BuildError) -> Failure {
    if let BuildError::NothingUsable { rejected } = &mut error {
        explain_rejected(rejected);
    }
    let code = error.code();
    if error.is_unusable_input() { Failure::unusable(code, error) } else { Failure::failed(code, error) }
}

fn exit(rejected: &[Rejected]) -> Exit {
    if rejected.is_empty() { Exit::Done } else { Exit::Failed }
}

/// Sources left out that are named one by one, of each kind; `--json` lists all.
const NAMED: usize = 3;

fn name_rejected(output: &Output, rejected: &[Rejected]) {
    let mut by_code: BTreeMap<&str, Vec<&Rejected>> = BTreeMap::new();
    for one in rejected {
        by_code.entry(one.code).or_default().push(one);
    }
    for (code, these) in by_code {
        for one in these.iter().take(NAMED) {
            output.note(&format!("left out [{code}]: {}", one.message));
        }
        if let Some(more) = these.len().checked_sub(NAMED).filter(|&more| more > 0) {
            output.note(&format!("left out [{code}]: {more} more, which --json lists"));
        }
    }
}

fn name_undated(output: &Output, undated: usize, sources: usize) {
    if undated > 0 {
        let order = if undated > 1 { "; among themselves their order says nothing of their age" } else { "" };
        let which = if sources == 1 { "the source has".into() } else { format!("{undated} of {sources} sources have") };
        output.note(&format!("note: {which} no date, which counts as oldest{order}: give each its --date"));
    }
}

/// A number of sources for people.
fn sources_text(sources: usize) -> String {
    if sources == 1 { "1 source".into() } else { format!("{sources} sources") }
}

fn describe(summary: &BuildSummary) -> String {
    let BuildSummary { layer, sources, tiles, computed_tiles, kept_tiles, removed_tiles, .. } = summary;
    let sources = sources_text(*sources);
    let rate = match summary.source_megapixels / summary.elapsed_s.max(1e-3) {
        rate if *computed_tiles > 0 && rate > 0.0 => format!(" ({rate:.1} source megapixels/s)"),
        _ => String::new(),
    };
    format!(
        "{}: layer {layer} of {sources}, {tiles} tiles at zoom {} to {}\n\
         {computed_tiles} computed, {kept_tiles} kept, {removed_tiles} removed in {:.1} s{rate}\n\
         {:.1} MB, digest {}",
        summary.db.display(),
        summary.min_zoom,
        summary.base_zoom,
        summary.elapsed_s,
        summary.bytes as f64 / 1e6,
        summary.digest,
    )
}

fn describe_estimate(estimate: &BuildEstimate) -> String {
    let BuildEstimate { layer, sources, base_tiles, overview_tiles, kept_tiles, removed_tiles, .. } = estimate;
    let sources = sources_text(*sources);
    format!(
        "layer {layer} of {sources} at zoom {} to {}\n\
         to compute: {base_tiles} base tiles and {overview_tiles} overviews; {kept_tiles} kept, {removed_tiles} removed\n\
         about {:.1} MB and {:.1} s; nothing was written",
        estimate.min_zoom,
        estimate.base_zoom,
        estimate.estimated_bytes as f64 / 1e6,
        estimate.estimated_s,
    )
}
