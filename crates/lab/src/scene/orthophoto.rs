//! `OrthophotoPlan`: a map of a world as others make it: rectified on the bare ground only, seen from one side, warped.

use super::exposure::{Exposure, Light};
use super::noise::cloudy;
use super::world::World;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// How a map is made.
#[derive(Debug, Clone, Copy)]
pub struct OrthophotoPlan {
    /// Ground sample distance, metres of the grid per pixel.
    pub gsd_m_per_px: f64,
    /// Angle between the vertical and the line to the sensor, degrees.
    pub lean_deg: f64,
    /// Direction towards the sensor, clockwise from grid north, degrees. What stands up leans the other way.
    pub sensor_azimuth_deg: f64,
    /// The error of the map.
    pub warp: MapWarp,
    /// How the sensor develops.
    pub exposure: Exposure,
    /// Seed of the noise.
    pub seed: u64,
}

/// The smooth error of a map: a pixel that states a place shows the ground at that place plus the warp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapWarp {
    /// The same everywhere, metres east and south.
    pub common_m: [f64; 2],
    /// Standard deviation, per axis, of the part that varies, metres (about).
    pub local_m: f64,
    /// Size of its features, metres.
    pub wavelength_m: f64,
    /// Its seed.
    pub seed: u32,
}

impl MapWarp {
    /// No error.
    pub const NONE: Self = Self { common_m: [0.0; 2], local_m: 0.0, wavelength_m: 1.0, seed: 0 };

    /// The warp at a place of the map, metres east and south.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        // `cloudy` has a standard deviation of about 0.38.
        let local = |n: u32| {
            let (u, v) = (x / self.wavelength_m, y / self.wavelength_m);
            self.local_m / 0.38 * f64::from(cloudy(self.seed.wrapping_add(n), u, v))
        };
        [self.common_m[0] + local(0), self.common_m[1] + local(101)]
    }
}

/// Rows of a map that are drawn and developed at a time.
const STRIP_ROWS: usize = 256;
/// Rows above and below a strip that its blur reaches.
const APRON_ROWS: usize = 8;

impl OrthophotoPlan {
    /// Columns and rows of the map of a world.
    pub fn size_px(&self, world: &World) -> [usize; 2] {
        world.size_m().map(|size| (size / self.gsd_m_per_px).floor() as usize)
    }

    /// Draws the map of a world, interleaved RGB. Holds one strip of light at a time besides the image.
    pub fn draw(&self, world: &World, progress: &(dyn Fn(usize, usize) + Sync)) -> Vec<u8> {
        let [width, height] = self.size_px(world);
        let mut pixels = Vec::with_capacity(width * height * 3);
        let strips = height.div_ceil(STRIP_ROWS);
        for strip in 0..strips {
            let first = strip * STRIP_ROWS;
            let last = (first + STRIP_ROWS).min(height);
            let (from, to) = (first.saturating_sub(APRON_ROWS), (last + APRON_ROWS).min(height));
            let rows = (from..to).into_par_iter().flat_map_iter(|row| (0..width).map(move |column| (column, row)));
            let colours = rows.map(|(column, row)| self.pixel(world, column, row)).collect();
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(strip as u64);
            let developed = self.exposure.develop(Light { width, height: to - from, colours }, &mut rng);
            pixels.extend_from_slice(&developed[(first - from) * width * 3..(last - from) * width * 3]);
            progress(strip + 1, strips);
        }
        pixels
    }

    /// The mean of the rays through one pixel, about one per cell.
    fn pixel(&self, world: &World, column: usize, row: usize) -> [f32; 3] {
        let rays = (self.gsd_m_per_px / world.cells.cell_m).round().clamp(2.0, 5.0) as usize;
        let mut sum = [0f32; 3];
        for k in 0..rays * rays {
            let part = |n: usize| (n as f64 + 0.5) / rays as f64;
            let place = [column as f64 + part(k % rays), row as f64 + part(k / rays)].map(|v| v * self.gsd_m_per_px);
            let seen = self.seen(world, place);
            (0..3).for_each(|c| sum[c] += seen[c] / (rays * rays) as f32);
        }
        sum
    }

    /// The colour that the map shows at a place, metres east and south.
    fn seen(&self, world: &World, place: [f64; 2]) -> [f32; 3] {
        let warp = self.warp.at(place);
        let ground = [place[0] + warp[0], place[1] + warp[1]];
        let z_m = world.ground_m(ground[0], ground[1]);
        let (sin, cos) = self.sensor_azimuth_deg.to_radians().sin_cos();
        let run = self.lean_deg.to_radians().tan();
        // From the ground towards the sensor, up to where nothing stands.
        let up_m = f64::from(world.cells.highest_m) + 1.0 - z_m;
        let origin = [ground[0] + sin * run * up_m, ground[1] - cos * run * up_m, z_m + up_m];
        world.seen(origin, [-sin * run, cos * run, -1.0])
    }
}
