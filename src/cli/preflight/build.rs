//! `overfly build`: makes a store from orthophotos.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::number;
use crate::cli::output::Output;
use crate::cli::preflight::interrupt::Interrupt;
use crate::cli::preflight::remedy::explain_rejected;
use crate::today::today;
use indicatif::ProgressBar;
use overfly_core::geodesy::VerticalDatum;
use overfly_ingest::build::{
    self, BuildError, BuildEstimate, BuildSummary, OverriddenCrs, Progress, Rejected, Request, TerrainRequest,
};
use overfly_store::{LayerChange, Reader, StoreError, Terms, change_layer, while_waiting};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Duration;

const HELP: &str = "\
A layer is one epoch of imagery; a store holds any number of layers. Running build again on a layer adds to it, and continues an
interrupted build. Within a layer, newer sources cover older ones; sources without a date count as oldest.

`overfly layer` renames, describes and removes layers. No layer can be called any: `overfly fix --layer any` searches all of them.

Examples:
  overfly build --db map.gpkg photos/ --dry-run
  overfly build --db map.gpkg photos/2018 --layer y2018 --date 2018-07-16 --horizontal-error-m 1.5
  overfly build --db map.gpkg scene_16bit.tif --stretch 0,4000
  overfly build --db map.gpkg --layer y2018 --remove-source photos/2018/old.tif
  overfly build --db map.gpkg --terrain dem.tif --terrain-datum egm2008 --terrain-error-m 3

Exit codes: 0 done; 1 failed, or a source was left out; 2 no usable source.";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store (a GeoPackage); created if it does not exist.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// Orthophotos (GeoTIFF, COG, PNG or JPEG with world file), or folders to search for them. A source whose content has changed
    /// replaces the earlier one at the same path.
    #[arg(value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Layer to build [default: ortho]
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Finest zoom level, 0 to 23, of Web Mercator tiles of 512 px [default: the one that keeps the resolution of the finest source]
    #[arg(long, value_name = "Z", value_parser = clap::value_parser!(u8).range(..=23))]
    zoom: Option<u8>,
    /// Acquisition date of the given sources, YYYY-MM-DD [default: from their metadata, else unknown]
    #[arg(long, value_name = "D")]
    date: Option<String>,
    /// EPSG code of the given sources, as in 32614 or EPSG:32614; overrides their own.
    #[arg(long, value_name = "EPSG", value_parser = number::epsg)]
    crs: Option<u32>,
    /// Sample values shown as black and white; required for samples of more than 8 bits.
    #[arg(long, value_name = "LO,HI", value_parser = number::stretch, allow_hyphen_values = true)]
    stretch: Option<(f64, f64)>,
    /// Position error of the given sources, one standard deviation per axis, metres; it is part of the covariance of every fix made on
    /// them, and never less than the uncertainty of their datum shift (1 m for NAD83). Not stated, it is unknown: fixes then count with
    /// half a pixel, at least 3 m
    #[arg(long, value_name = "M", value_parser = number::metres, allow_hyphen_values = true)]
    horizontal_error_m: Option<f64>,
    /// Heights of the ground: GeoTIFF files in metres, or folders to search for them. Frames are then laid on the relief, and heights
    /// above sea or ellipsoid can be stated. May be repeated, and be built with or without imagery.
    #[arg(long, value_name = "DEM")]
    terrain: Vec<PathBuf>,
    /// What the heights are above: egm96, egm2008 or ellipsoid [default: as the files state it]
    #[arg(long, value_name = "DATUM", value_parser = datum, requires = "terrain")]
    terrain_datum: Option<VerticalDatum>,
    /// One standard deviation of the heights, metres, with what grows and stands on the ground [default: unknown; fixes then count
    /// with 5 m]
    #[arg(long, value_name = "M", value_parser = number::metres, allow_hyphen_values = true, requires = "terrain")]
    terrain_error_m: Option<f64>,
    /// Build the terrain from the given files only.
    #[arg(long, requires = "terrain")]
    replace_terrain: bool,
    /// Licence of the layer's imagery: an SPDX identifier, a name or a URL [default: as the layer has it]
    #[arg(long, value_name = "TEXT")]
    licence: Option<String>,
    /// Whom maps of the layer must name [default: as the layer has it]
    #[arg(long, value_name = "TEXT")]
    attribution: Option<String>,
    /// Threads for warping and encoding [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// State the expected tiles, bytes and time; write nothing.
    #[arg(long)]
    dry_run: bool,
    /// Build the layer from the given sources only.
    #[arg(long)]
    replace_layer: bool,
    /// Remove a source from the layer: its path, or at least 8 digits of its hash. May be repeated.
    #[arg(long, value_name = "SOURCE")]
    remove_source: Vec<String>,
    /// The old spelling of `overfly layer remove --db FILE NAME --yes`.
    #[arg(long, hide = true, conflicts_with_all = ["sources", "remove_source", "replace_layer", "dry_run"])]
    remove_layer: bool,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    if args.remove_layer {
        let layer = args.layer();
        change_layer(&args.db, layer, &LayerChange::Remove)?;
        let removed = serde_json::json!({"db": args.db, "removed_layer": layer});
        output.say(&removed, || format!("{}: layer {layer} removed", args.db.display()));
        return Ok(Exit::Done);
    }
    if args.builds_imagery() {
        let exit = build_layer(&request(args), args, output)?;
        if args.terrain.is_empty() || exit != Exit::Done {
            return Ok(exit);
        }
    }
    build_layer(&terrain(args).request()?, args, output)
}

