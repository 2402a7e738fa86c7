//! `SceneObject`: what stands on the ground: buildings, trees, boxes.

use super::building::Building;
use super::noise::{chance, smooth};
use super::sample::{FIRST_BUILDING, GREEN, Sample, THING};

/// Something that stands on the ground.
#[derive(Debug, Clone)]
pub enum SceneObject {
    /// A house, hall or shed, with its number.
    Building(u16, Building),
    /// A tree or bush.
    Tree(Tree),
    /// A car, container or heap.
    Slab(Slab),
}

/// A crown on the ground.
#[derive(Debug, Clone)]
pub struct Tree {
    /// Metres east and south.
    pub centre: [f64; 2],
    /// Radius of the crown, metres.
    pub radius_m: f64,
    /// Height of the ground, metres.
    pub base_m: f64,
    /// Height of the tree, metres.
    pub height_m: f64,
    /// Colour of the leaves.
    pub colour: [f32; 3],
    /// Shape of the crown.
    pub seed: u32,
}

/// An upright box on the ground.
#[derive(Debug, Clone)]
pub struct Slab {
    /// Metres east and south.
    pub centre: [f64; 2],
    /// Half the length and half the width, metres.
    pub half_m: [f64; 2],
    /// Unit vector along the length, east and south.
    pub along: [f64; 2],
    /// Height of the ground, metres.
    pub base_m: f64,
    /// Height of the box, metres.
    pub height_m: f64,
    /// Its colour.
    pub colour: [f32; 3],
    /// Whether it has windows and a bonnet.
    pub is_car: bool,
}

impl SceneObject {
    /// Centre and greatest reach, metres.
    pub fn reach(&self) -> ([f64; 2], f64) {
        match self {
            Self::Building(_, b) => (b.centre, b.half_m[0].hypot(b.half_m[1])),
            Self::Tree(t) => (t.centre, 1.25 * t.radius_m),
            Self::Slab(s) => (s.centre, s.half_m[0].hypot(s.half_m[1])),
        }
    }

    /// What it shows at a point, metres east and south; `None` beside it.
    pub fn at(&self, x_m: f64, y_m: f64) -> Option<Sample> {
        match self {
            Self::Building(number, building) => {
                let (colour, top_m) = building.roof_at(x_m, y_m)?;
                Some(Sample { colour, top_m: top_m as f32, kind: FIRST_BUILDING + number })
            }
            Self::Tree(tree) => tree.at(x_m, y_m),
            Self::Slab(slab) => slab.at(x_m, y_m),
        }
    }
}

impl Tree {
    fn at(&self, x_m: f64, y_m: f64) -> Option<Sample> {
        let (dx, dy) = (x_m - self.centre[0], y_m - self.centre[1]);
        // Lobes of a quarter of the crown, and leaves.
        let lobes = smooth(self.seed, dx / (0.45 * self.radius_m), dy / (0.45 * self.radius_m));
        let leaves = smooth(self.seed ^ 5, x_m / 0.45, y_m / 0.45);
        let r = dx.hypot(dy) / self.radius_m + 0.16 * f64::from(lobes) + 0.05 * f64::from(leaves);
        if r >= 1.0 {
            return None;
        }
        let dome = (1.0 - r * r).sqrt();
        let rough = 0.10 * f64::from(lobes) + 0.05 * f64::from(leaves);
        let top_m = self.base_m + self.height_m * (0.35 + 0.65 * dome + rough * dome);
        let tone = 1.0 + 0.16 * leaves + 0.12 * lobes + 0.14 * (dome as f32 - 0.6);
        Some(Sample { colour: self.colour.map(|c| c * tone), top_m: top_m as f32, kind: GREEN })
    }
}

impl Slab {
    fn at(&self, x_m: f64, y_m: f64) -> Option<Sample> {
        let (dx, dy) = (x_m - self.centre[0], y_m - self.centre[1]);
        let (a, b) = (dx * self.along[0] + dy * self.along[1], dy * self.along[0] - dx * self.along[1]);
        if a.abs() > self.half_m[0] || b.abs() > self.half_m[1] {
            return None;
        }
        let mut colour = self.colour;
        let mut height_m = self.height_m;
        if self.is_car {
            let t = a / self.half_m[0];
            if !(-0.78..=0.45).contains(&t) {
                height_m *= 0.62;
            }
            if (0.22..0.5).contains(&t) || (-0.82..-0.62).contains(&t) || b.abs() > 0.82 * self.half_m[1] {
                colour = [46.0, 52.0, 60.0];
            }
        }
        let dirt = 1.0 + 0.05 * chance(7, (x_m * 8.0) as i32, (y_m * 8.0) as i32);
        Some(Sample { colour: colour.map(|c| c * dirt), top_m: (self.base_m + height_m) as f32, kind: THING })
    }
}
