//! Lakes: farmland in quarter sections with lakes and ponds, whose level is another on another day.

use super::building::{Building, Roof};
use super::cells::Cells;
use super::date::SceneDate;
use super::noise::{chance, cloudy, hash, smooth};
use super::objects::{SceneObject, Tree};
use super::sample::{FIRST_BUILDING, GREEN, GROUND, Sample, WATER};
use super::terrain::Terrain;
use super::world::World;

/// Side of a cell, metres.
pub const CELL_M: f64 = 2.0;
/// Distance between knots of the terrain, metres.
const SPACING_M: f64 = 8.0;
/// Level of all lakes on the map's day, metres.
pub const LEVEL_M: f64 = 468.0;
/// Half a mile: the side of a quarter section, metres.
const QUARTER_M: f64 = 804.67;

/// Farmland with lakes, of a seed and a size (east, south, metres) on a day when the water stands `rise_m` above [`LEVEL_M`]. Shores fall by
/// 2 to 7 %, so 0.7 m moves them by 10 to 35 m. Below `bare_m` above [`LEVEL_M`] nothing grows: that is where water often stands.
pub fn lakes(seed: u64, size_m: [f64; 2], date: &SceneDate, rise_m: f64, bare_m: f64) -> World {
    let land = Farmland {
        seed: hash(0x6c_61_6b, seed as i32, (seed >> 32) as i32),
        level_m: LEVEL_M + rise_m,
        bare_m: LEVEL_M + bare_m,
    };
    let terrain = Terrain::new(size_m, SPACING_M, |x, y| land.height_m(x, y));
    let (objects, buildings) = land.farms(&terrain, size_m, date);
    let cells = Cells::paint(size_m, CELL_M, |x, y| land.sample(&terrain, date, x, y), &objects);
    World::new(cells, terrain, Some(land.level_m), buildings, date.sun)
}

struct Farmland {
    seed: u32,
    level_m: f64,
    bare_m: f64,
}

impl Farmland {
    /// Distance to the usual shore, metres, positive on land, to some 100 m; further away it says little.
    fn shore_m(&self, x: f64, y: f64) -> f64 {
        let field = |x: f64, y: f64| {
            // Bent and turned, so that no noise shows its grid.
            let bend = |n: u32| 75.0 * f64::from(cloudy(self.seed ^ n, x / 260.0, y / 260.0));
            let (u, v) = (x + bend(21), y + bend(22));
            let large = cloudy(self.seed ^ 1, (0.8 * u - 0.6 * v) / 1150.0, (0.6 * u + 0.8 * v) / 1150.0);
            let small = smooth(self.seed ^ 2, (0.6 * u - 0.8 * v) / 330.0, (0.8 * u + 0.6 * v) / 330.0) - 0.62;
            // Ponds where the small field is lowest; lakes where the large one is.
            f64::from((large + 0.34).min(-0.55 * small))
        };
        const STEP_M: f64 = 6.0;
        let here = field(x, y);
        let slope = ((field(x + STEP_M, y) - here) / STEP_M).hypot((field(x, y + STEP_M) - here) / STEP_M);
        here / slope.max(4e-4)
    }

    fn height_m(&self, x: f64, y: f64) -> f64 {
        let fall = 0.043 + 0.023 * f64::from(smooth(self.seed ^ 3, x / 500.0, y / 500.0));
        let off_m = 70.0 * (self.shore_m(x, y) / 70.0).tanh();
        let hills_m = 3.0 + 3.0 * f64::from(cloudy(self.seed ^ 4, x / 900.0, y / 900.0));
        LEVEL_M + fall * off_m + hills_m * (off_m / 70.0).max(0.0).powi(2)
    }

    fn sample(&self, terrain: &Terrain, date: &SceneDate, x: f64, y: f64) -> Sample {
        let ground_m = terrain.height_m(x, y);
        if ground_m < self.level_m {
            return Sample { colour: self.water(date, ground_m, x, y), top_m: self.level_m as f32, kind: WATER };
        }
        let (colour, lift_m, kind) = self.road(x, y).unwrap_or_else(|| self.cover(date, ground_m, x, y));
        Sample { colour, top_m: (ground_m + lift_m) as f32, kind }
    }

