//! `FlightPlan`: a flight over a world, as frames and the two files beside them.

use super::continuous_track::continuous_shots;
use super::exposure::{Exposure, Light};
use super::files::write_jpeg;
use super::normal::normal;
use super::pose::{LensTable, SceneCamera, ScenePose, geodetic_at};
use super::track::{Shot, TrackPlan};
use super::world::World;
use overfly_core::camera::Intrinsics;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::fmt::Write;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Rays per pixel along each axis.
const RAYS: usize = 2;

/// The point that `true_latitude_deg` and `true_longitude_deg` of `flight.csv` are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrueColumns {
    /// Straight below the camera.
    Nadir,
    /// The ground under the image's centre.
    Centre,
}

/// A flight: its track, its camera, and what the aircraft says of both.
#[derive(Debug, Clone)]
pub struct FlightPlan {
    /// Where frames are taken.
    pub track: TrackPlan,
    /// The true camera.
    pub intrinsics: Intrinsics,
    /// How it develops; gain and noise differ a little from frame to frame.
    pub exposure: Exposure,
    /// Longest time that the shutter is open, seconds.
    pub shutter_s: f64,
    /// From reading the first row to reading the last, seconds.
    pub readout_s: f64,
    /// Quality of the JPEGs, 1 to 100.
    pub quality: u8,
    /// Standard deviation of the pitch and roll that `flight.csv` states, degrees; `None`: they are 0 there.
    pub stated_attitude_sigma_deg: Option<f64>,
    /// Whether `camera.toml` states the distortion; else it is 0 there.
    pub is_lens_stated: bool,
    /// Standard deviation of the stated heading, degrees.
    pub heading_sigma_deg: f64,
    /// Standard deviation of the stated height, as a ratio.
    pub height_sigma_ratio: f64,
    /// What the true columns hold.
    pub true_columns: TrueColumns,
}

impl FlightPlan {
    /// Draws `frames/`, `flight.csv` and `camera.toml`. Every frame has a random stream of its own, so the bytes do not depend on
    /// the number of threads. `progress`: frames drawn, frames in all.
    ///
    /// # Errors
    /// What writing the files fails with.
    pub fn fly(&self, world: &World, folder: &Path, progress: &(dyn Fn(usize, usize) + Sync)) -> io::Result<()> {
        let shots = shots(&self.track, world);
        let lens = LensTable::new(&self.intrinsics);
        let size_px = [self.intrinsics.width_px as usize, self.intrinsics.height_px as usize];
        let done = AtomicUsize::new(0);
        let draw = |(number, shot): (usize, &Shot)| {
            let mut rng = ChaCha8Rng::seed_from_u64(self.track.seed);
            rng.set_stream(number as u64 + 1);
            let image = format!("frames/{number:04}.jpg");
            let pixels = self.picture(world, shot, &lens, &mut rng);
            write_jpeg(&folder.join(&image), &pixels, size_px, self.quality)?;
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, shots.len());
            Ok(self.row(world, shot, &image, &mut rng))
        };
        let rows: Vec<String> = shots.par_iter().enumerate().map(draw).collect::<io::Result<_>>()?;
        std::fs::write(folder.join("flight.csv"), format!("{HEADER}{}", rows.concat()))?;
        std::fs::write(folder.join("camera.toml"), self.camera_toml())
    }

    /// The developed frame of a shot, interleaved RGB.
    fn picture(&self, world: &World, shot: &Shot, lens: &LensTable, rng: &mut ChaCha8Rng) -> Vec<u8> {
        let (width, height) = (self.intrinsics.width_px as usize, self.intrinsics.height_px as usize);
        let mut colours = Vec::with_capacity(width * height);
        for row in 0..height {
            let camera = SceneCamera::new(&self.pose_at_row(shot, row));
            for column in 0..width {
                let mut sum = [0f32; 3];
                for k in 0..RAYS * RAYS {
                    let part = |n: usize| (n as f64 + 0.5) / RAYS as f64;
                    let ray = lens.ray(column, row, [part(k % RAYS), part(k / RAYS)]);
                    let seen = world.seen(camera.origin(), camera.direction(ray));
                    (0..3).for_each(|c| sum[c] += seen[c] / (RAYS * RAYS) as f32);
                }
                colours.push(sum);
            }
        }
        let gain = rng.random_range(0.93..1.07);
        let exposure = Exposure {
            gain: self.exposure.gain.map(|g| g * gain),
            motion_px: self.motion_px(world, shot, rng.random_range(0.2..1.0) * self.shutter_s),
            defocus_px: self.exposure.defocus_px * rng.random_range(0.8..1.25),
            ..self.exposure
        };
        exposure.develop(Light { width, height, colours }, rng)
    }

    /// The camera while a row is read: the pose of the shot is that of the middle row.
    fn pose_at_row(&self, shot: &Shot, row: usize) -> ScenePose {
        let late_s = ((row as f64 + 0.5) / f64::from(self.intrinsics.height_px) - 0.5) * self.readout_s;
        let [heading, pitch, roll] = shot.rates_rad_per_s.map(|rate| rate * late_s);
        let pose = &shot.pose;
        ScenePose {
            place: [0, 1].map(|axis| pose.place[axis] + shot.velocity_mps[axis] * late_s),
            heading_rad: pose.heading_rad + heading,
            pitch_rad: pose.pitch_rad + pitch,
            roll_rad: pose.roll_rad + roll,
            ..*pose
        }
    }

    /// How the middle of the image moves over the sensor within a time, pixels right and down.
    fn motion_px(&self, world: &World, shot: &Shot, open_s: f64) -> [f32; 2] {
        let height_m = shot.pose.z_m - world.ground_m(shot.pose.place[0], shot.pose.place[1]);
        let focal_px = self.intrinsics.focal_length_px;
        let (sin, cos) = shot.pose.heading_rad.sin_cos();
        let [east, south] = shot.velocity_mps;
        let (right, ahead) = (east * cos + south * sin, east * sin - south * cos);
        let [_, pitch, roll] = shot.rates_rad_per_s;
        // The ground moves against the camera; pitching ahead and rolling left move it down and right.
        [
            ((-right / height_m + roll) * focal_px * open_s) as f32,
            ((ahead / height_m + pitch) * focal_px * open_s) as f32,
        ]
    }

    /// The row of `flight.csv`.
    fn row(&self, world: &World, shot: &Shot, image: &str, rng: &mut ChaCha8Rng) -> String {
        let pose = &shot.pose;
        let truth = ShotTruth::new(world, pose, &self.intrinsics);
        let said_height_m = truth.height_agl_m * (1.0 + self.height_sigma_ratio * normal(rng));
        let said_msl_m = truth.ground_z_m + said_height_m;
        let said_heading_deg = (pose.heading_rad.to_degrees() + self.heading_sigma_deg * normal(rng)).rem_euclid(360.0);
        let tilt_deg = [pose.pitch_rad, pose.roll_rad].map(f64::to_degrees);
        let said_tilt_deg = match self.stated_attitude_sigma_deg {
            Some(sigma_deg) => tilt_deg.map(|deg| deg + sigma_deg * normal(rng)),
            None => [0.0; 2],
        };
        let true_deg = match self.true_columns {
            TrueColumns::Nadir => truth.nadir_deg,
            TrueColumns::Centre => truth.centre_deg,
        };
        let mut line = String::new();
        write!(line, "{image},{:.3},{:.9},{:.9},", shot.time_s, true_deg[0], true_deg[1])
            .and_then(|()| write!(line, "{:.4},{said_height_m:.2},", pose.heading_rad.to_degrees()))
            .and_then(|()| write!(line, "{said_heading_deg:.2},{:.4},{:.4},", said_tilt_deg[0], said_tilt_deg[1]))
            .and_then(|()| write!(line, "{:.9},{:.9},", truth.nadir_deg[0], truth.nadir_deg[1]))
            .and_then(|()| write!(line, "{:.9},{:.9},", truth.centre_deg[0], truth.centre_deg[1]))
            .and_then(|()| write!(line, "{:.3},{:.3},{:.3},", pose.z_m, truth.ground_z_m, truth.height_agl_m))
            .and_then(|()| {
                writeln!(line, "{:.4},{:.4},{:.1},{said_msl_m:.2}", tilt_deg[0], tilt_deg[1], truth.relief_m)
            })
            .expect("writing to a string does not fail");
        line
    }

    fn camera_toml(&self) -> String {
        let camera = &self.intrinsics;
        let distortion = if self.is_lens_stated { camera.distortion } else { [0.0; 5] };
        format!(
            "# Drawn by examples/render_world; the true distortion is {:?}\n\
             width_px = {}\nheight_px = {}\nfocal_length_px = {:?}\nprincipal_point_px = {:?}\ndistortion = {distortion:?}\n",
            camera.distortion, camera.width_px, camera.height_px, camera.focal_length_px, camera.principal_point_px,
        )
    }
}

