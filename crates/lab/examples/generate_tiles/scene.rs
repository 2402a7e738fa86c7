//! `FarmlandScene`: the plan of an invented piece of farmland: parcels, roads, river, lake, village, woods, and what changes
//! between its two epochs.

use crate::curve::Curve;
use crate::noise::{chance, cloudy, smooth};
use crate::objects::{Building, Roof, Tree};
use crate::parcels::{ParcelPlace, Parcels};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Width (towards east) and height (towards south) of the scene, metres.
pub const SIZE_M: [f64; 2] = [2560.0, 2048.0];

/// The use of a piece of land.
#[derive(Clone, Copy, PartialEq)]
pub enum LandUse {
    /// Ploughed; which crop depends on the epoch.
    Arable,
    /// Grass in both epochs.
    Meadow,
    /// Forest.
    Wood,
    /// Forest that is felled before the second epoch.
    FelledWood,
    /// Forest planted shortly before the first epoch.
    YoungWood,
    /// Between the village's houses.
    Garden,
    /// Fruit trees in rows.
    Orchard,
}

/// The plan.
pub struct FarmlandScene {
    /// Seed of all its noise.
    pub seed: u32,
    /// The fields.
    pub parcels: Parcels,
    /// Use of each parcel.
    pub uses: Vec<LandUse>,
    /// The main road, 7 m of asphalt.
    pub main_road: Curve,
    /// Side roads, 4.6 m of asphalt.
    pub side_roads: Vec<Curve>,
    /// Gravel drives and tracks.
    pub drives: Vec<Curve>,
    /// A single-track railway.
    pub railway: Curve,
    /// The river's middle.
    pub river: Curve,
    /// Houses, barns, halls, with the epochs in which they stand.
    pub buildings: Vec<(Building, [bool; 2])>,
    /// Farmyards: middle and radius.
    pub yards: Vec<([f64; 2], f64)>,
}

const VILLAGE: [f64; 2] = [1265.0, 1235.0];
const WOODS: [([f64; 2], f64); 4] =
    [([2200.0, 430.0], 330.0), ([1960.0, 1760.0], 290.0), ([110.0, 330.0], 260.0), ([980.0, 120.0], 170.0)];
const LAKE: ([f64; 2], f64) = ([905.0, 1730.0], 118.0);

impl FarmlandScene {
    /// The same plan for the same seed.
    pub fn plan(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let noise_seed = rng.random();
        let parcels = Parcels::cut(SIZE_M, &mut rng, noise_seed);
        let uses = parcels.parcels.iter().enumerate().map(|(i, p)| use_of(i, p.centre, noise_seed)).collect();
        let through = Curve::through;
        let mut scene = Self {
            seed: noise_seed,
            parcels,
            uses,
            main_road: through(&[
                [-80.0, 1425.0],
                [480.0, 1335.0],
                [880.0, 1205.0],
                [1300.0, 1150.0],
                [1720.0, 1085.0],
                [2080.0, 945.0],
                [2650.0, 905.0],
            ]),
            side_roads: vec![
                through(&[[1345.0, -80.0], [1290.0, 300.0], [1165.0, 690.0], [1235.0, 980.0], [1300.0, 1150.0]]),
                through(&[[1300.0, 1150.0], [1400.0, 1470.0], [1330.0, 1790.0], [1420.0, 2130.0]]),
                through(&[[1080.0, 1177.0], [1120.0, 1300.0], [1235.0, 1355.0], [1358.0, 1330.0]]),
                through(&[[2080.0, 945.0], [2190.0, 1220.0], [2420.0, 1420.0], [2650.0, 1500.0]]),
            ],
            drives: vec![
                through(&[[1165.0, 690.0], [940.0, 640.0], [760.0, 700.0], [590.0, 690.0]]),
                through(&[[480.0, 1335.0], [380.0, 1560.0], [300.0, 1800.0], [330.0, 2130.0]]),
                through(&[[1720.0, 1085.0], [1690.0, 1400.0], [1800.0, 1620.0]]),
                through(&[[1290.0, 300.0], [1560.0, 350.0], [1900.0, 380.0], [2150.0, 520.0]]),
                through(&[[1330.0, 1790.0], [1120.0, 1760.0], [1010.0, 1735.0]]),
                through(&[[-80.0, 840.0], [150.0, 900.0], [330.0, 1080.0], [480.0, 1335.0]]),
            ],
            railway: through(&[[1560.0, -80.0], [1800.0, 180.0], [2080.0, 620.0], [2300.0, 780.0], [2650.0, 860.0]]),
            river: through(&[
                [430.0, -80.0],
                [540.0, 210.0],
                [455.0, 430.0],
                [560.0, 690.0],
                [650.0, 930.0],
                [560.0, 1180.0],
                [610.0, 1400.0],
                [740.0, 1600.0],
                [700.0, 1830.0],
                [800.0, 2130.0],
            ]),
            buildings: Vec::new(),
            yards: Vec::new(),
        };
        scene.build_village(&mut rng);
        scene.build_farms(&mut rng);
        scene
    }

