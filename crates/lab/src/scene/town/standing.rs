//! What stands in a town: houses, sheds, halls, trees, cars.

use super::district::{Block, MAIN_REACH_M, TownLayout, Use};
use super::ground::is_car_park;
use super::lot::{Lot, lots};
use super::paint::{LEVEL, PAINTS, PITCHED, WALLS, pick};
use crate::scene::building::{Building, Roof};
use crate::scene::date::SceneDate;
use crate::scene::noise::{chance, hash};
use crate::scene::objects::{SceneObject, Slab, Tree};
use crate::scene::terrain::Terrain;

/// The reach of a district from its middle, metres.
pub(super) const REACH_M: f64 = 330.0;

/// Everything that stands in a town on a day.
pub struct Standing<'a> {
    pub(super) layout: &'a TownLayout,
    pub(super) terrain: &'a Terrain,
    pub(super) date: &'a SceneDate,
    /// What was placed.
    pub objects: Vec<SceneObject>,
    /// The buildings, by number.
    pub buildings: Vec<Building>,
}

/// A rectangle for a building, in the district's coordinates.
struct Plot {
    uv: [f64; 2],
    /// Half the size along u and v, metres.
    half_m: [f64; 2],
    eave_m: f64,
    rise_m: f64,
    roof: Roof,
    seed: u32,
    /// Turned against the street, radians.
    turn_rad: f64,
}

impl<'a> Standing<'a> {
    /// Places houses, trees and what stands beside them.
    pub fn new(layout: &'a TownLayout, terrain: &'a Terrain, date: &'a SceneDate) -> Self {
        let mut standing = Self { layout, terrain, date, objects: Vec::new(), buildings: Vec::new() };
        for number in 0..layout.districts.len() {
            let district = layout.districts[number];
            for block in district.blocks(REACH_M) {
                match district.used {
                    Use::Houses | Use::Rows => {
                        for lot in lots(&district, &block) {
                            standing.lot(number, &lot);
                        }
                    }
                    Use::Flats => standing.flats(number, &block),
                    Use::Works => standing.works(number, &block),
                    Use::Park => standing.grove(number, &block, 70),
                }
            }
        }
        standing
    }

    /// The point of a district's coordinates, if it lies in the district and farther than `clear_m` from its main roads.
    fn free(&self, number: usize, uv: [f64; 2], clear_m: f64) -> Option<[f64; 2]> {
        let point = self.layout.districts[number].point(uv);
        let place = self.layout.place(point[0], point[1]);
        let most = [self.terrain.columns, self.terrain.rows].map(|n| (n - 1) as f64 * self.terrain.spacing_m);
        let is_inside = (0..2).all(|axis| point[axis] > -20.0 && point[axis] < most[axis] + 20.0);
        (is_inside && place.district == number && place.border_m > MAIN_REACH_M + clear_m).then_some(point)
    }

    /// Builds on a plot. Returns whether there was room.
    fn build(&mut self, number: usize, plot: &Plot) -> bool {
        let clear_m = 0.75 * plot.half_m[0].max(plot.half_m[1]) + 0.2 * plot.half_m[0].min(plot.half_m[1]);
        let Some(centre) = self.free(number, plot.uv, clear_m) else { return false };
        let [ux, uy] = self.layout.districts[number].along(plot.uv);
        let (sin, cos) = plot.turn_rad.sin_cos();
        let along_u = [ux * cos - uy * sin, uy * cos + ux * sin];
        let (half_m, along) = if plot.half_m[0] >= plot.half_m[1] {
            (plot.half_m, along_u)
        } else {
            ([plot.half_m[1], plot.half_m[0]], [-along_u[1], along_u[0]])
        };
        let looks = self.date.seed_of(plot.seed);
        let (tint, shade) = (chance(looks, 1, 2), chance(looks, 3, 4));
        let roof_colour = if plot.roof == Roof::Flat { pick(&LEVEL, tint, shade) } else { pick(&PITCHED, tint, shade) };
        let building = Building {
            centre,
            half_m,
            along,
            base_m: self.terrain.height_m(centre[0], centre[1]),
            eave_m: plot.eave_m,
            rise_m: plot.rise_m,
            roof: plot.roof,
            roof_colour,
            wall_colour: pick(&WALLS, chance(plot.seed, 5, 6), chance(plot.seed, 7, 8)),
            seed: plot.seed,
            fittings_seed: looks,
        };
        let id = self.buildings.len() as u16;
        self.objects.push(SceneObject::Building(id, building.clone()));
        self.buildings.push(building);
        true
    }

