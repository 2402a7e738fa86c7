//! A campaign: a thousand frames and more over several landscapes, with the maps of three years before.

use crate::flight::true_heading_rad;
use crate::log::Log;
use crate::painting::paint;
use crate::scene::{FarmlandScene, SIZE_M};
use crate::sight::{HEIGHT_PX, Sight, SightPose, WIDTH_PX, relief};
use crate::sortie::Sortie;
use crate::sun::Sun;
use crate::survey::{self, CORNER, Radiometry, write_jpeg};
use crate::utm::geodetic_from_grid;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// Between the western edges of neighbouring landscapes, metres.
const APART_M: f64 = 4000.0;
/// From the landscape's edge to the nearest nadir, metres: more than any frame reaches.
const MARGIN_M: f64 = 420.0;

/// Draws maps to `map/` and a flight to `flight/`, landscape by landscape and day by day.
pub fn draw(out: &Path, seed: u64, frames: usize, worlds: usize, sorties: usize) -> anyhow::Result<()> {
    let mut log = Log::default();
    let days = worlds * sorties;
    let mut drawn = 0;
    for world in 0..worlds {
        let scene = FarmlandScene::plan(seed + world as u64);
        let corner = [CORNER[0] + APART_M * world as f64, CORNER[1]];
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(world as u64);
        map(&scene, corner, &mut rng, &out.join(format!("map/{world}.jpg")))?;
        let ground = paint(&scene, 1);
        for day in 0..sorties {
            let end = frames * (world * sorties + day + 1) / days;
            let sortie = Sortie::plan(&mut rng);
            let canvas = sortie.lit(&ground, &mut rng);
            let relief = relief(&canvas);
            while drawn < end {
                let pose = pose(corner, drawn as f64, &mut rng);
                let sight = Sight::new(&pose, corner);
                let knots = sight.knots();
                let colours = sight.expose(&canvas, &relief, |u, v| knots.ends(u, v));
                let pixels = sortie.develop(colours, &mut rng);
                let image = format!("frames/{drawn:05}.jpg");
                write_jpeg(&out.join("flight").join(&image), &pixels, WIDTH_PX, HEIGHT_PX, 88)?;
                log.enter(&image, &pose, &mut rng);
                drawn += 1;
            }
            eprintln!("landscape {} of {worlds}, day {} of {sorties}: {drawn} frames", world + 1, day + 1);
        }
    }
    log.write(&out.join("flight"))?;
    println!("{drawn} frames and {worlds} maps in {}", out.display());
    Ok(())
}

/// The orthophoto of an early summer, at an hour of its own.
fn map(scene: &FarmlandScene, corner: [f64; 2], rng: &mut ChaCha8Rng, path: &Path) -> anyhow::Result<()> {
    let mut canvas = paint(scene, 0);
    canvas.light(Sun { azimuth_deg: rng.random_range(130.0..230.0), elevation_deg: rng.random_range(48.0..63.0) });
    let radiometry = Radiometry {
        gain: [rng.random_range(1.0..1.08), 1.0, rng.random_range(0.94..1.0)],
        gamma: rng.random_range(0.9..1.0),
        haze: rng.random_range(0.03..0.08),
        noise: 1.6,
    };
    survey::write(&canvas, corner, (0, SIZE_M[0] as usize), radiometry, rng.random(), 85, path)
}

/// Anywhere over a landscape, under any heading, tilted by up to 3 degrees each way.
fn pose(corner: [f64; 2], time_s: f64, rng: &mut ChaCha8Rng) -> SightPose {
    let x = rng.random_range(MARGIN_M..SIZE_M[0] - MARGIN_M);
    let y = rng.random_range(MARGIN_M..SIZE_M[1] - MARGIN_M);
    let grid = [corner[0] + x, corner[1] - y];
    let nadir = geodetic_from_grid(grid);
    let tilt = |rng: &mut ChaCha8Rng| {
        // To the thousandth of a degree that flight.csv holds.
        let deg = (rng.random_range(-3.0..3.0f64) * 1000.0).round() / 1000.0;
        deg.to_radians()
    };
    SightPose {
        nadir,
        heading_rad: true_heading_rad(nadir, grid, rng.random_range(0.0..360.0)),
        pitch_rad: tilt(rng),
        roll_rad: tilt(rng),
        height_m: rng.random_range(400.0..680.0),
        time_s,
    }
}