    /// Green or dark, another on another day; the ground shows where it is shallow.
    fn water(&self, date: &SceneDate, ground_m: f64, x: f64, y: f64) -> [f32; 3] {
        let kind = smooth(self.seed ^ 5 ^ date.number, x / 1500.0, y / 1500.0);
        let green = ((kind + 0.5) / 0.8).clamp(0.0, 1.0);
        let deep: [f32; 3] = std::array::from_fn(|i| [52.0, 54.0, 48.0][i] + [34.0, 62.0, 30.0][i] * green);
        let shallow = (1.0 - (self.level_m - ground_m) / 0.35).clamp(0.0, 1.0) as f32 * 0.5;
        std::array::from_fn(|i| deep[i] + ([132.0, 120.0, 92.0][i] - deep[i]) * shallow)
    }

    /// Gravel roads on the section lines, two in three of the half-mile ones left out.
    fn road(&self, x: f64, y: f64) -> Option<([f32; 3], f64, u16)> {
        let near = |v: f64, other: f64| {
            let k = (v / QUARTER_M).round();
            let is_built = (k as i64).rem_euclid(2) == 0
                && chance(self.seed ^ 6, k as i32, (other / QUARTER_M).floor() as i32) < 0.8;
            if is_built { (v - k * QUARTER_M).abs() } else { f64::MAX }
        };
        let off_m = near(x, y).min(near(y, x));
        let tone = 1.0 + 0.07 * smooth(self.seed ^ 7, x / 5.0, y / 5.0);
        match off_m {
            d if d < 4.0 => Some(([196.0 * tone, 186.0 * tone, 164.0 * tone], 0.4, GROUND)),
            d if d < 12.0 => Some(([112.0 * tone, 124.0 * tone, 74.0 * tone], 0.0, GROUND)),
            _ => None,
        }
    }

    fn cover(&self, date: &SceneDate, ground_m: f64, x: f64, y: f64) -> ([f32; 3], f64, u16) {
        let ragged = f64::from(cloudy(self.seed ^ 8, x / 35.0, y / 35.0));
        let above_m = ground_m - self.bare_m + 0.12 * ragged;
        if above_m < 0.05 {
            // Mud, with salt where it dried first.
            let salt = 0.5 + 0.5 * cloudy(self.seed ^ 9, x / 60.0, y / 60.0);
            return ([150.0 + 46.0 * salt, 138.0 + 46.0 * salt, 118.0 + 46.0 * salt], 0.0, GROUND);
        }
        let tone = 1.0 + 0.13 * cloudy(self.seed ^ 10, x / 18.0, y / 18.0);
        if above_m < 0.5 {
            return (date.tinted([82.0, 96.0, 54.0], 0.5).map(|c| c * tone), 1.2, GREEN);
        }
        if above_m < 0.9 + 0.5 * ragged {
            return (date.tinted([118.0, 128.0, 78.0], 0.6).map(|c| c * tone), 0.2, GROUND);
        }
        (self.field(date, x, y), 0.0, GROUND)
    }

    /// The field of a point: quarter sections, some divided into strips.
    fn field(&self, date: &SceneDate, x: f64, y: f64) -> [f32; 3] {
        let quarter = [x, y].map(|v| (v / QUARTER_M).floor() as i32);
        let own = hash(self.seed ^ 11, quarter[0], quarter[1]);
        let inside = [x, y].map(|v| v.rem_euclid(QUARTER_M));
        let strips = [1.0, 2.0, 2.0, 4.0][(hash(own, 1, 1) % 4) as usize];
        let axis = (hash(own, 2, 2) % 2) as usize;
        let wander = 5.0 * f64::from(smooth(own, x / 160.0, y / 160.0));
        let strip = ((inside[axis] + wander) / QUARTER_M * strips).floor().clamp(0.0, strips - 1.0);
        let crop = hash(own, strip as i32, 3);
        const CROPS: [[f32; 3]; 6] = [
            [78.0, 112.0, 58.0],
            [98.0, 124.0, 66.0],
            [150.0, 138.0, 88.0],
            [112.0, 98.0, 68.0],
            [88.0, 104.0, 60.0],
            [172.0, 158.0, 112.0],
        ];
        let looks = date.seed_of(crop);
        let colour = CROPS[(hash(looks, 4, 4) % 6) as usize];
        let rows = 0.035
            * ((inside[1 - axis] / [9.0, 18.0, 24.0][(hash(looks, 5, 5) % 3) as usize]).rem_euclid(1.0) - 0.5).signum()
                as f32;
        // Soil shows through where the ground is high or wet; more on some fields.
        let soil = cloudy(self.seed ^ 12, x / 210.0, y / 210.0);
        let strength = 0.08 + 0.22 * chance(looks, 6, 6);
        let fine = 0.05 * cloudy(looks, x / 22.0, y / 22.0);
        let tone = 1.0 + rows + strength * soil + fine;
        let pale = (soil - 0.35).max(0.0) * 0.7;
        std::array::from_fn(|i| (colour[i] + ([178.0, 162.0, 122.0][i] - colour[i]) * pale) * tone)
    }