/// Builds one layer, of imagery or of heights.
fn build_layer(request: &Request, args: &Args, output: &Output) -> Result<Exit, Failure> {
    if request.terrain.is_none() {
        args.other_layers().iter().for_each(|text| output.note(text));
    }
    if args.dry_run {
        let mut estimate = build::dry_run(request)?;
        explain_rejected(&mut estimate.rejected);
        name_rejected(output, &estimate.rejected);
        if request.terrain.is_none() {
            name_undated(output, estimate.undated_sources, estimate.sources);
            name_unknown_errors(output, estimate.unknown_errors, estimate.sources);
        }
        name_overridden_crs(output, &estimate.overridden_crs);
        let size = format!("about {:.1} MB", estimate.estimated_bytes as f64 / 1e6);
        let tiles = estimate.base_tiles + estimate.overview_tiles;
        let warnings = too_fine(estimate.finer_by, tiles, &size).into_iter();
        warnings.chain(coarser(estimate.coarser_by)).for_each(|text| output.note(&text));
        output.say(&estimate, || describe_estimate(&estimate));
        return Ok(exit(&estimate.rejected));
    }
    let bar = output.progress(0, "tiles");
    let interrupt = Interrupt::watch().map_err(|e| Failure::failed("signals", e))?;
    let mut warned = false;
    let mut progress = |state: Progress| {
        if !std::mem::replace(&mut warned, true) {
            let warnings = too_fine(state.finer_by, state.total, "--dry-run states the bytes").into_iter();
            warnings.chain(coarser(state.coarser_by)).for_each(|text| bar.suspend(|| output.note(&text)));
        }
        bar.set_length(state.total as u64);
        bar.set_position(state.done as u64);
        if interrupt.came() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let outcome = waiting(request, (output, &bar, &interrupt), || build::run(request, &mut progress));
    bar.finish_and_clear();
    let mut summary = outcome?;
    explain_rejected(&mut summary.rejected);
    name_rejected(output, &summary.rejected);
    if request.terrain.is_none() {
        name_undated(output, summary.undated_sources, summary.sources);
        name_unknown_errors(output, summary.unknown_errors, summary.sources);
    }
    name_overridden_crs(output, &summary.overridden_crs);
    output.say(&summary, || describe(&summary));
    Ok(exit(&summary.rejected))
}

/// How long another build is waited for without a word.
const SILENT: Duration = Duration::from_secs(1);

/// Runs a build. Says that it waits for another build of the store, and ends that waiting when the user wants so.
fn waiting(
    request: &Request,
    (output, bar, interrupt): (&Output, &ProgressBar, &Interrupt),
    work: impl FnOnce() -> Result<BuildSummary, BuildError>,
) -> Result<BuildSummary, BuildError> {
    let text = format!("waiting for another build of {}", request.db.display());
    let (output, bar, watched) = (*output, bar.clone(), interrupt.clone());
    let mut told = false;
    let on_wait = move |waited| {
        if waited > SILENT && !std::mem::replace(&mut told, true) {
            bar.suspend(|| output.note(&text));
        }
        if watched.came() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    match while_waiting(on_wait, work) {
        Err(BuildError::Store(StoreError::Busy { .. })) if interrupt.came() => Err(BuildError::Cancelled),
        outcome => outcome,
    }
}

impl Args {
    fn layer(&self) -> &str {
        self.layer.as_deref().unwrap_or("ortho")
    }

    /// Whether there is imagery to build, and not only terrain.
    fn builds_imagery(&self) -> bool {
        self.terrain.is_empty() || !self.sources.is_empty() || !self.remove_source.is_empty()
    }

    /// The warning that the build makes one more layer in a store that has others, where no layer is named: the name was forgotten.
    fn other_layers(&self) -> Option<String> {
        let store = Reader::open(&self.db).ok().filter(|_| self.layer.is_none())?;
        let names: Vec<&str> = store.imagery_layers().map(|layer| layer.name.as_str()).collect();
        (!names.is_empty() && !names.contains(&self.layer())).then(|| {
            format!(
                "WARNING: {} has other layers ({}), and this build makes one more, {}: --layer names the layer to build",
                self.db.display(),
                names.join(", "),
                self.layer()
            )
        })
    }
}

fn datum(word: &str) -> Result<VerticalDatum, String> {
    VerticalDatum::parse(word).ok_or_else(|| "expected egm96, egm2008 or ellipsoid".into())
}

fn threads(args: &Args) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    args.threads.map_or_else(cores, usize::from)
}

fn terrain(args: &Args) -> TerrainRequest {
    TerrainRequest {
        db: args.db.clone(),
        sources: args.terrain.clone(),
        vertical_datum: args.terrain_datum,
        vertical_error_m: args.terrain_error_m,
        crs: args.crs.filter(|_| !args.builds_imagery()),
        threads: threads(args),
        replace: args.replace_terrain,
        today: Some(today()),
    }
}

fn request(args: &Args) -> Request {
    Request {
        db: args.db.clone(),
        layer: args.layer().to_owned(),
        sources: args.sources.clone(),
        zoom: args.zoom,
        date: args.date.clone(),
        crs: args.crs,
        stretch: args.stretch,
        horizontal_error_m: args.horizontal_error_m,
        terms: Terms { licence: args.licence.clone(), attribution: args.attribution.clone() },
        threads: threads(args),
        terrain: None,
        replace_layer: args.replace_layer,
        remove_sources: args.remove_source.clone(),
        today: Some(today()),
    }
}

fn exit(rejected: &[Rejected]) -> Exit {
    if rejected.is_empty() { Exit::Done } else { Exit::Failed }
}

/// Most sources per kind of refusal that are named one by one; `--json` lists all.
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
            output.note(&format!("left out [{code}]: {more} more; --json lists them"));
        }
    }
}