    /// A tree; on another day its crown has another shape and size, and some are felled or planted.
    pub(super) fn tree(&mut self, number: usize, uv: [f64; 2], radius_m: f64, seed: u32) {
        let looks = self.date.seed_of(seed);
        if chance(looks, 8, 1) < 0.2 {
            return;
        }
        let radius_m = radius_m * (0.8 + 0.4 * f64::from(chance(looks, 8, 2)));
        if let Some(centre) = self.free(number, uv, -1.0) {
            let kind = chance(seed, 1, 1);
            let green = if kind < 0.2 { [52.0, 74.0, 50.0] } else { [68.0 + 22.0 * kind, 92.0 + 14.0 * kind, 46.0] };
            self.objects.push(SceneObject::Tree(Tree {
                centre,
                radius_m,
                base_m: self.terrain.height_m(centre[0], centre[1]),
                height_m: radius_m * (1.7 + 1.3 * f64::from(chance(seed, 2, 2))),
                colour: self.date.tinted(green, if kind < 0.2 { 0.0 } else { 0.35 }),
                seed: looks,
            }));
        }
    }

    fn lot(&mut self, number: usize, lot: &Lot) {
        let used = self.layout.districts[number].used;
        if lot.draw(1) < 0.05 {
            return self.garden_trees(number, lot, 7);
        }
        let (width_m, depth_m) = (lot.width_m(), lot.depth_m());
        let setback_m = lot.setback_m(used);
        let turn_rad = if used == Use::Houses { 0.08 * (lot.draw(2) - 0.5) } else { 0.0 };
        let half_m = if used == Use::Rows {
            [0.5 * width_m, 5.0 + 1.6 * lot.draw(3)]
        } else {
            [(0.5 * width_m - 2.2).min(4.2 + 3.6 * lot.draw(4)), 3.8 + 2.4 * lot.draw(3)]
        };
        let roof = match lot.draw(5) {
            v if v < 0.58 => Roof::Gable,
            v if v < 0.8 => Roof::Hip,
            _ => Roof::Flat,
        };
        let floors =
            if used == Use::Rows { 2.0 + (3.6 * lot.draw(6)).floor() } else { 1.0 + (1.7 * lot.draw(6)).floor() };
        let rise_m = if roof == Roof::Flat { 0.0 } else { half_m[1].min(half_m[0]) * (0.5 + 0.5 * lot.draw(7)) };
        let middle_s = 0.5 * width_m + if used == Use::Houses { 1.6 * (lot.draw(8) - 0.5) } else { 0.0 };
        let uv = lot.uv([middle_s, setback_m + half_m[1]]);
        let plot = Plot { uv, half_m, eave_m: 0.8 + 2.8 * floors, rise_m, roof, seed: hash(lot.seed, 1, 0), turn_rad };
        let is_built = self.build(number, &plot);
        if is_built && lot.draw(9) < 0.4 {
            // A wing towards the garden.
            let wing = [0.5 * half_m[0], 2.0 + 1.8 * lot.draw(10)];
            let side = if lot.draw(11) < 0.5 { -0.45 } else { 0.45 };
            let uv = lot.uv([middle_s + side * half_m[0], setback_m + 2.0 * half_m[1] + wing[1] - 0.3]);
            let eave_m = if lot.draw(12) < 0.5 { plot.eave_m } else { 3.2 };
            self.build(number, &Plot { uv, half_m: wing, eave_m, rise_m: 0.5 * rise_m, ..plot });
        }
        if lot.draw(13) < 0.6 {
            let half_m = [1.2 + 2.2 * lot.draw(14), 1.2 + 1.6 * lot.draw(15)];
            let uv = lot.uv([
                1.0 + half_m[0] + (width_m - 2.0 * half_m[0] - 2.0).max(0.0) * lot.draw(16),
                depth_m - half_m[1] - 0.8,
            ]);
            let roof = if lot.draw(17) < 0.5 { Roof::Flat } else { Roof::Gable };
            self.build(
                number,
                &Plot { uv, half_m, eave_m: 2.3, rise_m: 0.8, roof, seed: hash(lot.seed, 2, 0), turn_rad },
            );
        }
        self.garden_trees(number, lot, 5);
        self.drive_car(number, lot);
    }

