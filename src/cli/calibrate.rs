//! `overfly calibrate`: what registrations cost and err on this machine.

use super::demo::{build_store, project_tiles};
use super::{Exit, Failure, Output};
use anyhow::Context;
use overfly::locate::candidates::default_layer;
use overfly::report::{cost_svg, relative_cost_svgs};
use overfly::store::Reader;
use overfly::trial::{Calibrated, Cost, CostTrial, RelativeTrial, calibration_toml, write_samples};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

const HELP: &str = "\
Pairs with 95, 50, 35, 25 and 10 % overlap are cut from photos, turned, made noisy and registered with several numbers of
descriptors: loading (A_c, L), matching (t0), thresholding (B), estimating (t_c), and the drift against matches (D_U). A frame
cut from the map is searched for in squares of more and more tiles: K1 and the constant of t_exe. Medians of several runs,
one thread. Nothing else should run on the machine meanwhile.

With --out, the constants are written as TOML, and beside it, as STEM-NAME, the samples (csv) and plots with the fits (svg).

Example:
  overfly calibrate --db map.gpkg --out calibration.toml";

/// Arguments of `calibrate`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// Photos to cut pairs from [default: the project's own tiles/epoch_1].
    #[arg(value_name = "PHOTO")]
    photos: Vec<PathBuf>,
    /// The store to search [default: one built for this from the project's own tiles].
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,
    /// Which layer [default: the only one, or ortho].
    #[arg(long, value_name = "NAME", requires = "db")]
    layer: Option<String>,
    /// The project's tiles/ folder [default: the one of the sources that this program was built from].
    #[arg(long, value_name = "DIR")]
    tiles: Option<PathBuf>,
    /// Write the constants here, and samples and plots beside.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Edge of the square views, pixels.
    #[arg(long, value_name = "PX", default_value_t = NonZeroUsize::new(512).expect("not zero"))]
    edge_px: NonZeroUsize,
    /// Pairs of each overlap [default: 12].
    #[arg(long, value_name = "N")]
    pairs: Option<NonZeroUsize>,
    /// Seed of pairs, priors and noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Few pairs and runs: for a first look, and for tests.
    #[arg(long)]
    quick: bool,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let photos = if args.photos.is_empty() { demo_photos(args)? } else { args.photos.clone() };
    let trial = RelativeTrial {
        photos,
        pairs: args.pairs.map_or(if args.quick { 1 } else { 12 }, NonZeroUsize::get),
        limits: if args.quick { vec![150, 600] } else { vec![75, 150, 300, 600, 1200, 2400] },
        repeats: if args.quick { 1 } else { 5 },
        edge_px: args.edge_px.get(),
        seed: args.seed,
    };
    let bar = output.progress(trial.count() as u64, "registrations");
    let samples = trial.run(|sample| {
        bar.inc(1);
        if output.is_json() {
            output.say(sample, String::new);
        }
    });
    bar.finish_and_clear();
    let samples = samples?;
    let cost = search(args, output)?;
    let found = Calibrated::of(&samples, args.edge_px.get(), cost)?;
    if let Some(path) = &args.out {
        output.write(path, calibration_toml(&found.calibration).as_bytes())?;
        let table = beside(path, "samples.csv");
        write_samples(&table, &samples)?;
        output.note(&format!("wrote {}", table.display()));
        for (name, plot) in relative_cost_svgs(&found) {
            output.write(&beside(path, &format!("{name}.svg")), plot.as_bytes())?;
        }
        output.write(&beside(path, "search.svg"), cost_svg(&found.cost).as_bytes())?;
    }
    output.say(&found, || text(&found));
    Ok(Exit::Done)
}

/// `folder/stem-name` of `folder/stem.toml`.
fn beside(path: &Path, name: &str) -> PathBuf {
    let stem = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    path.with_file_name(format!("{stem}-{name}"))
}