    /// Places houses along the village's roads.
    fn build_village(&mut self, rng: &mut ChaCha8Rng) {
        let lines: Vec<_> =
            self.side_roads.iter().take(3).chain([&self.main_road]).flat_map(|c| c.stations(20.0)).collect();
        for (at, along) in lines {
            let far = (at[0] - VILLAGE[0]).hypot(at[1] - VILLAGE[1]);
            for side in [-1.0, 1.0] {
                if far > 270.0 || rng.random_bool(0.22 + 0.4 * (far / 270.0)) {
                    continue;
                }
                let back = rng.random_range(14.0..24.0) * side;
                let centre = [at[0] - along[1] * back, at[1] + along[0] * back];
                let across = rng.random_bool(0.35);
                let axis = if across { [-along[1], along[0]] } else { along };
                let house = Building {
                    centre,
                    along: axis,
                    half_m: [rng.random_range(5.0..8.5), rng.random_range(4.0..5.5)],
                    eaves_m: rng.random_range(3.2..6.0),
                    ridge_m: rng.random_range(7.0..9.5),
                    roof: if rng.random_bool(0.7) { Roof::Tile } else { Roof::Slate },
                };
                let age = rng.random_range(0..20);
                self.place_building(house, [age != 0 && age != 1, age != 2]);
                if rng.random_bool(0.55) {
                    self.build_shed(at, along, axis, back, rng);
                }
            }
        }
    }

    /// Places a shed behind a house that stands `back` metres beside a place on a road.
    fn build_shed(&mut self, at: [f64; 2], along: [f64; 2], axis: [f64; 2], back: f64, rng: &mut ChaCha8Rng) {
        let shed_back = back + back.signum() * rng.random_range(14.0..22.0);
        let slip = rng.random_range(-6.0..6.0);
        let shed = Building {
            centre: [at[0] - along[1] * shed_back + along[0] * slip, at[1] + along[0] * shed_back + along[1] * slip],
            along: axis,
            half_m: [rng.random_range(3.0..9.0), rng.random_range(2.5..4.5)],
            eaves_m: 2.6,
            ridge_m: rng.random_range(3.6..5.5),
            roof: if rng.random_bool(0.5) { Roof::Slate } else { Roof::Tile },
        };
        self.place_building(shed, [true, rng.random_bool(0.9)]);
    }

    /// Places farms in the open.
    fn build_farms(&mut self, rng: &mut ChaCha8Rng) {
        let farms = [
            [775.0, 735.0],
            [2215.0, 1190.0],
            [405.0, 1600.0],
            [1705.0, 1330.0],
            [1600.0, 390.0],
            [1835.0, 1010.0],
            [205.0, 960.0],
        ];
        for (i, at) in farms.into_iter().enumerate() {
            self.yards.push((at, rng.random_range(24.0..36.0)));
            let turn = rng.random_range(0.0..std::f64::consts::PI);
            let axis: [f64; 2] = [f64::cos(turn), f64::sin(turn)];
            let beside = |u: f64, v: f64| [at[0] + axis[0] * u - axis[1] * v, at[1] + axis[1] * u + axis[0] * v];
            let hall =
                |centre, half_m, roof| Building { centre, along: axis, half_m, eaves_m: 4.5, ridge_m: 7.5, roof };
            self.place_building(hall(beside(-6.0, 27.0), [rng.random_range(16.0..26.0), 8.5], Roof::Metal), [true; 2]);
            self.place_building(hall(beside(-24.0, -6.0), [6.0, 12.0], Roof::Tile), [true; 2]);
            self.place_building(hall(beside(8.0, -21.0), [8.5, 5.0], Roof::Tile), [true; 2]);
            // One farm builds a hall between the epochs, another pulls one down.
            self.place_building(
                hall(beside(34.0, 2.0), [7.0, rng.random_range(12.0..20.0)], Roof::Slate),
                [i != 1 && i != 4, i != 2],
            );
        }
    }