    fn garden_trees(&mut self, number: usize, lot: &Lot, most: u32) {
        let count = (f64::from(most + 1) * lot.draw(40)) as u32;
        for k in 0..count {
            let draw = |n: u32| lot.draw(41 + 7 * k + n);
            let t = if draw(0) < 0.25 { 1.5 } else { lot.depth_m() * (0.55 + 0.45 * draw(1)) };
            let radius_m = 0.9 + 4.6 * draw(2) * draw(3);
            self.tree(number, lot.uv([lot.width_m() * draw(4), t]), radius_m, hash(lot.seed, 60, k as i32));
        }
    }

    fn drive_car(&mut self, number: usize, lot: &Lot) {
        let looks = self.date.seed_of(hash(lot.seed, 9, 9));
        if lot.draw(33) < 0.75 && chance(looks, 1, 1) < 0.55 {
            let s = if lot.draw(32) < 0.5 { 1.9 } else { lot.width_m() - 1.9 };
            let uv = lot.uv([s, 2.6 + 2.0 * f64::from(chance(looks, 2, 1))]);
            self.car(number, uv, 1, looks);
        }
    }

    /// A car (some are vans) along an axis of the district.
    pub(super) fn car(&mut self, number: usize, uv: [f64; 2], axis: usize, looks: u32) {
        if let Some(centre) = self.free(number, uv, 0.5) {
            let [ux, uy] = self.layout.districts[number].along(uv);
            self.park(centre, if axis == 0 { [ux, uy] } else { [-uy, ux] }, looks);
        }
    }

    pub(super) fn park(&mut self, centre: [f64; 2], along: [f64; 2], looks: u32) {
        let draw = |n: i32| chance(looks, n, 12);
        let is_van = draw(0) < 0.12;
        let is_backwards = draw(1) < 0.5;
        self.objects.push(SceneObject::Slab(Slab {
            centre,
            half_m: if is_van { [2.7 + 0.9 * f64::from(draw(2)), 1.05] } else { [2.0 + 0.4 * f64::from(draw(2)), 0.9] },
            along: if is_backwards { along.map(|v| -v) } else { along },
            base_m: self.terrain.height_m(centre[0], centre[1]),
            height_m: if is_van { 2.3 } else { 1.5 },
            colour: pick(&PAINTS, draw(3), draw(4)),
            is_car: true,
        }));
    }

    fn flats(&mut self, number: usize, block: &Block) {
        let district = self.layout.districts[number];
        let seed = block.seed(&district);
        let [u0, u1, v0, v1] = block.inner_m(&district);
        let start_m = u0 + 0.25 * (u1 - u0);
        let draw = |n: i32| f64::from(chance(seed, n, 21));
        let is_along = draw(0) < 0.6;
        let count = if is_along { 2 } else { 3 };
        for k in 0..count {
            let part = (f64::from(k) + 0.5) / f64::from(count);
            let (uv, half_m) = if is_along {
                ([0.5 * (start_m + u1), v0 + part * (v1 - v0)], [0.4 * (u1 - start_m), 5.2 + 1.5 * draw(1)])
            } else {
                ([start_m + part * (u1 - start_m), 0.5 * (v0 + v1)], [5.2 + 1.5 * draw(1), 0.36 * (v1 - v0)])
            };
            let is_flat = draw(2) < 0.7;
            let (roof, rise_m) = if is_flat { (Roof::Flat, 0.0) } else { (Roof::Gable, 2.6) };
            let eave_m = 0.9 + 2.9 * (3.0 + (3.5 * draw(3 + k)).floor());
            self.build(number, &Plot { uv, half_m, eave_m, rise_m, roof, seed: hash(seed, k, 22), turn_rad: 0.0 });
        }
        self.car_park(number, block, 0);
        self.grove(number, block, 16);
    }