const HEADER: &str = "image,time_s,true_latitude_deg,true_longitude_deg,true_heading_deg,height_agl_m,heading_deg,pitch_deg,\
roll_deg,camera_latitude_deg,camera_longitude_deg,centre_latitude_deg,centre_longitude_deg,camera_z_m,ground_z_m,\
true_height_agl_m,true_pitch_deg,true_roll_deg,relief_m,height_msl_m\n";

/// The shots of a flight, of single lines or without pauses.
fn shots(plan: &TrackPlan, world: &World) -> Vec<Shot> {
    if plan.is_continuous { continuous_shots(plan, world) } else { plan.shots(world) }
}

/// What is true of a frame.
#[derive(Debug, Clone, Copy)]
pub struct ShotTruth {
    /// Latitude and longitude straight below the camera, degrees.
    pub nadir_deg: [f64; 2],
    /// Latitude and longitude of the bare ground (or water) under the image's centre, degrees.
    pub centre_deg: [f64; 2],
    /// Height of that ground on the scene's scale, metres.
    pub ground_z_m: f64,
    /// Height of the camera above that ground, metres.
    pub height_agl_m: f64,
    /// How much the ground varies within a quarter of the height around the centre, metres.
    pub relief_m: f64,
}

impl ShotTruth {
    /// The truth of a pose, from the renderer's own rays.
    pub fn new(world: &World, pose: &ScenePose, intrinsics: &Intrinsics) -> Self {
        let [x, y, ground_z_m] = SceneCamera::new(pose).ground_under_centre(world, intrinsics);
        let degrees = |place: [f64; 2]| {
            let point = geodetic_at(place);
            [point.latitude_deg(), point.longitude_deg()]
        };
        let height_agl_m = pose.z_m - ground_z_m;
        let [lowest_m, highest_m] = world.terrain.extremes_m([x, y], height_agl_m / 4.0);
        Self {
            nadir_deg: degrees(pose.place),
            centre_deg: degrees([x, y]),
            ground_z_m,
            height_agl_m,
            relief_m: highest_m - lowest_m,
        }
    }
}
