//! `overfly demo`: a whole flight on the project's own tiles, in under two minutes.

mod flown;

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::lab::fix_score::{default_right_m, fix_text};
use crate::cli::lab::mosaic::mosaic_of;
use crate::cli::lab::project_tiles::{LAYER, build_store, project_tiles};
use crate::cli::output::Output;
use crate::cli::threads::default_threads;
use anyhow::{Context, anyhow};
use overfly_core::integrity::DEFAULT_INTEGRITY_RISK;
use overfly_flight::frame::read_colour_frame;
use overfly_flight::locate::Parts;
use overfly_ingest::build;
use overfly_lab::report::{FlightReport, Mosaic};
use overfly_lab::trial::{FixOutcome, FixScore, FixTrial, FlyScore, RecordedFlight, TruthPoint, write_fixes};
use overfly_store::{Layer, Reader};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

const TITLE: &str = "overfly: a flight located without GPS";
const PRIOR_ERROR_M: f64 = 500.0;
const SEED: u64 = 1;
/// Frames shown beside the map.
const SHOWN: usize = 4;

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// Folder for the store, the fixes and the report.
    #[arg(long, value_name = "DIR", default_value = "overfly-demo")]
    out: PathBuf,
    /// The project's tiles/ folder [default: from the sources that this program was built from].
    #[arg(long, value_name = "DIR")]
    tiles: Option<PathBuf>,
    /// Threads for building and searching.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
}

/// The summary that the demo prints at its end.
#[derive(Serialize)]
struct DemoSummary<'a> {
    #[serde(flatten)]
    score: &'a FixScore,
    db: &'a Path,
    report: &'a Path,
    /// The same flight in a closed loop, one object per mode.
    flown: &'a [FlyScore],
    flown_report: &'a Path,
    build_s: f64,
    total_s: f64,
}

/// Runs the command; exit code 1 if a fix is false.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let started = Instant::now();
    let tiles = project_tiles(args.tiles.as_deref())?;
    make_folder(&args.out)?;
    let db = args.out.join("demo.gpkg");

    output.note(&format!("building {} from {}", db.display(), tiles.join("epoch_1").display()));
    let built = build_store(&db, &tiles, args.threads.get(), output)?;
    let store = Reader::open(&db)?;
    let layer = store.layer(LAYER)?;

    let flight = RecordedFlight::read(&tiles.join("flight"))?;
    output.note(&format!(
        "locating {} frames; the priors are off by up to {PRIOR_ERROR_M} m per axis",
        flight.frames.len()
    ));
    let outcomes = locate_frames(&store, &flight, args.threads.get(), output)?;
    let score = FixScore::from_outcomes(&outcomes, default_right_m(&store, layer)?, args.threads.get());
    write_fixes(&args.out, &outcomes, DEFAULT_INTEGRITY_RISK)?;

    let page = args.out.join("report.html");
    let mosaic = mosaic_of(&store, layer, layer.base_zoom)?
        .ok_or_else(|| Failure::failed("no_map", anyhow!("the layer {} has no picture to show", layer.name)))?;
    let html = page_of(&mosaic, &flight, &outcomes, &score, &facts(&store, layer, &built))?;
    write(&page, &html)?;

    output.note("flying in a closed loop: sequential, parallel, combined");
    let right_m = score.right_m;
    let flown = flown::fly(&store, &flight, LAYER, right_m, args.threads.get(), output)?;
    let flown_page = args.out.join("flown.html");
    write(&flown_page, &flown.page(&mosaic))?;
    let total_s = started.elapsed().as_secs_f64();
    let summary = DemoSummary {
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
        truth: TruthPoint::Nadir,
        parts: Parts::ALL,
        threads,
    };
    let bar = output.progress(flight.frames.len() as u64, "frames");
    let outcomes = trial.run(store, flight, |_| bar.inc(1));
    bar.finish_and_clear();
    Ok(outcomes?)
}

fn page_of(
    mosaic: &Mosaic,
    flight: &RecordedFlight,
    outcomes: &[FixOutcome],
    score: &FixScore,
    facts: &[(String, String)],
) -> Result<String, Failure> {
    let introduction = format!(
        "{} camera frames over farmland, located one by one on a map from another season three years earlier. Every search starts \
         from a position that is off by up to {PRIOR_ERROR_M:.0} m per axis, a heading known to about one degree and a height known \
         to about 1 %. The landscape is drawn, so the truth is exact.",
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

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    overfly_store::write_output(path, text)
        .with_context(|| format!("cannot write {}", path.display()))
        .map_err(|e| Failure::failed("unwritable", e))
}