    fn works(&mut self, number: usize, block: &Block) {
        let district = self.layout.districts[number];
        let seed = block.seed(&district);
        let [u0, u1, v0, v1] = block.inner_m(&district);
        let start_m = u0 + 0.33 * (u1 - u0);
        let draw = |n: i32| f64::from(chance(seed, n, 23));
        let split_m = start_m + (0.35 + 0.3 * draw(0)) * (u1 - start_m);
        for (k, (from, to)) in [(start_m, split_m - 4.0), (split_m + 4.0, u1 - 4.0)].into_iter().enumerate() {
            let n = 10 * (k as i32 + 1);
            let depth_m = (0.5 + 0.4 * draw(n)) * (v1 - v0 - 8.0);
            let uv = [
                0.5 * (from + to),
                if draw(n + 1) < 0.5 { v0 + 4.0 + 0.5 * depth_m } else { v1 - 4.0 - 0.5 * depth_m },
            ];
            let is_flat = draw(n + 2) < 0.65;
            let (roof, rise_m) = if is_flat { (Roof::Flat, 0.0) } else { (Roof::Gable, 0.12 * depth_m) };
            let half_m = [0.5 * (to - from), 0.5 * depth_m];
            let plot = Plot {
                uv,
                half_m,
                eave_m: 5.0 + 5.0 * draw(n + 3),
                rise_m,
                roof,
                seed: hash(seed, n, 24),
                turn_rad: 0.0,
            };
            self.build(number, &plot);
        }
        self.car_park(number, block, 1);
        // Containers and heaps in the yard.
        let looks = self.date.seed_of(seed);
        for k in 0..14 {
            let place = |n: i32| f64::from(chance(looks, k, n));
            let uv = [start_m + place(30) * (u1 - start_m), v0 + 3.0 + place(31) * (v1 - v0 - 6.0)];
            if let Some(centre) = self.free(number, uv, 2.0) {
                let [ux, uy] = district.along(uv);
                self.objects.push(SceneObject::Slab(Slab {
                    centre,
                    half_m: [1.5 + 3.0 * place(32), 1.2],
                    along: if place(33) < 0.5 { [ux, uy] } else { [-uy, ux] },
                    base_m: self.terrain.height_m(centre[0], centre[1]),
                    height_m: 0.8 + 1.8 * place(34),
                    colour: pick(&PAINTS, chance(looks, k, 35), 0.5),
                    is_car: false,
                }));
            }
        }
    }

    /// Cars on the marked places of a block, across `axis`.
    fn car_park(&mut self, number: usize, block: &Block, axis: usize) {
        let district = self.layout.districts[number];
        let [u0, u1, v0, v1] = block.inner_m(&district);
        let full = 0.35 + 0.5 * f64::from(chance(block.seed(&district), 26, 0));
        let (bay_m, row_m) = if axis == 0 { ([2.6, 16.0], 2.5) } else { ([15.0, 2.7], 2.5) };
        let count = [((u1 - u0) / bay_m[0]) as i32, ((v1 - v0) / bay_m[1]) as i32];
        for j in 0..=count[1] {
            for i in 0..=count[0] {
                let inside = if axis == 0 { [1.3, row_m] } else { [row_m, 1.35] };
                let uv = [u0 + f64::from(i) * bay_m[0] + inside[0], v0 + f64::from(j) * bay_m[1] + inside[1]];
                let looks = self.date.seed_of(hash(block.seed(&district), i, j));
                if is_car_park(&district, block, uv) && f64::from(chance(looks, 27, 0)) < full {
                    self.car(number, uv, 1 - axis, looks);
                }
            }
        }
    }

    /// Trees strewn over a block.
    fn grove(&mut self, number: usize, block: &Block, most: u32) {
        let district = self.layout.districts[number];
        let seed = hash(block.seed(&district), 28, 0);
        let [u0, u1, v0, v1] = if district.used == Use::Park { block.edges_m } else { block.inner_m(&district) };
        for k in 0..most as i32 {
            let draw = |n: i32| f64::from(chance(seed, k, n));
            let uv = [u0 + draw(0) * (u1 - u0), v0 + draw(1) * (v1 - v0)];
            if !(district.used == Use::Flats && is_car_park(&district, block, uv)) {
                self.tree(number, uv, 1.6 + 4.2 * draw(2) * draw(3), hash(seed, k, 9));
            }
        }
    }
}
