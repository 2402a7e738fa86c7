//! A flight over a canvas: poses along a serpentine, frames, and sensor readings.

use crate::canvas::SceneCanvas;
use crate::log::Log;
use crate::sight::{HEIGHT_PX, Sight, SightPose, WIDTH_PX, relief};
use crate::survey::{CORNER, Radiometry, write_jpeg};
use crate::utm::geodetic_from_grid;
use overfly_core::geodesy::{Geodetic, LocalFrame};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

const HEIGHT_M: f64 = 520.0;
const SPEED_MPS: f64 = 45.0;
const FRAMES: usize = 40;
/// Flies over the canvas and writes `flight.csv`, `camera.toml` and `frames/`.
pub fn fly(canvas: &SceneCanvas, radiometry: Radiometry, seed: u64, folder: &Path) -> anyhow::Result<usize> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let poses = poses(&mut rng);
    let mut log = Log::default();
    let relief = relief(canvas);
    for (i, pose) in poses.iter().enumerate() {
        let sight = Sight::new(pose, CORNER);
        let colours = sight.expose(canvas, &relief, |u, v| sight.ends(u, v));
        let gain = rng.random_range(0.9..1.1);
        let sensor = Radiometry { gain: radiometry.gain.map(|g| g * gain), ..radiometry };
        let pixels: Vec<u8> = colours.into_iter().flat_map(|c| sensor.develop(c, &mut rng)).collect();
        let image = format!("frames/{i:03}.jpg");
        write_jpeg(&folder.join(&image), &pixels, WIDTH_PX, HEIGHT_PX, 88)?;
        log.enter(&image, pose, &mut rng);
    }
    log.write(folder)?;
    Ok(poses.len())
}

/// Three legs joined by half circles, sampled evenly, with the wobble of a small aircraft.
fn poses(rng: &mut ChaCha8Rng) -> Vec<SightPose> {
    let (west, east, north, radius_m) = (330.0, 2230.0, 370.0, 325.0);
    let leg_m = east - west - 2.0 * radius_m;
    let turn_m = std::f64::consts::PI * radius_m;
    let total_m = 3.0 * leg_m + 2.0 * turn_m;
    let mut out = Vec::new();
    for i in 0..FRAMES {
        let s = total_m * (i as f64 + 0.5) / FRAMES as f64;
        let (leg, rest_m) = ((s / (leg_m + turn_m)) as usize, s % (leg_m + turn_m));
        let eastwards = leg % 2 == 0;
        let sign = if eastwards { 1.0 } else { -1.0 };
        let (start_x, y) =
            (if eastwards { west + radius_m } else { east - radius_m }, north + 2.0 * radius_m * leg as f64);
        let (x, y, grid_deg, bank_deg) = if rest_m < leg_m {
            (start_x + sign * rest_m, y, 90.0 * sign, 0.0)
        } else {
            let t = (rest_m - leg_m) / radius_m;
            (
                start_x + sign * (leg_m + radius_m * t.sin()),
                y + radius_m * (1.0 - t.cos()),
                sign * (90.0 + t.to_degrees()),
                // The mount takes up most of the bank; right turns lower the right wing.
                5.0 * sign,
            )
        };
        let grid = [CORNER[0] + x + rng.random_range(-12.0..12.0), CORNER[1] - y + rng.random_range(-12.0..12.0)];
        let nadir = geodetic_from_grid(grid);
        out.push(SightPose {
            nadir,
            heading_rad: true_heading_rad(nadir, grid, grid_deg + rng.random_range(-4.0..4.0)),
            pitch_rad: f64::to_radians(1.5 + rng.random_range(-2.0..2.0)),
            roll_rad: f64::to_radians(bank_deg + rng.random_range(-2.0..2.0)),
            height_m: HEIGHT_M * (1.0 + rng.random_range(-0.04..0.04)),
            time_s: s / SPEED_MPS,
        });
    }
    out
}

/// The true azimuth, in [0, 2 pi), of a grid bearing at a point: the grid's north leans from the meridian.
pub fn true_heading_rad(nadir: Geodetic, grid: [f64; 2], grid_deg: f64) -> f64 {
    let (sin, cos) = grid_deg.to_radians().sin_cos();
    let ahead = geodetic_from_grid([grid[0] + 10.0 * sin, grid[1] + 10.0 * cos]);
    let step = LocalFrame::at(nadir).enu_from_geodetic(ahead);
    step.east_m.atan2(step.north_m).rem_euclid(std::f64::consts::TAU)
}
