//! `SceneDate`: what a world looks like on one day: sun, season, and what has changed since the other day.

use super::noise::{chance, hash};
use super::sun::Sun;

/// A day.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneDate {
    /// Days with other numbers differ in what changes.
    pub number: u32,
    /// Share of roofs, cars, gardens that changed, in [0, 1].
    pub changed_share: f32,
    /// From lush (0) to dry (1).
    pub dryness: f32,
    /// The sun.
    pub sun: Sun,
}

impl SceneDate {
    /// The seed of a thing's looks on this day: one of its own for the things that changed, else the thing's.
    pub fn seed_of(&self, seed: u32) -> u32 {
        if chance(seed ^ 0x00c0_ffee, 4, 4) < self.changed_share { hash(seed, self.number as i32, 5) } else { seed }
    }

    /// A colour of leaves or grass on this day.
    pub fn tinted(&self, colour: [f32; 3], most: f32) -> [f32; 3] {
        const STRAW: [f32; 3] = [168.0, 152.0, 104.0];
        let share = self.dryness * most;
        std::array::from_fn(|i| colour[i] + (STRAW[i] * (colour[1] / 118.0).min(1.2) - colour[i]) * share)
    }
}
