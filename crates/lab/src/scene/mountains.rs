//! Mountains: ridges, valleys with a river and a road, forest, meadows, scrub, rock.

use super::cells::Cells;
use super::date::SceneDate;
use super::noise::{chance, cloudy, hash, smooth};
use super::sample::{GREEN, GROUND, Sample, WATER};
use super::terrain::Terrain;
use super::world::World;

/// Side of a cell, metres.
pub const CELL_M: f64 = 2.5;
/// Distance between knots of the terrain, metres.
const SPACING_M: f64 = 10.0;

/// Mountains of a seed and a size (east, south, metres) on a day.
pub fn mountains(seed: u64, size_m: [f64; 2], date: &SceneDate) -> World {
    let land = Land { seed: hash(0x6d_74_6e, seed as i32, (seed >> 32) as i32) };
    let terrain = Terrain::new(size_m, SPACING_M, |x, y| land.height_m(x, y));
    let cells = Cells::paint(size_m, CELL_M, |x, y| land.sample(&terrain, date, x, y), &[]);
    World::new(cells, terrain, None, Vec::new(), date.sun)
}

/// The shape and cover of the land.
struct Land {
    seed: u32,
}

/// Where a point lies beside the valley's river.
struct Valley {
    /// Distance to the river, metres.
    river_m: f64,
    /// How far up the valley's side, in [0, 1].
    side: f64,
}

impl Land {
    /// A coordinate bent by 200 m or so, so that no noise shows its grid.
    fn bent(&self, x: f64, y: f64) -> [f64; 2] {
        let bend = |n: u32| 260.0 * f64::from(cloudy(self.seed ^ n, x / 1900.0, y / 1900.0));
        [x + bend(1), y + bend(2)]
    }

    /// Valleys follow the zeros of a smooth field.
    fn valley(&self, x: f64, y: f64) -> Valley {
        let field = |x: f64, y: f64| {
            let [u, v] = self.bent(x, y);
            let wiggle = 0.05 * f64::from(smooth(self.seed ^ 13, x / 260.0, y / 260.0));
            f64::from(smooth(self.seed ^ 3, (u + 0.4 * v) / 3400.0, (v - 0.4 * u) / 3400.0)) + wiggle
        };
        const STEP_M: f64 = 10.0;
        let here = field(x, y);
        let slope = ((field(x + STEP_M, y) - here) / STEP_M).hypot((field(x, y + STEP_M) - here) / STEP_M);
        Valley { river_m: here.abs() / slope.max(2e-4), side: (here.abs() / 0.5).min(1.0) }
    }

    fn height_m(&self, x: f64, y: f64) -> f64 {
        let [u, v] = self.bent(x, y);
        let valley = self.valley(x, y);
        // Ridges: octaves of one minus the absolute value, each turned and weighted by the one before.
        let (mut sum, mut weight, mut size_m, mut gain) = (0.0, 1.0, 2300.0, 0.5);
        let (mut p, mut q) = (u, v);
        for octave in 0..7u32 {
            let ridge = 1.0 - f64::from(smooth(self.seed ^ (40 + octave), p / size_m, q / size_m).abs());
            let sharp = ridge * ridge * weight;
            sum += gain * sharp;
            weight = (sharp * 1.6).min(1.0);
            (p, q) = (0.8 * p - 0.6 * q + 371.0, 0.6 * p + 0.8 * q - 119.0);
            (size_m, gain) = (size_m * 0.49, gain * 0.5);
        }
        let rise = valley.side * valley.side * (3.0 - 2.0 * valley.side);
        let runnels = f64::from(smooth(self.seed ^ 5, u / 90.0, v / 90.0).abs());
        280.0
            + 60.0 * f64::from(smooth(self.seed ^ 4, x / 5000.0, y / 5000.0))
            + rise * (780.0 * sum + 16.0 * runnels)
            + 0.02 * valley.river_m.min(400.0)
    }

