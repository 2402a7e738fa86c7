//! `overfly demo`: the whole of it on the project's own tiles, in under two minutes.

mod flown;

use super::evaluate::{default_right_m, fix_text};
use super::ingest_remedy::explain_rejected;
use super::{Exit, Failure, Output, default_threads};
use anyhow::{Context, anyhow};
use overfly_flight::frame::read_colour_frame;
use overfly_ingest::build;
use overfly_lab::report::{FlightReport, Mosaic};
use overfly_lab::trial::{FixOutcome, FixScore, FixTrial, FlyScore, RecordedFlight, write_fixes};
use overfly_store::{Layer, Reader};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

const TITLE: &str = "overfly: a flight located without GPS";
const LAYER: &str = "ortho";
const PRIOR_ERROR_M: f64 = 500.0;
const SEED: u64 = 1;
/// Frames shown beside the map.
const SHOWN: usize = 4;

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// Where store, fixes and report go.
    #[arg(long, value_name = "DIR", default_value = "overfly-demo")]
    out: PathBuf,
    /// The project's tiles/ folder [default: the one of the sources that this program was built from].
    #[arg(long, value_name = "DIR")]
    tiles: Option<PathBuf>,
    /// Threads to build and search with.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
}

/// What the demo prints at last.
#[derive(Serialize)]
struct Summary<'a> {
    #[serde(flatten)]
    score: &'a FixScore,
    db: &'a Path,
    report: &'a Path,
    /// The same flight in a closed loop, an object per mode.
    flown: &'a [FlyScore],
    flown_report: &'a Path,
    build_s: f64,
    total_s: f64,
}

/// Runs the command; exit code 1 where a fix is false.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let started = Instant::now();
    let tiles = project_tiles(args.tiles.as_deref())?;
    std::fs::create_dir_all(&args.out)
        .with_context(|| format!("cannot make the folder {}", args.out.display()))
        .map_err(|e| Failure::failed("unwritable", e))?;
    let db = args.out.join("demo.gpkg");

    output.note(&format!("building {} from {}", db.display(), tiles.join("epoch_1").display()));
    let built = build_store(&db, &tiles, args.threads.get(), output)?;
    let store = Reader::open(&db)?;
    let layer = store.layer(LAYER)?;

    let flight = RecordedFlight::read(&tiles.join("flight"))?;
    output
        .note(&format!("locating {} frames, each prior off by up to {PRIOR_ERROR_M} m per axis", flight.frames.len()));
    let outcomes = locate_frames(&store, &flight, args.threads.get(), output)?;
    let score = FixScore::from_outcomes(&outcomes, default_right_m(&store, layer)?, args.threads.get());
    write_fixes(&args.out, &outcomes)?;

    let page = args.out.join("report.html");
    let mosaic = map_of(&store, layer)?;
    write(&page, &page_of(&mosaic, &flight, &outcomes, &score, &facts(&store, layer, &built))?)?;

    output.note("flying it in a closed loop: sequential, parallel, combined");
    let right_m = score.right_m;
    let flown = flown::fly(&store, &flight, right_m, args.threads.get(), output)?;
    let flown_page = args.out.join("flown.html");
    write(&flown_page, &flown.page(&mosaic))?;
    let total_s = started.elapsed().as_secs_f64();
    let summary = Summary {
        score: &score,
        db: &db,
        report: &page,
        flown: &flown.scores,
        flown_report: &flown_page,
        build_s: built.elapsed_s,
        total_s,
    };
    output.say(&summary, || {
        format!(
            "{}\n{}store      {} tiles, {:.1} MB, {} made and {} kept in {:.1} s\nreport     {}\n           {}\nall        {total_s:.1} s",
            fix_text(&score),
            flown.text(),
            built.tiles,
            built.bytes as f64 / 1e6,
            built.computed_tiles,
            built.kept_tiles,
            built.elapsed_s,
            page.display(),
            flown_page.display()
        )
    });
    let is_false = score.wrong > 0 || flown.scores.iter().any(|s| s.wrong > 0);
    Ok(if is_false { Exit::Failed } else { Exit::Done })
}

/// The given tiles/ folder, or that of the sources that this program was built from.
pub fn project_tiles(given: Option<&Path>) -> Result<PathBuf, Failure> {
    let tiles = given.map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("tiles"), Path::to_path_buf);
    if tiles.join("epoch_1").is_dir() && tiles.join("flight/flight.csv").is_file() {
        return Ok(tiles);
    }
    let remedy = "name the repository's tiles/ folder with --tiles DIR, or draw one with `cargo run --release --example generate_tiles -- --out DIR`";
    Err(Failure::unusable("no_tiles", anyhow!("{} holds no epoch_1/ and flight/: {remedy}", tiles.display())))
}