fn name_undated(output: &Output, undated: usize, sources: usize) {
    if undated > 0 {
        let order = if undated > 1 { "; their order among themselves is arbitrary" } else { "" };
        let which = match (undated, sources) {
            (_, 1) => "the source has no date and counts".into(),
            (1, _) => format!("1 of {sources} sources has no date and counts"),
            _ => format!("{undated} of {sources} sources have no date and count"),
        };
        output.note(&format!("note: {which} as oldest{order}: set it with --date"));
    }
}

fn name_unknown_errors(output: &Output, unknown: usize, sources: usize) {
    if unknown > 0 {
        let which = if sources == 1 { "the source".into() } else { format!("{unknown} of {sources} sources") };
        output.note(&format!(
            "note: nothing states the position error of {which}, and fixes count with half a pixel, at least 3 m: set it with --horizontal-error-m"
        ));
    }
}

fn name_overridden_crs(output: &Output, overridden: &[OverriddenCrs]) {
    let Some(first) = overridden.first() else { return };
    let more = if overridden.len() > 1 { format!(", and {} more", overridden.len() - 1) } else { String::new() };
    let OverriddenCrs { path, own, given } = first;
    output.note(&format!("note: --crs {given} overrides what {} says: {own}{more}", path.display()));
}

/// Levels finer than the imagery from which a build warns: each level has four times the tiles of the one before.
const TOO_FINE: u8 = 2;

/// The warning that a zoom is much finer than the imagery: `None` where it is not.
fn too_fine(finer_by: u8, tiles: usize, size: &str) -> Option<String> {
    (finer_by >= TOO_FINE).then(|| {
        format!(
            "WARNING: the zoom is {finer_by} levels finer than the imagery, which makes about {} times as many tiles and adds no detail: {tiles} tiles, {size}; without --zoom the resolution of the imagery is kept",
            4f64.powi(i32::from(finer_by))
        )
    })
}

/// The warning that the finest levels of the layer are removed: `None` where they are not.
fn coarser(levels: u8) -> Option<String> {
    let finest = if levels == 1 { "its finest level".into() } else { format!("its {levels} finest levels") };
    (levels > 0).then(|| {
        format!(
            "WARNING: the zoom is coarser than the layer has been: the build removes {finest}, and the detail there; a build with the finer --zoom makes them again"
        )
    })
}

/// A number of sources as text.
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