    /// Keeps a building where no road, river or other building is in its way.
    fn place_building(&mut self, building: Building, stands: [bool; 2]) {
        let reach = building.half_m[0].hypot(building.half_m[1]);
        let [x, y] = building.centre;
        let free_of = |curve: &Curve, clear: f64| curve.beside(x, y).is_none_or(|b| b.offset_m.abs() > clear);
        let free = free_of(&self.main_road, building.half_m[1] + 6.0)
            && free_of(&self.river, reach + 10.0)
            && self.side_roads.iter().all(|r| free_of(r, building.half_m[1] + 4.5))
            && self.buildings.iter().all(|(b, _)| {
                (b.centre[0] - x).hypot(b.centre[1] - y) > 0.8 * (reach + b.half_m[0].hypot(b.half_m[1]))
            });
        if free {
            self.buildings.push((building, stands));
        }
    }

    /// Whether a wood stands at a point in an epoch, and how grown: 0 none, 1 full.
    fn wood(&self, place: &ParcelPlace, epoch: usize) -> f64 {
        match (self.uses[place.parcel], epoch) {
            (LandUse::Wood, _) | (LandUse::FelledWood, 0) | (LandUse::YoungWood, 1) => 1.0,
            (LandUse::YoungWood, _) => 0.25,
            _ => 0.0,
        }
    }

    /// Distance from the lake's shore at high water, metres; positive outside.
    pub fn beyond_lake_m(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (x - LAKE.0[0], (y - LAKE.0[1]) * 1.35);
        let r = dx.hypot(dy);
        let angle = dy.atan2(dx);
        let shape = f64::from(smooth(self.seed + 40, 2.0 * angle.cos() + 5.0, 2.0 * angle.sin())) * 26.0;
        r - LAKE.1 - shape - 4.0 * f64::from(smooth(self.seed + 41, x / 12.0, y / 12.0))
    }

    /// Half the river's width there, metres.
    pub fn river_half_m(&self, along_m: f64) -> f64 {
        6.5 + 2.5 * f64::from(smooth(self.seed + 42, along_m / 90.0, 0.0))
            + f64::from(smooth(self.seed + 43, along_m / 9.0, 0.0))
    }

    /// Whether roads, rails, water, yards or houses keep trees away.
    fn is_kept_clear(&self, x: f64, y: f64, epoch: usize) -> bool {
        let near = |curve: &Curve, m: f64| curve.beside(x, y).is_some_and(|b| b.offset_m.abs() < m);
        near(&self.main_road, 6.0)
            || near(&self.railway, 8.0)
            || self.side_roads.iter().any(|c| near(c, 4.5))
            || self.drives.iter().any(|c| near(c, 3.5))
            || self.river.beside(x, y).is_some_and(|b| b.offset_m.abs() < self.river_half_m(b.along_m) + 1.0)
            || self.beyond_lake_m(x, y) < 1.5
            || self.yards.iter().any(|(c, r)| (c[0] - x).hypot(c[1] - y) < r - 2.0)
            || self.buildings.iter().any(|(b, stands)| stands[epoch] && b.is_near([x, y], 2.5))
    }

    /// Every tree of an epoch.
    pub fn trees(&self, epoch: usize) -> Vec<Tree> {
        const GRID_M: f64 = 5.2;
        let (columns, rows) = ((SIZE_M[0] / GRID_M) as i32, (SIZE_M[1] / GRID_M) as i32);
        let mut trees = Vec::new();
        for j in -2..rows + 2 {
            for i in -2..columns + 2 {
                let dice = |k: u32| f64::from(chance(self.seed + 100 + k, i, j));
                let (x, y) =
                    ((f64::from(i) + 0.15 + 0.7 * dice(0)) * GRID_M, (f64::from(j) + 0.15 + 0.7 * dice(1)) * GRID_M);
                if let Some(tree) = self.tree_at(x, y, epoch, dice) {
                    trees.push(tree);
                }
            }
        }
        for (k, (at, along)) in self.main_road.stations(14.0).into_iter().enumerate() {
            for side in [-1.0, 1.0] {
                let dice = |s: u32| f64::from(chance(self.seed + 200 + s, k as i32, side as i32));
                let p = [at[0] - along[1] * 8.0 * side, at[1] + along[0] * 8.0 * side];
                if dice(0) < 0.6 && !self.is_kept_clear(p[0], p[1], epoch) && !(epoch == 1 && dice(1) < 0.08) {
                    trees.push(Tree::broad(p, 2.6 + 1.4 * dice(2) + 0.3 * epoch as f64, dice(3)));
                }
            }
        }
        trees
    }