/// Builds a store of the map in a tiles/ folder.
pub fn build_store(db: &Path, tiles: &Path, threads: usize, output: &Output) -> Result<build::BuildSummary, Failure> {
    let request = build::Request {
        db: db.to_owned(),
        layer: LAYER.into(),
        sources: vec![tiles.join("epoch_1")],
        date: Some("2018-06-12".into()),
        threads,
        replace_layer: true,
        ..build::Request::default()
    };
    let bar = output.progress(0, "tiles");
    let summary = build::run(&request, &mut |progress| {
        bar.set_length(progress.total as u64);
        bar.set_position(progress.done as u64);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    let mut summary = summary.map_err(|e| Failure::failed(e.code(), e))?;
    explain_rejected(&mut summary.rejected);
    match summary.rejected.first() {
        Some(rejected) => Err(Failure::failed("rejected_source", anyhow!("{}", serde_json::json!(rejected)))),
        None => Ok(summary),
    }
}

fn locate_frames(
    store: &Reader,
    flight: &RecordedFlight,
    threads: usize,
    output: &Output,
) -> Result<Vec<FixOutcome>, Failure> {
    let trial = FixTrial {
        layer: LAYER.into(),
        prior_error_m: PRIOR_ERROR_M,
        seed: SEED,
        heading_sigma_deg: Some(3.0),
        height_sigma_ratio: 0.03,
        unknown_position: false,
        threads,
    };
    let bar = output.progress(flight.frames.len() as u64, "frames");
    let outcomes = trial.run(store, flight, |_| bar.inc(1));
    bar.finish_and_clear();
    Ok(outcomes?)
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text)
        .with_context(|| format!("cannot write {}", path.display()))
        .map_err(|e| Failure::failed("unwritable", e))
}

/// The whole layer as one picture.
fn map_of(store: &Reader, layer: &Layer) -> Result<Mosaic, Failure> {
    let mut tiles = Vec::new();
    for footprint in store.footprints(layer, layer.base_zoom)? {
        tiles.extend(store.tile(layer, footprint.tile)?.map(|pixels| (footprint.tile, pixels)));
    }
    Mosaic::assemble(&tiles)
        .ok_or_else(|| Failure::failed("no_map", anyhow!("the layer {} has no picture to show", layer.name)))
}

fn page_of(
    mosaic: &Mosaic,
    flight: &RecordedFlight,
    outcomes: &[FixOutcome],
    score: &FixScore,
    facts: &[(String, String)],
) -> Result<String, Failure> {
    let introduction = format!(
        "{} camera frames over farmland, located one by one on a map of another season three years before. Every search starts from a \
         position that is off by up to {PRIOR_ERROR_M:.0} m east or west and north or south, a heading known to about a degree \
         and a height known to about 1 %. The landscape is drawn, so the truth is exact.",
        outcomes.len()
    );
    let located: Vec<usize> = (0..outcomes.len()).filter(|&i| outcomes[i].error.is_some()).collect();
    let mut shown = Vec::new();
    for k in 0..SHOWN.min(located.len()) {
        let index = located[(2 * k + 1) * located.len() / (2 * SHOWN.min(located.len()))];
        shown.push((index, read_colour_frame(&flight.frames[index].path)?));
    }
    let report = FlightReport {
        title: TITLE,
        introduction: &introduction,
        flight,
        outcomes,
        score,
        prior_error_m: PRIOR_ERROR_M,
        mosaic,
        shown: &shown,
        facts,
    };
    Ok(report.to_html())
}

fn facts(store: &Reader, layer: &Layer, built: &build::BuildSummary) -> Vec<(String, String)> {
    let fact = |name: &str, value: String| (name.to_owned(), value);
    vec![
        fact("command", "overfly demo".into()),
        fact("version", env!("CARGO_PKG_VERSION").into()),
        fact("processors", format!("{} {}", default_threads(), std::env::consts::ARCH)),
        fact(
            "store",
            format!(
                "{:.1} MB, {} tiles, zoom {} to {}",
                built.bytes as f64 / 1e6,
                built.tiles,
                layer.min_zoom,
                layer.base_zoom
            ),
        ),
        fact(
            "built in",
            format!(
                "{:.1} s from {:.1} megapixels ({} tiles made, {} kept)",
                built.elapsed_s, built.source_megapixels, built.computed_tiles, built.kept_tiles
            ),
        ),
        fact("digest", store.digest().to_owned()),
        fact("descriptors", store.descriptor_contract().to_owned()),
        fact("prior", format!("uniform, up to {PRIOR_ERROR_M} m per axis, seed {SEED}")),
    ]
}
