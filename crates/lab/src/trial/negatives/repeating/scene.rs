//! `RepeatingScene`: where patterns cover the real ground, drawn into the map and into frames.

use super::look::PatternLook;
use super::pattern::RepeatingPattern;

/// Points per pixel and axis at which a pattern is evaluated.
const SAMPLES: usize = 2;

/// A rectangle on the ground, metres east and north.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockOutline {
    /// The middle.
    pub centre_m: [f64; 2],
    /// Half of its sides.
    pub half_m: [f64; 2],
    /// Direction of the first side, radians counter-clockwise from east.
    pub angle_rad: f64,
}

/// Ground that a pattern covers.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternBlock {
    /// The pattern.
    pub pattern: RepeatingPattern,
    /// Its outline; `None` covers everything.
    pub outline: Option<BlockOutline>,
}

/// Patterns over real ground.
#[derive(Debug, Clone, PartialEq)]
pub struct RepeatingScene {
    /// The blocks; where two overlap, the first is seen.
    pub blocks: Vec<PatternBlock>,
    /// Ground that the map shows as it is, although frames show a pattern there.
    pub hole: Option<BlockOutline>,
    /// Share of the real image in the pattern's ground.
    pub real_share: f32,
}

/// When a scene is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SceneEpoch {
    /// When the map was made.
    Map,
    /// When a frame was taken; the number decides its defects.
    Frame(u32),
}

/// The ground of a pixel, metres east and north.
#[derive(Debug, Clone, Copy)]
pub struct GroundPatch {
    /// Its middle.
    pub centre_m: [f64; 2],
    /// From its left to its right edge.
    pub across_m: [f64; 2],
    /// From its upper to its lower edge.
    pub down_m: [f64; 2],
}

impl BlockOutline {
    /// Distance to the nearest side, metres; negative outside.
    pub fn depth_m(&self, [x_m, y_m]: [f64; 2]) -> f64 {
        let (sin, cos) = self.angle_rad.sin_cos();
        let (x, y) = (x_m - self.centre_m[0], y_m - self.centre_m[1]);
        let (u, v) = (x * cos + y * sin, y * cos - x * sin);
        (self.half_m[0] - u.abs()).min(self.half_m[1] - v.abs())
    }
}

impl PatternBlock {
    /// Distance to the nearest side, metres; negative outside.
    pub fn depth_m(&self, at_m: [f64; 2]) -> f64 {
        self.outline.map_or(f64::INFINITY, |o| o.depth_m(at_m))
    }
}

impl RepeatingScene {
    /// The block at a point.
    pub fn block_at(&self, at_m: [f64; 2], epoch: SceneEpoch) -> Option<&PatternBlock> {
        let is_hidden = epoch == SceneEpoch::Map && self.hole.is_some_and(|hole| hole.depth_m(at_m) > 0.0);
        if is_hidden { None } else { self.blocks.iter().find(|b| b.depth_m(at_m) > 0.0) }
    }

    /// The gray level of a pixel whose real gray level is `real`; `x` and `y` are its column and row.
    pub fn shade(
        &self,
        real: f32,
        patch: &GroundPatch,
        look: &PatternLook,
        epoch: SceneEpoch,
        (x, y): (usize, usize),
    ) -> f32 {
        let number = match epoch {
            SceneEpoch::Map => 0,
            SceneEpoch::Frame(number) => number,
        };
        let offset = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
        let (mut covered, mut ink) = (0, 0.0);
        for i in 0..SAMPLES * SAMPLES {
            let (s, t) = (offset(i % SAMPLES), offset(i / SAMPLES));
            let at: [f64; 2] = std::array::from_fn(|k| patch.centre_m[k] + s * patch.across_m[k] + t * patch.down_m[k]);
            if let Some(block) = self.block_at(at, epoch) {
                covered += 1;
                ink += block.pattern.ink_at(at, number);
            }
        }
        if covered == 0 {
            return real;
        }
        let drawn = look.level(ink / f64::from(covered), patch.centre_m) + look.noise(x, y);
        let share = covered as f32 / (SAMPLES * SAMPLES) as f32 * (1.0 - self.real_share);
        (real + share * (drawn - real)).clamp(0.0, 255.0)
    }
}