fn demo_photos(args: &Args) -> Result<Vec<PathBuf>, Failure> {
    let tiles = project_tiles(args.tiles.as_deref())?;
    Ok(["west.jpg", "east.jpg"].map(|name| tiles.join("epoch_1").join(name)).to_vec())
}

/// Searches of the given store, or of one built from the demo's tiles.
fn search(args: &Args, output: &Output) -> Result<Cost, Failure> {
    let folder;
    let db = match &args.db {
        Some(db) => db.clone(),
        None => {
            let tiles = project_tiles(args.tiles.as_deref())?;
            folder = tempfile::tempdir()
                .context("no folder for a temporary store")
                .map_err(|e| Failure::failed("unwritable", e))?;
            let db = folder.path().join("demo.gpkg");
            build_store(&db, &tiles, 1, output)?;
            db
        }
    };
    let store = Reader::open(&db)?;
    let layer = match &args.layer {
        Some(name) => store.layer(name)?,
        None => default_layer(&store)?,
    };
    let tiles = if args.quick { vec![1.0, 4.0] } else { vec![1.0, 4.0, 9.0, 16.0, 25.0, 100.0, 400.0] };
    let trial = CostTrial {
        layer: layer.name.clone(),
        tiles,
        repeats: if args.quick { 3 } else { 8 },
        frame_px: [args.edge_px.get(), args.edge_px.get()],
        unknown_heading: false,
        seed: args.seed,
        threads: 1,
    };
    let bar = output.progress(trial.tiles.len() as u64, "areas");
    let cost = trial.run(&store, |step| {
        bar.inc(1);
        if output.is_json() {
            output.say(step, String::new);
        }
    });
    bar.finish_and_clear();
    Ok(cost?)
}

/// The constants for people.
fn text(found: &Calibrated) -> String {
    let c = &found.calibration;
    let r = &c.relative;
    let mut text = format!(
        "images     {0:.0} x {0:.0} px, {1:.0} descriptors, {2:.0} of them matched\n\
         A_c        {3:.2} us a descriptor      (42)\nL          {4:.2} ms                  (42)\n\
         t0         {5:.2} ns a comparison      (43)\nB          {6:.2} us a descriptor      (44)\n\
         t_c        {7:.2} ms                  (45)\nT_exe      {8:.1} ms a relative registration (45): t0 of (9)\n\
         D_U        sqrt({9:.4}^2 + {10:.3}^2 / n) px; keypoints alone sqrt({11:.4}^2 + {12:.3}^2 / n) px\n\
         t_exe      {13:.1} ms + {14:.3} ms a tile (K1)\n\n  \
         limit      N   loading  matching  threshold  estimate, ms     n   drift, px  keypoints alone  registered\n",
        c.images.edge_px,
        c.images.descriptor_count,
        c.images.matched_count,
        1e6 * r.seconds_per_descriptor,
        1e3 * r.load_s,
        1e9 * r.pair_comparison_s,
        1e6 * r.threshold_s_per_descriptor,
        1e3 * r.estimate_s,
        1e3 * found.relative_s,
        c.drift.floor_px,
        c.drift.pair_drift_px,
        found.keypoint_drift.floor_px,
        found.keypoint_drift.pair_drift_px,
        1e3 * c.search.search_constant_s,
        1e3 * c.search.seconds_per_store_tile,
    );
    for row in &found.rows {
        let number = |v: Option<f64>, factor: f64| v.map_or("none".into(), |v| format!("{:.4}", factor * v));
        text.push_str(&format!(
            "  {:>5} {:>6.0} {:>9.3} {:>9.3} {:>10.3} {:>13} {:>5.0} {:>11} {:>16} {:>4} of {}\n",
            row.limit,
            row.descriptors,
            1e3 * row.loading_s,
            1e3 * row.matching_s,
            1e3 * row.threshold_s,
            number(row.estimate_s, 1e3),
            row.matched,
            number(row.drift_px, 1.0),
            number(row.keypoint_drift_px, 1.0),
            row.registered,
            row.pairs,
        ));
    }
    text.trim_end().to_owned()
}
