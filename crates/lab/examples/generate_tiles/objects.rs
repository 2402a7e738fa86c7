//! Things with height: trees and buildings.

use crate::canvas::SceneCanvas;
use crate::noise::{chance, smooth};

/// A crown seen from above.
pub struct Tree {
    centre: [f64; 2],
    radius_m: f64,
    height_m: f64,
    is_conifer: bool,
    tone: f64,
}

impl Tree {
    /// A broad crown; `tone` in [0, 1) varies its colour.
    pub fn broad(centre: [f64; 2], radius_m: f64, tone: f64) -> Self {
        Self { centre, radius_m, height_m: 2.0 + radius_m * 2.9, is_conifer: false, tone }
    }

    /// A pointed crown.
    pub fn conifer(centre: [f64; 2], radius_m: f64, tone: f64) -> Self {
        Self { centre, radius_m, height_m: 3.0 + radius_m * 5.0, is_conifer: true, tone }
    }

    /// Draws the crown in the colours of an epoch.
    pub fn draw(&self, canvas: &mut SceneCanvas, seed: u32, epoch: usize) {
        let tone = self.tone as f32;
        let colour = match (self.is_conifer, epoch) {
            (true, _) => [44.0 + 12.0 * tone, 62.0 + 14.0 * tone, 42.0 + 8.0 * tone],
            (false, 0) => [70.0 + 24.0 * tone, 98.0 + 22.0 * tone, 46.0 + 12.0 * tone],
            (false, _) if self.tone > 0.86 => [126.0, 108.0, 52.0],
            (false, _) => [78.0 + 26.0 * tone, 88.0 + 20.0 * tone, 46.0 + 8.0 * tone],
        };
        canvas.draw_within(self.centre, self.radius_m * 1.15, |x, y| {
            let (dx, dy) = (x - self.centre[0], y - self.centre[1]);
            let angle = dy.atan2(dx);
            let ragged =
                f64::from(smooth(seed, 3.0 * angle.cos() + self.centre[0], 3.0 * angle.sin() + self.centre[1]));
            let d = dx.hypot(dy) / (self.radius_m * (0.95 + 0.18 * ragged));
            if d >= 1.0 {
                return None;
            }
            let leaf = smooth(seed + 1, x / 1.1, y / 1.1);
            let dome = if self.is_conifer { 1.0 - d } else { (1.0 - d * d).sqrt() };
            let height = self.height_m * (0.5 + 0.5 * dome) + 0.7 * f64::from(leaf);
            let light = 1.0 + 0.16 * leaf - 0.12 * d as f32;
            Some((colour.map(|c| c * light), height as f32))
        });
    }
}

/// The material of a roof.
#[derive(Clone, Copy)]
pub enum Roof {
    /// Red to brown clay.
    Tile,
    /// Dark gray.
    Slate,
    /// Light sheet metal.
    Metal,
}

/// A gabled building.
pub struct Building {
    /// Middle, metres east and south.
    pub centre: [f64; 2],
    /// Unit direction of the ridge.
    pub along: [f64; 2],
    /// Half of its length and width, metres.
    pub half_m: [f64; 2],
    /// Height of the walls, metres.
    pub eaves_m: f64,
    /// Height of the ridge, metres.
    pub ridge_m: f64,
    /// Material.
    pub roof: Roof,
}

impl Building {
    fn local(&self, p: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (p[0] - self.centre[0], p[1] - self.centre[1]);
        [dx * self.along[0] + dy * self.along[1], -dx * self.along[1] + dy * self.along[0]]
    }

    /// Whether a point lies within the walls or `margin_m` around.
    pub fn is_near(&self, p: [f64; 2], margin_m: f64) -> bool {
        let [u, v] = self.local(p);
        u.abs() < self.half_m[0] + margin_m && v.abs() < self.half_m[1] + margin_m
    }

    /// Draws the roof.
    pub fn draw(&self, canvas: &mut SceneCanvas, seed: u32) {
        let dice = chance(seed, self.centre[0] as i32, self.centre[1] as i32);
        let colour = match self.roof {
            Roof::Tile => [150.0 + 34.0 * dice, 88.0 + 22.0 * dice, 68.0 + 22.0 * dice],
            Roof::Slate => [96.0 + 30.0 * dice, 96.0 + 28.0 * dice, 98.0 + 28.0 * dice],
            Roof::Metal => [176.0 + 30.0 * dice, 178.0 + 28.0 * dice, 176.0 + 30.0 * dice],
        };
        let reach = self.half_m[0].hypot(self.half_m[1]);
        canvas.draw_within(self.centre, reach, |x, y| {
            let [u, v] = self.local([x, y]);
            if u.abs() > self.half_m[0] || v.abs() > self.half_m[1] {
                return None;
            }
            let height = self.eaves_m + (self.ridge_m - self.eaves_m) * (1.0 - v.abs() / self.half_m[1]);
            let weather = 1.0 + 0.05 * smooth(seed + 1, u * 1.4, v / 3.0) + 0.04 * smooth(seed + 2, u / 3.0, v / 3.0);
            // A chimney on some, roof lights along the halls.
            let is_chimney = matches!(self.roof, Roof::Tile) && (u - 2.0).abs() < 0.6 && (v - 1.0).abs() < 0.5;
            let is_light = matches!(self.roof, Roof::Metal)
                && (u.rem_euclid(6.0) - 3.0).abs() < 0.7
                && (v.abs() - 4.0).abs() < 2.0;
            Some(match (is_chimney, is_light) {
                (true, _) => ([110.0, 92.0, 84.0], (self.ridge_m + 1.0) as f32),
                (_, true) => (colour.map(|c| (c * 1.18).min(235.0)), height as f32),
                _ => (colour.map(|c| c * weather), height as f32),
            })
        });
    }
}