    /// Shelterbelts along quarter lines, and farmsteads at some of their corners.
    fn farms(&self, terrain: &Terrain, size_m: [f64; 2], date: &SceneDate) -> (Vec<SceneObject>, Vec<Building>) {
        let (mut objects, mut buildings) = (Vec::new(), Vec::new());
        let is_dry = |p: [f64; 2]| terrain.height_m(p[0], p[1]) > self.bare_m.max(self.level_m) + 0.6;
        let tree = |centre: [f64; 2], seed: u32, objects: &mut Vec<SceneObject>| {
            if is_dry(centre) {
                objects.push(SceneObject::Tree(Tree {
                    centre,
                    radius_m: 3.0 + 2.5 * f64::from(chance(seed, 1, 1)),
                    base_m: terrain.height_m(centre[0], centre[1]),
                    height_m: 7.0 + 5.0 * f64::from(chance(seed, 2, 2)),
                    colour: date.tinted([62.0, 82.0, 48.0], 0.3),
                    seed,
                }));
            }
        };
        let count = size_m.map(|size| (size / QUARTER_M).ceil() as i32);
        for j in 0..count[1] {
            for i in 0..count[0] {
                let own = hash(self.seed ^ 14, i, j);
                let corner = [f64::from(i) * QUARTER_M, f64::from(j) * QUARTER_M];
                let draw = |n: i32| f64::from(chance(own, n, 15));
                if draw(0) < 0.4 {
                    let is_east = draw(1) < 0.5;
                    for k in 0..(30 + (60.0 * draw(2)) as i32) {
                        let (along, aside) = (20.0 + 7.5 * f64::from(k), 18.0 + 3.0 * f64::from(chance(own, k, 16)));
                        let at = if is_east {
                            [corner[0] + along, corner[1] + aside]
                        } else {
                            [corner[0] + aside, corner[1] + along]
                        };
                        tree(at, hash(own, k, 17), &mut objects);
                    }
                }
                if draw(3) < 0.3 {
                    let yard = [corner[0] + 60.0 + 50.0 * draw(4), corner[1] + 60.0 + 50.0 * draw(5)];
                    for k in 0..26 {
                        let (angle, r) = (f64::from(k) * 0.21 + 2.0, 52.0 + 14.0 * f64::from(chance(own, k, 18)));
                        tree([yard[0] + r * angle.cos(), yard[1] + r * angle.sin()], hash(own, k, 19), &mut objects);
                    }
                    for k in 0..6 {
                        let place = |n: i32| f64::from(chance(own, k, n)) - 0.5;
                        let centre = [yard[0] + 70.0 * place(20), yard[1] + 70.0 * place(21)];
                        if is_dry(centre) {
                            let building = barn(centre, terrain, hash(own, k, 22), date);
                            objects.push(SceneObject::Building(buildings.len() as u16, building.clone()));
                            buildings.push(building);
                        }
                    }
                }
            }
        }
        debug_assert!(buildings.len() < usize::from(u16::MAX - FIRST_BUILDING));
        (objects, buildings)
    }
}

fn barn(centre: [f64; 2], terrain: &Terrain, seed: u32, date: &SceneDate) -> Building {
    let draw = |n: i32| f64::from(chance(seed, n, 23));
    let looks = date.seed_of(seed);
    const ROOFS: [[f32; 3]; 4] =
        [[206.0, 206.0, 202.0], [150.0, 152.0, 154.0], [136.0, 78.0, 64.0], [104.0, 98.0, 92.0]];
    Building {
        centre,
        half_m: [6.0 + 10.0 * draw(1), 4.0 + 4.0 * draw(2)],
        along: if draw(3) < 0.5 { [1.0, 0.0] } else { [0.0, 1.0] },
        base_m: terrain.height_m(centre[0], centre[1]),
        eave_m: 3.5 + 3.0 * draw(4),
        rise_m: 2.0,
        roof: Roof::Gable,
        roof_colour: ROOFS[(hash(looks, 5, 5) % 4) as usize],
        wall_colour: [176.0, 168.0, 156.0],
        seed,
        fittings_seed: looks,
    }
}
