//! A flight over a canvas: poses along a serpentine, and what a camera there sees, by casting rays.
//!
//! Nothing of the program's own camera model is used, so that agreement with it means something.

use crate::canvas::{Canvas, PIXELS_PER_M};
use crate::survey::{CORNER, Radiometry, write_jpeg};
use crate::utm::{geodetic_from_grid, grid_from_geodetic};
use nalgebra::Vector3;
use overfly::geodesy::{Enu, Geodetic, LocalFrame};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::fmt::Write;
use std::path::Path;

const WIDTH_PX: usize = 320;
const HEIGHT_PX: usize = 240;
const FOCAL_PX: f64 = 400.0;
const PRINCIPAL_PX: [f64; 2] = [161.3, 118.9];
const DISTORTION: [f64; 5] = [-0.06, 0.015, 0.0004, -0.0003, 0.0];
const HEIGHT_M: f64 = 520.0;
const SPEED_MPS: f64 = 45.0;
const FRAMES: usize = 40;
/// Where rays begin: above everything.
const TOP_M: f64 = 32.0;
/// Rays per pixel along each axis.
const RAYS: usize = 3;

/// Where the camera is and how it looks.
struct Pose {
    nadir: Geodetic,
    heading_rad: f64,
    pitch_rad: f64,
    roll_rad: f64,
    height_m: f64,
    time_s: f64,
}

/// Flies over the canvas and writes `flight.csv`, `camera.toml` and `frames/`.
pub fn fly(canvas: &Canvas, radiometry: Radiometry, seed: u64, folder: &Path) -> anyhow::Result<usize> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let poses = poses(&mut rng);
    let mut csv = String::from(
        "image,time_s,true_latitude_deg,true_longitude_deg,true_heading_deg,height_agl_m,heading_deg,pitch_deg,roll_deg\n",
    );
    for (i, pose) in poses.iter().enumerate() {
        let colours = expose(canvas, pose);
        let gain = rng.random_range(0.9..1.1);
        let sensor = Radiometry { gain: radiometry.gain.map(|g| g * gain), ..radiometry };
        let pixels: Vec<u8> = colours.into_iter().flat_map(|c| sensor.develop(c, &mut rng)).collect();
        let image = format!("frames/{i:03}.jpg");
        write_jpeg(&folder.join(&image), &pixels, WIDTH_PX, HEIGHT_PX, 88)?;
        let normal = |rng: &mut ChaCha8Rng| (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let said_height_m = pose.height_m * (1.0 + 0.01 * normal(&mut rng));
        let said_heading_deg = (pose.heading_rad.to_degrees() + normal(&mut rng)).rem_euclid(360.0);
        writeln!(
            csv,
            "{image},{:.2},{:.9},{:.9},{:.4},{said_height_m:.2},{said_heading_deg:.2},{:.3},{:.3}",
            pose.time_s,
            pose.nadir.latitude_deg(),
            pose.nadir.longitude_deg(),
            pose.heading_rad.to_degrees(),
            pose.pitch_rad.to_degrees(),
            pose.roll_rad.to_degrees(),
        )?;
    }
    std::fs::write(folder.join("flight.csv"), csv)?;
    std::fs::write(
        folder.join("camera.toml"),
        format!(
            "# Drawn by examples/generate_tiles: pinhole with the OpenCV distortion model (k1, k2, p1, p2, k3), pixels from the\n\
             # image's corner. Ground sample distance = height_agl_m / focal_length_px.\n\
             width_px = {WIDTH_PX}\nheight_px = {HEIGHT_PX}\nfocal_length_px = {FOCAL_PX:.1}\n\
             principal_point_px = {PRINCIPAL_PX:?}\ndistortion = {DISTORTION:?}\n"
        ),
    )?;
    Ok(poses.len())
}

