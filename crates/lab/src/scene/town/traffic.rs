//! Cars and trees along streets, and the traffic of main roads.

use super::district::{Block, MAIN_HALF_M, Use};
use super::ground::is_street;
use super::standing::{REACH_M, Standing};
use crate::scene::noise::{chance, hash};

impl Standing<'_> {
    /// Adds cars and trees along all streets, and traffic.
    pub fn add_traffic(&mut self) {
        for number in 0..self.layout.districts.len() {
            let district = self.layout.districts[number];
            for block in district.blocks(REACH_M) {
                self.streetside(number, &block);
            }
        }
        self.main_road_cars();
    }

    /// Parked cars and trees along the two streets at a block's first u and first v.
    fn streetside(&mut self, number: usize, block: &Block) {
        let district = self.layout.districts[number];
        let (half_m, seed) = (district.half_m, block.seed(&district));
        if district.used == Use::Park {
            return;
        }
        let has_trees = chance(district.seed, 63, 0) < 0.55;
        let [u0, u1, v0, v1] = block.edges_m;
        let [i, j] = block.number;
        for (axis, from, to, line) in [(0, u0, u1, v0), (1, v0, v1, u0)] {
            let is_built = if axis == 0 { is_street(&district, 1, j, i) } else { is_street(&district, 0, i, j) };
            if !is_built {
                continue;
            }
            let count = ((to - from - 2.0 * half_m - 10.0) / 6.2).max(0.0) as i32;
            for k in 0..count {
                for side in [-1.0, 1.0] {
                    let along = from + half_m + 5.0 + 6.2 * (f64::from(k) + 0.5);
                    let own = hash(seed, 2 * k + i32::from(side > 0.0), 30 + axis as i32);
                    let at = |across: f64| {
                        if axis == 0 { [along, line + side * across] } else { [line + side * across, along] }
                    };
                    let looks = self.date.seed_of(own);
                    if chance(looks, 31, 0) < 0.42 {
                        self.car(number, at(half_m - 1.05), axis, looks);
                    }
                    if has_trees && k % 2 == 0 && chance(own, 32, 0) < 0.7 {
                        self.tree(number, at(half_m + 1.3), 1.6 + 1.9 * f64::from(chance(own, 33, 0)), own);
                    }
                }
            }
        }
    }

    /// Traffic: found by trying points of a grid and moving each into a lane of the main road it is near.
    fn main_road_cars(&mut self) {
        let size_m = [self.terrain.columns, self.terrain.rows].map(|n| (n - 1) as f64 * self.terrain.spacing_m);
        let pitch_m = 13.0;
        for j in 0..(size_m[1] / pitch_m) as i32 {
            for i in 0..(size_m[0] / pitch_m) as i32 {
                let looks = hash(self.date.number ^ 0x3a, i, j);
                let draw = |n: i32| f64::from(chance(looks, n, 40));
                let [x, y] = [(f64::from(i) + draw(0)) * pitch_m, (f64::from(j) + draw(1)) * pitch_m];
                let border = |x: f64, y: f64| self.layout.place(x, y).border_m;
                let (b, bx, by) = (border(x, y), border(x + 0.5, y), border(x, y + 0.5));
                let (gx, gy) = (2.0 * (bx - b), 2.0 * (by - b));
                let norm = gx.hypot(gy);
                if b < MAIN_HALF_M && norm > 0.6 && draw(2) < 0.5 {
                    let lane_m = if draw(3) < 0.35 { MAIN_HALF_M - 1.1 } else { 1.9 };
                    let step_m = (lane_m - b) / norm;
                    let centre = [x + gx / norm * step_m, y + gy / norm * step_m];
                    self.park(centre, [-gy / norm, gx / norm], looks);
                }
            }
        }
    }
}
