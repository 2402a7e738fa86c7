//! Draws a world with exact truth: a map as others make it, and a flight over it on another day, as `overfly evaluate fixes` reads it.
//!
//! `cargo run --release -p overfly-lab --example render_world -- town --out DIR` writes `DIR/map/` and `DIR/flight/`; the same
//! arguments write the same bytes on any number of threads. docs/scenes.md says what is drawn.

mod bars;
mod preset;

use bars::Bars;
use clap::Parser;
use overfly_lab::scene::{write_heights, write_map};
use preset::{Preset, Range};
use std::path::{Path, PathBuf};

/// Draws a world with exact truth: a map, and a flight over it on another day.
///
/// Memory: the cells of one day, 10 bytes each, and the map's pixels, 3 bytes each; more than 48 million of either are refused. So at
/// most 0.7 GB, and 40 MB more for each thread. The number of frames does not change it.
#[derive(Parser)]
#[command(verbatim_doc_comment)]
struct Args {
    /// What to draw.
    world: preset::WorldKind,
    /// Folder to write `map/` and `flight/` to.
    #[arg(long)]
    out: PathBuf,
    /// Another seed is another world and another flight.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Another flight over the same world and map.
    #[arg(long, default_value_t = 1)]
    flight_seed: u64,
    /// Frames of the flight.
    #[arg(long, default_value_t = 60)]
    frames: usize,
    /// Side of the world, metres [default: 900 for the town, 12000 for the mountains, 9000 for the lakes].
    #[arg(long)]
    size_m: Option<f64>,
    /// Ground sample distance of the map [default: 0.3, 5 and 5].
    #[arg(long)]
    map_gsd_m_per_px: Option<f64>,
    /// Lean of the map: angle between the vertical and its sensor, degrees [default: 20, 9 and 0].
    #[arg(long)]
    lean_deg: Option<f64>,
    /// Error of the map that is the same everywhere, metres [default: 5, 5 and 2].
    #[arg(long)]
    map_common_m: Option<f64>,
    /// Draw that error by the seed from a Gaussian with this standard deviation per axis, metres; consecutive seeds spread evenly over it.
    #[arg(long, conflicts_with = "map_common_m")]
    map_common_sigma_m: Option<f64>,
    /// Error of the map that varies from place to place, standard deviation per axis, metres [default: 1, 2 and 0.8].
    #[arg(long)]
    map_local_m: Option<f64>,
    /// Share of roofs, cars, gardens and fields that changed between map and flight [default: 0.5].
    #[arg(long)]
    changed_share: Option<f32>,
    /// Columns of a frame; rows are three quarters of that [default: 1000, 400 and 256].
    #[arg(long)]
    width_px: Option<u32>,
    /// Lowest and highest height above the ground, metres [default: 100,120, 3000,5000 and 2200,2200].
    #[arg(long, value_parser = preset::parse_range)]
    height_m: Option<Range>,
    /// Least and greatest angle off nadir, degrees, in a direction drawn for each line [default: 3,13, 0,12 and 0,0].
    #[arg(long, value_parser = preset::parse_range)]
    tilt_deg: Option<Range>,
    /// State pitch and roll in flight.csv, and the lens in camera.toml; else both are 0 there.
    #[arg(long)]
    state_attitude: bool,
    /// Standard deviation of the pitch and of the roll that --state-attitude states, degrees.
    #[arg(long, default_value_t = 0.0, requires = "state_attitude")]
    attitude_noise_deg: f64,
    /// The true columns of flight.csv hold the nadir and not the ground under the image's centre.
    #[arg(long)]
    nadir_truth: bool,
    /// One flight in turns, without pauses and jumps, instead of single lines.
    #[arg(long)]
    continuous: bool,
    /// How much higher the water is on the flight's day, metres (lakes) [default: 0.7].
    #[arg(long, allow_negative_numbers = true)]
    water_rise_m: Option<f64>,
    /// Threads [default: all cores].
    #[arg(long)]
    threads: Option<usize>,
    /// Show no progress bars.
    #[arg(short, long)]
    quiet: bool,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let preset = Preset::new(&args)?;
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    }
    let bars = Bars::new(args.quiet);
    draw_map(&preset, &args.out, &bars)?;
    let step = bars.step("the world on the flight's day");
    let world = preset.flight_world();
    drop(step);
    let bar = bars.bar("frames");
    preset.flight.fly(&world, &args.out.join("flight"), &|done, all| bar.show(done, all))?;
    println!("a map and {} frames in {}", args.frames, args.out.display());
    Ok(())
}

/// A terrain model as there is one of the whole world: knots, metres, and the standard deviation of their heights, metres.
const SURVEY_SPACING_M: f64 = 30.0;
const SURVEY_ERROR_M: f64 = 3.0;

/// The map, its terrain, and what is true of it. The world of the map's day is dropped before that of the flight's day is painted.
fn draw_map(preset: &Preset, out: &Path, bars: &Bars) -> anyhow::Result<()> {
    let step = bars.step("the world on the map's day");
    let world = preset.map_world();
    drop(step);
    let bar = bars.bar("map");
    let pixels = preset.map.draw(&world, &|done, all| bar.show(done, all));
    let size_px = preset.map.size_px(&world);
    write_map(&out.join("map/map.jpg"), &pixels, size_px, preset.map.gsd_m_per_px, 92)?;
    // Not beside the map: `overfly build` would take it for an orthophoto.
    write_heights(&out.join("dem/dem.tif"), &world.terrain)?;
    let surveyed = world.terrain.surveyed(SURVEY_SPACING_M, SURVEY_ERROR_M, preset.seed);
    write_heights(&out.join("dem_surveyed/dem.tif"), &surveyed)?;
    std::fs::write(out.join("scene.txt"), preset.description())?;
    Ok(())
}
