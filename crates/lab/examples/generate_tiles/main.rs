//! Draws the landscape of `tiles/`: an invented piece of farmland in two epochs as orthophotos, and a flight over the
//! second epoch, exact in every number.
//!
//! `cargo run --release -p overfly-lab --example generate_tiles -- --out tiles` writes the same files for the same seed. With
//! `--flight-frames 2000 --out DIR` it draws instead as many frames over several landscapes, each seen on a few days
//! of other light, season and weather, and the maps of them three years before.

mod campaign;
mod canvas;
mod curve;
mod flight;
mod ground;
mod log;
mod objects;
mod painting;
mod parcels;
mod relief;
mod scene;
mod sight;
mod sortie;
mod sun;
mod survey;

use canvas::SceneCanvas;
use clap::Parser;
use overfly_lab::scene::{noise, utm};
use painting::paint;
use scene::{FarmlandScene, SIZE_M};
use std::path::PathBuf;
use sun::Sun;
use survey::{CORNER, Radiometry};

/// Draws the landscape of `tiles/`.
#[derive(Parser)]
struct Args {
    /// Folder to write to.
    #[arg(long, default_value = "tiles")]
    out: PathBuf,
    /// Draw this many frames over several landscapes, and their maps, instead of `tiles/`.
    #[arg(long, requires = "out")]
    flight_frames: Option<usize>,
    /// How many landscapes they are spread over.
    #[arg(long, default_value_t = 4, requires = "flight_frames")]
    worlds: usize,
    /// How many days each landscape is flown over.
    #[arg(long, default_value_t = 10, requires = "flight_frames")]
    sorties: usize,
    /// Another seed is another landscape.
    #[arg(long, default_value_t = 7)]
    seed: u64,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    match args.flight_frames {
        Some(frames) => campaign::draw(&args.out, args.seed, frames, args.worlds.max(1), args.sorties.max(1)),
        None => draw_tiles(&args),
    }
}

/// The two epochs and the flight of `tiles/`.
fn draw_tiles(args: &Args) -> anyhow::Result<()> {
    let scene = FarmlandScene::plan(args.seed);

    let mut early_summer = paint(&scene, 0);
    early_summer.light(Sun { azimuth_deg: 150.0, elevation_deg: 60.0 });
    let clear = Radiometry { gain: [1.02, 1.0, 0.97], gamma: 0.95, haze: 0.05, noise: 1.6 };
    let warmer = Radiometry { gain: [1.07, 1.02, 0.95], gamma: 0.92, haze: 0.07, noise: 1.6 };
    survey::write(&early_summer, CORNER, (0, 1400), clear, args.seed + 1, 80, &args.out.join("epoch_1/west.jpg"))?;
    survey::write(&early_summer, CORNER, (1160, 2560), warmer, args.seed + 2, 80, &args.out.join("epoch_1/east.jpg"))?;
    drop(early_summer);

    let autumn = paint(&scene, 1);
    let relit = |sun| {
        let mut lit = SceneCanvas { colours: autumn.colours.clone(), heights_m: autumn.heights_m.clone(), ..autumn };
        lit.light(sun);
        lit
    };
    let hazy = Radiometry { gain: [1.0, 0.98, 1.0], gamma: 1.05, haze: 0.14, noise: 2.0 };
    let morning = relit(Sun { azimuth_deg: 152.0, elevation_deg: 38.0 });
    survey::write(
        &morning,
        CORNER,
        (0, SIZE_M[0] as usize),
        hazy,
        args.seed + 3,
        80,
        &args.out.join("epoch_2/whole.jpg"),
    )?;
    drop(morning);

    // The flight comes at noon of that season, so no map shows its shadows.
    let noon = relit(Sun { azimuth_deg: 172.0, elevation_deg: 48.0 });
    let camera = Radiometry { gain: [1.05, 1.0, 0.93], gamma: 1.0, haze: 0.08, noise: 3.0 };
    let frames = flight::fly(&noon, camera, args.seed + 4, &args.out.join("flight"))?;
    println!("{frames} frames and two epochs in {}", args.out.display());
    Ok(())
}
