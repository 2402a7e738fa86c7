//! `Building`: an upright block with walls and a roof.

use super::noise::{chance, hash, smooth};

/// The shape of a roof.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Roof {
    /// Two slopes; the ridge runs along the length.
    Gable,
    /// Four slopes.
    Hip,
    /// Level, with a parapet.
    Flat,
}

/// An upright block on a rectangle.
#[derive(Debug, Clone)]
pub struct Building {
    /// Metres east and south.
    pub centre: [f64; 2],
    /// Half the length and half the width, metres.
    pub half_m: [f64; 2],
    /// Unit vector along the length, east and south.
    pub along: [f64; 2],
    /// Height of the ground, metres.
    pub base_m: f64,
    /// From the ground to the eaves, metres.
    pub eave_m: f64,
    /// From the eaves to the ridge, metres.
    pub rise_m: f64,
    /// The shape of the roof.
    pub roof: Roof,
    /// Colour of the roof.
    pub roof_colour: [f32; 3],
    /// Colour of the walls.
    pub wall_colour: [f32; 3],
    /// What stays: walls, windows, chimney.
    pub seed: u32,
    /// What changes between dates: panels, patches, things on a flat roof.
    pub fittings_seed: u32,
}

impl Building {
    /// The place of a point along and across the building, metres from its centre.
    pub fn local(&self, x_m: f64, y_m: f64) -> [f64; 2] {
        let (dx, dy) = (x_m - self.centre[0], y_m - self.centre[1]);
        [dx * self.along[0] + dy * self.along[1], dy * self.along[0] - dx * self.along[1]]
    }

    /// Colour and height, metres, of the roof at a point; `None` beside it.
    pub fn roof_at(&self, x_m: f64, y_m: f64) -> Option<([f32; 3], f64)> {
        let [a, b] = self.local(x_m, y_m);
        let (ea, eb) = (self.half_m[0] - a.abs(), self.half_m[1] - b.abs());
        if ea < 0.0 || eb < 0.0 {
            return None;
        }
        let share = match self.roof {
            Roof::Gable => eb / self.half_m[1],
            Roof::Hip => eb.min(ea) / self.half_m[1],
            Roof::Flat => 0.0,
        };
        let height_m = self.base_m + self.eave_m + self.rise_m * share.min(1.0);
        let (colour, raised_m) = if self.roof == Roof::Flat {
            self.flat_at(a, b, ea.min(eb))
        } else {
            self.pitched_at(a, b, share, ea.min(eb))
        };
        Some((colour, height_m + raised_m))
    }

    /// Courses of tiles, ridge, gutter, chimney, windows and panels of a sloping roof.
    fn pitched_at(&self, a: f64, b: f64, share: f64, edge_m: f64) -> ([f32; 3], f64) {
        let draw = |n: u32| chance(self.seed, n as i32, 77);
        let side = if b < 0.0 { -1.0 } else { 1.0 };
        let chimney = [(f64::from(draw(1)) - 0.5) * 1.4 * self.half_m[0], 0.25 * self.half_m[1]];
        if (a - chimney[0]).abs() < 0.45 && (b - chimney[1]).abs() < 0.4 {
            return ([128.0, 84.0, 70.0], 1.1 + 0.3 * self.rise_m);
        }
        let fitting = |n: i32| chance(self.fittings_seed, n, if side < 0.0 { 3 } else { 4 });
        // Panels in a block on one slope, or roof windows in a row.
        if fitting(0) < 0.22 {
            let middle_m = (f64::from(fitting(1)) - 0.5) * self.half_m[0];
            let is_inside = (a - middle_m).abs() < 0.45 * self.half_m[0] && (0.25..0.8).contains(&share);
            if is_inside && edge_m > 0.6 {
                let is_frame = a.rem_euclid(1.05) < 0.12 || (share * self.half_m[1]).rem_euclid(1.7) < 0.12;
                return (if is_frame { [96.0, 104.0, 116.0] } else { [38.0, 46.0, 66.0] }, 0.12);
            }
        } else if fitting(0) < 0.55 && (0.35..0.62).contains(&share) && a.rem_euclid(3.4) < 0.9 && edge_m > 1.0 {
            return ([70.0, 80.0, 92.0], 0.05);
        }
        let courses = smooth(self.seed, a / 1.8, b / 0.5) * 0.07;
        let stains = smooth(self.fittings_seed, a / 3.0, b / 2.2) * 0.10;
        let mut tone = 1.0 + courses + stains;
        if share > 0.96 {
            tone *= 1.14;
        }
        if edge_m < 0.22 {
            tone *= 0.72;
        }
        (self.roof_colour.map(|c| c * tone), 0.0)
    }

