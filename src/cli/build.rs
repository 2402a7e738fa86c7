//! `overfly build`: orthophotos into a store.

use super::{Exit, Failure, Output};
use overfly::build::{self, BuildError, Estimate, Progress, Rejected, Request, Summary};
use overfly::store::remove_layer;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// The store (a GeoPackage); made where there is none.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// Orthophotos (GeoTIFF, COG, PNG or JPEG with world file), or folders to walk. The newest covers. A source at the
    /// same path with other content replaces the old one.
    #[arg(value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Layer: one epoch of imagery.
    #[arg(long, default_value = "ortho", value_name = "NAME")]
    layer: String,
    /// Base zoom [default: what keeps the finest source's resolution]
    #[arg(long, value_name = "Z")]
    zoom: Option<u8>,
    /// Acquisition date of the given sources, YYYY-MM-DD [default: their metadata's, else unknown, the oldest]
    #[arg(long, value_name = "D")]
    date: Option<String>,
    /// EPSG code of the given sources, over what they say.
    #[arg(long, value_name = "EPSG")]
    crs: Option<u32>,
    /// Values shown as black and white; needed for more than 8 bits.
    #[arg(long, value_name = "LO,HI", value_parser = parse_stretch, allow_hyphen_values = true)]
    stretch: Option<(f64, f64)>,
    /// One standard deviation per axis of the given sources' positions, added to every fix made on them [default: 0]
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
        let estimate = build::dry_run(&request).map_err(fail)?;
        name_rejected(output, &estimate.rejected);
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
    let summary = outcome.map_err(fail)?;
    name_rejected(output, &summary.rejected);
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

fn fail(error: BuildError) -> Failure {
    let code = error.code();
    if error.is_unusable_input() { Failure::unusable(code, error) } else { Failure::failed(code, error) }
}

fn exit(rejected: &[Rejected]) -> Exit {
    if rejected.is_empty() { Exit::Done } else { Exit::Failed }
}

fn name_rejected(output: &Output, rejected: &[Rejected]) {
    for one in rejected {
        output.note(&format!("left out [{}]: {}", one.code, one.message));
    }
}

fn describe(summary: &Summary) -> String {
    let Summary { layer, sources, tiles, computed_tiles, kept_tiles, removed_tiles, .. } = summary;
    let rate = summary.source_megapixels / summary.elapsed_s.max(1e-3);
    format!(
        "{}: layer {layer} of {sources} sources, {tiles} tiles at zoom {} to {}\n\
         {computed_tiles} computed, {kept_tiles} kept, {removed_tiles} removed in {:.1} s ({rate:.1} source megapixels/s)\n\
         {:.1} MB, digest {}",
        summary.db.display(),
        summary.min_zoom,
        summary.base_zoom,
        summary.elapsed_s,
        summary.bytes as f64 / 1e6,
        summary.digest,
    )
}

fn describe_estimate(estimate: &Estimate) -> String {
    let Estimate { layer, sources, base_tiles, overview_tiles, kept_tiles, removed_tiles, .. } = estimate;
    format!(
        "layer {layer} of {sources} sources at zoom {} to {}\n\
         to compute: {base_tiles} base tiles and {overview_tiles} overviews; {kept_tiles} kept, {removed_tiles} removed\n\
         about {:.1} MB and {:.1} s; nothing was written",
        estimate.min_zoom,
        estimate.base_zoom,
        estimate.estimated_bytes as f64 / 1e6,
        estimate.estimated_s,
    )
}

fn parse_stretch(text: &str) -> Result<(f64, f64), String> {
    let expected = "two numbers LO,HI, as in 0,4000";
    let (low, high) = text.split_once(',').ok_or(expected)?;
    let number = |part: &str| part.trim().parse::<f64>().map_err(|_| expected.to_owned());
    Ok((number(low)?, number(high)?))
}