    fn sample(&self, terrain: &Terrain, date: &SceneDate, x: f64, y: f64) -> Sample {
        let ground_m = terrain.height_m(x, y);
        let [gx, gy] = terrain.slope(x, y);
        let slope = gx.hypot(gy);
        let valley = self.valley(x, y);
        let (colour, lift_m, kind) = self
            .line(&valley, slope, ground_m, x, y)
            .unwrap_or_else(|| self.cover(&valley, date, [gx, gy], ground_m, x, y));
        Sample { colour, top_m: (ground_m + lift_m) as f32, kind }
    }

    /// River, its gravel, the valley's road, tracks along the slopes.
    fn line(&self, valley: &Valley, slope: f64, ground_m: f64, x: f64, y: f64) -> Option<([f32; 3], f64, u16)> {
        let gravel_m = 26.0 + 22.0 * f64::from(smooth(self.seed ^ 21, x / 300.0, y / 300.0));
        if valley.river_m < 7.0 {
            return Some(([66.0, 78.0, 74.0], 0.0, WATER));
        }
        let tone = 1.0 + 0.1 * smooth(self.seed ^ 22, x / 6.0, y / 6.0);
        if valley.river_m < gravel_m {
            return Some(([186.0 * tone, 178.0 * tone, 160.0 * tone], 0.0, GROUND));
        }
        let road_m = 95.0 + 35.0 * f64::from(smooth(self.seed ^ 23, x / 700.0, y / 700.0));
        if (valley.river_m - road_m).abs() < 4.5 {
            return Some(([128.0, 126.0, 124.0], 0.0, GROUND));
        }
        // Tracks climb slowly along the slope where somebody made them.
        let level_m = ground_m + 70.0 * f64::from(smooth(self.seed ^ 24, x / 1300.0, y / 1300.0));
        let off_m = ((level_m / 130.0).round() * 130.0 - level_m).abs() / slope.max(0.08);
        let is_made = smooth(self.seed ^ 25, x / 1700.0, y / 1700.0) > -0.1 && (0.08..0.75).contains(&slope);
        (is_made && off_m < 3.6).then_some(([190.0 * tone, 172.0 * tone, 140.0 * tone], 0.0, GROUND))
    }

    fn cover(
        &self,
        valley: &Valley,
        date: &SceneDate,
        gradient: [f64; 2],
        ground_m: f64,
        x: f64,
        y: f64,
    ) -> ([f32; 3], f64, u16) {
        let slope = gradient[0].hypot(gradient[1]);
        let patch = f64::from(cloudy(self.seed ^ 31, x / 800.0, y / 800.0));
        let ragged = f64::from(cloudy(self.seed ^ 32, x / 90.0, y / 90.0));
        if slope + 0.22 * ragged + 0.15 * patch > 0.86 {
            return (self.rock(gradient, x, y), 0.0, GROUND);
        }
        let is_low = valley.river_m < 420.0 && slope < 0.16;
        let shade_side = 0.25 * gradient[1] / (1.0 + slope);
        let line_m = 690.0 + 110.0 * patch + 40.0 * ragged;
        if !is_low && ground_m < line_m && patch + 0.28 * ragged - shade_side > -0.08 {
            return self.forest(date, x, y);
        }
        if is_low {
            return (self.field(date, x, y), 0.0, GROUND);
        }
        self.scrub(date, patch, x, y)
    }

    /// Bands along the contour and runnels down the slope.
    fn rock(&self, [gx, gy]: [f64; 2], x: f64, y: f64) -> [f32; 3] {
        let norm = gx.hypot(gy).max(1e-6);
        let (down, along) = ((x * gx + y * gy) / norm, (y * gx - x * gy) / norm);
        let bands = smooth(self.seed ^ 51, along / 220.0, down / 16.0);
        let rough = cloudy(self.seed ^ 52, x / 22.0, y / 22.0);
        let tone = 1.0 + 0.16 * bands + 0.2 * rough;
        [164.0 * tone, 154.0 * tone, 140.0 * tone]
    }