    /// Parapet, gravel, puddles, hatches and ventilators of a level roof.
    fn flat_at(&self, a: f64, b: f64, edge_m: f64) -> ([f32; 3], f64) {
        if edge_m < 0.35 {
            let tone = 0.9 + 0.25 * chance(self.seed, 9, 9);
            return (self.roof_colour.map(|c| (c * 0.5 + 92.0) * tone), 0.5);
        }
        // A thing in some squares of 6 m.
        let square = [a, b].map(|v| (v / 6.0).floor() as i32);
        let draw = |n: u32| f64::from(chance(self.fittings_seed.wrapping_add(n), square[0], square[1]));
        let [u, v] = [a, b].map(|v| v.rem_euclid(6.0));
        let (half_u, half_v) = (0.4 + 1.2 * draw(1), 0.4 + 0.9 * draw(2));
        let (mid_u, mid_v) = (1.8 + 2.4 * draw(3), 1.8 + 2.4 * draw(4));
        if draw(0) < 0.42 && (u - mid_u).abs() < half_u && (v - mid_v).abs() < half_v && edge_m > 0.8 {
            let tone = 110.0 + 110.0 * draw(5) as f32;
            return ([tone, tone, tone * 0.98], 0.4 + 1.4 * draw(6));
        }
        let patch = smooth(self.fittings_seed ^ 3, a / 5.0, b / 5.0) * 0.12;
        let grit = smooth(self.seed ^ 4, a / 0.5, b / 0.5) * 0.05;
        let seam = if hash(self.seed, 1, 1).is_multiple_of(3) && a.rem_euclid(2.5) < 0.16 { -0.12 } else { 0.0 };
        (self.roof_colour.map(|c| c * (1.0 + patch + grit + seam)), 0.0)
    }

    /// Colour of the wall at a point on it, before light, and its outward normal (east, south). Heights in metres.
    pub fn wall_at(&self, x_m: f64, y_m: f64, z_m: f64) -> ([f32; 3], [f64; 2]) {
        let [a, b] = self.local(x_m, y_m);
        let (ea, eb) = (self.half_m[0] - a.abs(), self.half_m[1] - b.abs());
        let [ux, uy] = self.along;
        let (s, normal) =
            if ea < eb { (b, [ux * a.signum(), uy * a.signum()]) } else { (a, [-uy * b.signum(), ux * b.signum()]) };
        let up_m = z_m - self.base_m;
        let floor = up_m.rem_euclid(2.9);
        let bay_m = 2.2 + 1.2 * f64::from(chance(self.seed, 5, 5));
        let is_window = (0.9..2.3).contains(&floor) && s.rem_euclid(bay_m) < 0.48 * bay_m && up_m < self.eave_m - 0.3;
        if is_window {
            let pane = chance(self.seed, (s / bay_m).floor() as i32, (up_m / 2.9) as i32);
            return ([44.0 + 40.0 * pane, 50.0 + 42.0 * pane, 60.0 + 44.0 * pane], normal);
        }
        let stain = 1.0 + 0.06 * smooth(self.seed, s / 1.5, up_m / 1.5);
        let foot = if up_m < 0.5 { 0.75 } else { 1.0 };
        (self.wall_colour.map(|c| c * stain * foot), normal)
    }
}
