//! `overfly calibrate`: measures the time and the error of registrations on this machine.

use crate::cli::chosen_layer::chosen_layer;
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::lab::project_tiles::{build_store, project_tiles};
use crate::cli::lab::relative::{laws_text, measure};
use crate::cli::number;
use crate::cli::output::Output;
use anyhow::Context;
use overfly_lab::report::{cost_svg, relative_cost_svgs};
use overfly_lab::trial::{
    Calibrated, Cost, CostTrial, OVERLAPS_PERCENT, RelativeLaws, RelativeTrial, calibration_toml, samples_csv,
};
use overfly_store::Reader;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

const HELP: &str = "\
Pairs with 95, 50, 35, 25 and 10 % overlap are cut from photos, rotated, made noisy and registered with several numbers of
descriptors. This gives the times of loading (A_c, L), matching (t0), thresholding (B) and estimating (t_c), and the drift against the
number of matches (D_U). A frame cut from the map is searched for in squares of more and more tiles; this gives K1 and the constant of
t_exe. Times are medians of several runs on one thread. Nothing else should run on the machine meanwhile.

--out writes the constants as TOML, and beside that file, as STEM-NAME, the samples (csv) and the plots with the fitted laws (svg).

Example:
  overfly calibrate --db map.gpkg --out calibration.toml";

/// Arguments of `calibrate`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// Photos or orthophotos to cut pairs from [default: the project's own tiles/epoch_1].
    #[arg(value_name = "PHOTO")]
    photos: Vec<PathBuf>,
    /// The store to search [default: one built from the project's own tiles].
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,
    /// Which layer [default: the only one, or ortho].
    #[arg(long, value_name = "NAME", requires = "db")]
    layer: Option<String>,
    /// The project's tiles/ folder [default: from the sources that this program was built from].
    #[arg(long, value_name = "DIR")]
    tiles: Option<PathBuf>,
    /// Write the constants to this file, and samples and plots beside it.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Edge of the square views, pixels.
    #[arg(long, value_name = "PX", default_value_t = NonZeroUsize::new(512).expect("not zero"))]
    edge_px: NonZeroUsize,
    /// Pairs for each overlap [default: 12].
    #[arg(long, value_name = "N")]
    pairs: Option<NonZeroUsize>,
    /// Sample values shown as black and white, for GeoTIFFs of more than 8 bits.
    #[arg(long, value_name = "LO,HI", value_parser = number::stretch, allow_hyphen_values = true)]
    stretch: Option<(f64, f64)>,
    /// Seed for pairs, priors and noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Use few pairs and runs, for a first look and for tests.
    #[arg(long)]
    quick: bool,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let photos = if args.photos.is_empty() { demo_photos(args)? } else { args.photos.clone() };
    let pairs = args.pairs.map_or(if args.quick { 1 } else { 12 }, NonZeroUsize::get);
    let trial = RelativeTrial {
        photos,
        stretch: args.stretch,
        images: pairs.saturating_mul(OVERLAPS_PERCENT.len()),
        pairs,
        limits: if args.quick { vec![150, 600] } else { vec![75, 150, 300, 600, 1200, 2400] },
        repeats: if args.quick { 1 } else { 5 },
        edge_px: args.edge_px.get(),
        seed: args.seed,
    };
    let samples = measure(&trial, output)?.samples;
    let cost = search(args, output)?;
    let found = Calibrated::from_measurements(RelativeLaws::fit(&samples)?, args.edge_px.get(), cost)?;
    if let Some(path) = &args.out {
        output.write(path, calibration_toml(&found.calibration).as_bytes())?;
        output.write(&beside(path, "samples.csv"), samples_csv(&samples).as_bytes())?;
        for (name, plot) in relative_cost_svgs(&found.laws, &samples) {
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

/// The time of searches over the given store, or over one built from the project's tiles.
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
    let layer = chosen_layer(&store, args.layer.as_deref())?;
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

/// The constants as text.
fn text(found: &Calibrated) -> String {
    let c = &found.calibration;
    format!(
        "images     {0:.0} x {0:.0} px\nt_exe      {1:.1} ms + {2:.3} ms a tile (K1)\n{3}",
        c.images.edge_px,
        1e3 * c.search.search_constant_s,
        1e3 * c.search.seconds_per_store_tile,
        laws_text(&found.laws)
    )
}