    /// The tree of one grid cell, where one grows.
    fn tree_at(&self, x: f64, y: f64, epoch: usize, dice: impl Fn(u32) -> f64) -> Option<Tree> {
        let place = self.parcels.place(x, y, epoch);
        let grown = 1.0 + 0.1 * epoch as f64;
        let is_lost = dice(9) < 0.03 * (1.0 + epoch as f64);
        let edge = place.boundary_m + 3.0 * f64::from(smooth(self.seed + 30, x / 14.0, y / 14.0));
        let wood = self.wood(&place, epoch);
        let river_m = self.river.beside(x, y).map(|b| b.offset_m.abs() - self.river_half_m(b.along_m));
        let tree = if wood > 0.0 && edge > 4.0 {
            let conifer = smooth(self.seed + 31, x / 130.0, y / 130.0) + 0.5 * (dice(3) as f32 - 0.5) > 0.12;
            let (r, tone) = (2.0 + 1.9 * dice(2), dice(4));
            let size = wood.max(0.4) * grown;
            if conifer {
                Tree::conifer([x, y], (r * 0.8 + 0.3) * size, tone)
            } else {
                Tree::broad([x, y], (r + 0.5) * size, tone)
            }
        } else if river_m.is_some_and(|d| d < 9.0) && cloudy(self.seed + 32, x / 60.0, y / 60.0) > -0.05 {
            (dice(2) < 0.7).then(|| Tree::broad([x, y], (2.2 + 2.0 * dice(3)) * grown, dice(4)))?
        } else if self.beyond_lake_m(x, y) < 14.0 && cloudy(self.seed + 33, x / 40.0, y / 40.0) > 0.1 {
            Tree::broad([x, y], (2.0 + 2.0 * dice(3)) * grown, dice(4))
        } else if self.has_hedge(&place) && place.boundary_m < 2.2 && dice(2) < 0.3 {
            Tree::broad([x, y], (2.2 + 2.2 * dice(3)) * grown, dice(4))
        } else if self.uses[place.parcel] == LandUse::Garden && dice(2) < 0.13 {
            Tree::broad([x, y], (1.5 + 2.5 * dice(3)) * grown, dice(4))
        } else if self.uses[place.parcel] == LandUse::Orchard {
            // One tree where a row crosses this cell.
            let on = |v: f64, step: f64| (v / step).fract().abs() < GRID_SHARE;
            (on(place.along_m, 10.4) && on(place.across_m, 10.4) && place.edge_m > 5.0)
                .then(|| Tree::broad([x, y], 2.1 * grown, dice(4)))?
        } else if dice(2) < 0.0006 && place.boundary_m > 10.0 {
            Tree::broad([x, y], 4.5 * grown, dice(4))
        } else {
            return None;
        };
        (!is_lost && !self.is_kept_clear(x, y, epoch)).then_some(tree)
    }

    /// Whether the boundary nearest to a place carries a hedge.
    pub fn has_hedge(&self, place: &ParcelPlace) -> bool {
        (2..9).contains(&place.boundary.1) && self.parcels.chance_of(place.boundary.0, 1) < 0.33
    }

    /// Whether the boundary nearest to a place carries a track.
    pub fn has_track(&self, place: &ParcelPlace) -> bool {
        place.boundary.1 < 6 && self.parcels.chance_of(place.boundary.0, 2) < 0.45 && !self.has_hedge(place)
    }
}

const GRID_SHARE: f64 = 0.5;

fn use_of(parcel: usize, centre: [f64; 2], seed: u32) -> LandUse {
    let far = |c: [f64; 2]| (c[0] - centre[0]).hypot(c[1] - centre[1]);
    let dice = |k: u32| chance(seed + 300 + k, parcel as i32, 5);
    if far(VILLAGE) < 165.0 {
        return LandUse::Garden;
    }
    if WOODS.iter().any(|(c, r)| far(*c) < *r) && dice(0) < 0.85 {
        return match dice(1) {
            v if v < 0.10 => LandUse::FelledWood,
            v if v < 0.18 => LandUse::YoungWood,
            _ => LandUse::Wood,
        };
    }
    match dice(2) {
        v if v < 0.035 => LandUse::Wood,
        v if v < 0.07 || (far(VILLAGE) < 330.0 && v < 0.35) => LandUse::Orchard,
        v if v < 0.24 => LandUse::Meadow,
        _ => LandUse::Arable,
    }
}