/// Three legs joined by half circles, sampled evenly, with the wobble of a small aircraft.
fn poses(rng: &mut ChaCha8Rng) -> Vec<Pose> {
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
        out.push(Pose {
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
fn true_heading_rad(nadir: Geodetic, grid: [f64; 2], grid_deg: f64) -> f64 {
    let (sin, cos) = grid_deg.to_radians().sin_cos();
    let ahead = geodetic_from_grid([grid[0] + 10.0 * sin, grid[1] + 10.0 * cos]);
    let step = LocalFrame::at(nadir).enu_from_geodetic(ahead);
    step.east_m.atan2(step.north_m).rem_euclid(std::f64::consts::TAU)
}

/// What the camera sees, before its electronics.
fn expose(canvas: &Canvas, pose: &Pose) -> Vec<[f32; 3]> {
    let frame = LocalFrame::at(pose.nadir);
    // East, north, up. Heading turns the level axes, pitch lifts the nose, roll lowers the right wing.
    let (sin_h, cos_h) = pose.heading_rad.sin_cos();
    let (sin_p, cos_p) = pose.pitch_rad.sin_cos();
    let (sin_r, cos_r) = pose.roll_rad.sin_cos();
    let (ahead, right, down) =
        (Vector3::new(sin_h, cos_h, 0.0), Vector3::new(cos_h, -sin_h, 0.0), Vector3::new(0.0, 0.0, -1.0));
    let (ahead, down) = (ahead * cos_p - down * sin_p, down * cos_p + ahead * sin_p);
    let (right, down) = (right * cos_r + down * sin_r, down * cos_r - right * sin_r);
    let see = |u: f64, v: f64| {
        let [x, y] = undistorted([(u - PRINCIPAL_PX[0]) / FOCAL_PX, (v - PRINCIPAL_PX[1]) / FOCAL_PX]);
        let ray = down + right * x - ahead * y;
        let ground_at = |z_m: f64| {
            let k = (pose.height_m - z_m) / -ray.z;
            let point = frame.geodetic_from_enu(Enu { east_m: ray.x * k, north_m: ray.y * k }).expect("in sight");
            let grid = grid_from_geodetic(point);
            [grid[0] - CORNER[0], CORNER[1] - grid[1]]
        };
        first_hit(canvas, ground_at(TOP_M), ground_at(0.0))
    };
    (0..WIDTH_PX * HEIGHT_PX)
        .into_par_iter()
        .map(|i| {
            let (column, row) = ((i % WIDTH_PX) as f64, (i / WIDTH_PX) as f64);
            let mut sum = [0.0f32; 3];
            for k in 0..RAYS * RAYS {
                let part = |n: usize| (n as f64 + 0.5) / RAYS as f64;
                let seen = see(column + part(k % RAYS), row + part(k / RAYS));
                (0..3).for_each(|c| sum[c] += seen[c] / (RAYS * RAYS) as f32);
            }
            sum
        })
        .collect()
}

/// The colour where a ray from `top` (at [`TOP_M`]) to `bottom` (on the ground) first meets the scene.
fn first_hit(canvas: &Canvas, top: [f64; 2], bottom: [f64; 2]) -> [f32; 3] {
    const STEPS: usize = 64;
    for k in 0..=STEPS {
        let t = k as f64 / STEPS as f64;
        let p = [top[0] + (bottom[0] - top[0]) * t, top[1] + (bottom[1] - top[1]) * t];
        let (column, row) = ((p[0] * PIXELS_PER_M).floor() as isize, (p[1] * PIXELS_PER_M).floor() as isize);
        if f64::from(canvas.height_at(column, row)) >= TOP_M * (1.0 - t) {
            return canvas.colour_at(p[0], p[1]);
        }
    }
    canvas.colour_at(bottom[0], bottom[1])
}

/// Where an undistorted camera would have seen what this one sees at `seen` (both over the focal length): the OpenCV
/// model solved backwards by repetition, to below a billionth.
fn undistorted(seen: [f64; 2]) -> [f64; 2] {
    let [k1, k2, p1, p2, k3] = DISTORTION;
    let [mut x, mut y] = seen;
    for _ in 0..40 {
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let (dx, dy) = (2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
        (x, y) = ((seen[0] - dx) / radial, (seen[1] - dy) / radial);
    }
    [x, y]
}