    /// Crowns of 7 m; stands of other age and kind; clearings that move between days.
    fn forest(&self, date: &SceneDate, x: f64, y: f64) -> ([f32; 3], f64, u16) {
        let [u, v] = self.bent(x, y);
        let stand = [u + 0.5 * v, 0.7 * v - 0.4 * u].map(|v| (v / 190.0).floor() as i32);
        let own = hash(self.seed ^ 61, stand[0], stand[1]);
        if chance(date.seed_of(own), 2, 2) < 0.04 {
            let litter = 1.0 + 0.16 * smooth(own, x / 5.0, y / 14.0);
            let bare = chance(own, 7, 7);
            return ([108.0, 112.0, 74.0].map(|c| (c + 34.0 * bare) * litter), 0.0, GROUND);
        }
        let crown = smooth(self.seed ^ 62, x / 5.0, y / 5.0);
        let age = chance(own, 3, 3);
        let height_m = 9.0 + 11.0 * f64::from(age) + 4.0 * f64::from(crown);
        let green = [56.0 + 26.0 * age, 78.0 + 20.0 * age, 46.0 + 6.0 * age];
        let tone = 0.95 + 0.3 * crown + 0.1 * cloudy(self.seed ^ 63, x / 60.0, y / 60.0);
        (date.tinted(green, 0.3 * age).map(|c| c * tone), height_m, GREEN)
    }

    /// Strips of fields in the valley.
    fn field(&self, date: &SceneDate, x: f64, y: f64) -> [f32; 3] {
        let [u, v] = self.bent(x, y);
        let (s, t) = ((u + 0.5 * v) / 140.0, (v - 0.5 * u) / 60.0);
        let shift = f64::from(chance(self.seed ^ 71, t.floor() as i32, 0));
        let own = hash(self.seed ^ 72, (s + shift).floor() as i32, t.floor() as i32);
        let is_edge = (s + shift).rem_euclid(1.0) < 0.03 || t.rem_euclid(1.0) < 0.07;
        const CROPS: [[f32; 3]; 5] = [
            [112.0, 134.0, 70.0],
            [176.0, 160.0, 104.0],
            [92.0, 116.0, 62.0],
            [150.0, 124.0, 94.0],
            [138.0, 148.0, 84.0],
        ];
        let crop = CROPS[(chance(date.seed_of(own), 4, 4) * 5.0) as usize % 5];
        let tone = 1.0 + 0.07 * cloudy(own, x / 30.0, y / 30.0) + if is_edge { -0.22 } else { 0.0 };
        date.tinted(crop, 0.3).map(|c| c * tone)
    }

    /// Grass with bushes, drier the higher.
    fn scrub(&self, date: &SceneDate, patch: f64, x: f64, y: f64) -> ([f32; 3], f64, u16) {
        let at = [x / 9.0, y / 9.0].map(|v| v.floor());
        let own = hash(self.seed ^ 81, at[0] as i32, at[1] as i32);
        let middle = [0, 1].map(|axis| (at[axis] + 0.25 + 0.5 * f64::from(chance(own, axis as i32, 1))) * 9.0);
        let dense = 0.2 + 0.35 * f64::from(cloudy(self.seed ^ 82, x / 240.0, y / 240.0)) - 0.2 * patch;
        let radius_m = 1.8 + 1.7 * f64::from(chance(own, 5, 5));
        if f64::from(chance(own, 6, 6)) < dense && (x - middle[0]).hypot(y - middle[1]) < radius_m {
            return (date.tinted([72.0, 88.0, 54.0], 0.2), 1.0 + radius_m, GREEN);
        }
        let tone =
            1.0 + 0.12 * cloudy(self.seed ^ 83, x / 45.0, y / 45.0) + 0.06 * smooth(self.seed ^ 84, x / 6.0, y / 6.0);
        (date.tinted([150.0, 146.0, 100.0], 0.7).map(|c| c * tone), 0.0, GROUND)
    }
}
