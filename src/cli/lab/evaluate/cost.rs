//! `overfly evaluate cost`: measures the time of a search against the number of tiles.

use crate::cli::chosen_layer::chosen_layer;
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::number::positive;
use crate::cli::output::Output;
use overfly_lab::report::cost_svg;
use overfly_lab::trial::{Cost, CostTrial, write_cost};
use overfly_store::Reader;
use std::num::NonZeroUsize;
use std::path::PathBuf;

const HELP: &str = "\
A frame is cut from the middle of the map, rotated, made noisy, and searched for in squares of more and more base tiles. A line is
fitted to the median times: t = constant + K1 * tiles, the model of the coupling modes (equation 17). The first search of each area,
which may have to read and describe tiles, is reported separately as first_ms. Areas that the layer cannot fill are skipped. Nothing else
should run on the machine meanwhile.

Example:
  overfly evaluate cost --db map.gpkg --tiles 1,4,9,25,100,400 --out cost";

/// Arguments of `evaluate cost`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// Which layer [default: the only one, or ortho].
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Areas to search, in base tiles.
    #[arg(long, value_name = "N,...", value_parser = positive, value_delimiter = ',', default_values_t = [1.0, 4.0, 9.0, 25.0, 100.0, 400.0])]
    tiles: Vec<f64>,
    /// Number of searches of each area.
    #[arg(long, value_name = "N", default_value_t = 8)]
    repeats: usize,
    /// Width of the frame, pixels.
    #[arg(long, value_name = "PX", default_value_t = NonZeroUsize::new(1024).expect("not zero"))]
    width_px: NonZeroUsize,
    /// Height of the frame, pixels.
    #[arg(long, value_name = "PX", default_value_t = NonZeroUsize::new(768).expect("not zero"))]
    height_px: NonZeroUsize,
    /// Search without a heading prior.
    #[arg(long)]
    unknown_heading: bool,
    /// Seed for priors and noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Threads of each search.
    #[arg(long, value_name = "N", default_value_t = NonZeroUsize::MIN)]
    threads: NonZeroUsize,
    /// Write cost.csv and cost.svg here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let store = Reader::open(&args.db)?;
    let layer = chosen_layer(&store, args.layer.as_deref())?;
    let trial = CostTrial {
        layer: layer.name.clone(),
        tiles: args.tiles.clone(),
        repeats: args.repeats,
        frame_px: [args.width_px.get(), args.height_px.get()],
        unknown_heading: args.unknown_heading,
        seed: args.seed,
        threads: args.threads.get(),
    };
    args.out.as_deref().map_or(Ok(()), make_folder)?;
    let bar = output.progress(args.tiles.len() as u64, "areas");
    let cost = trial.run(&store, |step| {
        bar.inc(1);
        if output.is_json() {
            output.say(step, String::new);
        }
    })?;
    bar.finish_and_clear();
    if let Some(folder) = &args.out {
        output.note(&format!("wrote {}", write_cost(folder, &cost)?.display()));
        output.write(&folder.join("cost.svg"), cost_svg(&cost).as_bytes())?;
    }
    output.say(&cost, || text(&cost));
    Ok(Exit::Done)
}

/// The times as text.
fn text(cost: &Cost) -> String {
    let mut text = format!(
        "frame      {} x {} px on {} threads\ntime       {:.1} ms + {:.3} ms a tile (K1 = {:.2e} s)\n\n  \
         tiles  searched  nominal  right   first ms  median ms    95 % ms\n",
        cost.frame_px[0],
        cost.frame_px[1],
        cost.threads,
        1e3 * cost.constant_s,
        1e3 * cost.seconds_per_tile,
        cost.seconds_per_tile
    );
    for s in &cost.steps {
        text.push_str(&format!(
            "  {:>5} {:>9} {:>8.1} {:>3} of {:<3} {:>8.1} {:>10.1} {:>10.1}\n",
            s.tiles,
            s.tiles_searched,
            s.nominal_count,
            s.right,
            s.repeats,
            s.first_ms,
            s.elapsed_ms.median,
            s.elapsed_ms.p95
        ));
    }
    if !cost.skipped.is_empty() {
        let areas: Vec<String> = cost.skipped.iter().map(f64::to_string).collect();
        text.push_str(&format!("  skipped, because the layer cannot fill them: {} tiles\n", areas.join(", ")));
    }
    text.trim_end().to_owned()
}
