//! `PatternLook`: the gray levels of a pattern in one epoch.

use crate::trial::negatives::cell_hash::cell_hash;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// The gray levels of a pattern in one epoch, with a texture of that epoch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatternLook {
    /// Gray level of bare ground.
    ground: f32,
    /// Gray levels that a whole element adds; negative for dark elements.
    contrast: f32,
    /// Amplitude of smooth patches, gray levels.
    patches: f32,
    /// Size of the patches, metres.
    patch_m: f64,
    /// Standard deviation of the noise of pixels, gray levels.
    grain: f32,
    seed: u32,
}

impl PatternLook {
    /// Draws a look. The patches measure about `period_m`.
    pub fn random(is_dark: bool, period_m: f64, rng: &mut ChaCha8Rng) -> Self {
        let contrast = rng.random_range(10.0..70.0f32);
        Self {
            ground: if is_dark { rng.random_range(100.0..200.0) } else { rng.random_range(40.0..150.0) },
            contrast: if is_dark { -contrast } else { contrast },
            patches: rng.random_range(0.0..0.25f32) * contrast,
            patch_m: period_m * rng.random_range(0.3..4.0),
            grain: rng.random_range(0.5..6.0),
            seed: rng.random(),
        }
    }

    /// Light elements of a strong contrast with a little noise.
    #[cfg(test)]
    pub fn plain(seed: u32) -> Self {
        Self { ground: 80.0, contrast: 90.0, patches: 4.0, patch_m: 50.0, grain: 1.5, seed }
    }

    /// The gray level of a point (metres east and north) with this much ink, without noise.
    pub fn level(&self, ink: f64, at_m: [f64; 2]) -> f32 {
        self.ground + self.contrast * ink as f32 + self.patches * self.patch(at_m)
    }

    /// The noise of a pixel, gray levels: triangular, of zero mean.
    pub fn noise(&self, x: usize, y: usize) -> f32 {
        let h = cell_hash(x as i32, y as i32, self.seed ^ 0x0AD5_3C1F);
        let unit = |bits: u32| (bits & 0xffff) as f32 / 65_536.0;
        // The difference of two uniform numbers has a variance of 1 / 6.
        self.grain * (unit(h) - unit(h >> 16)) * 6f32.sqrt()
    }

    /// Smooth noise in [-1, 1]: bilinear between the corners of a lattice.
    fn patch(&self, at_m: [f64; 2]) -> f32 {
        let [x, y] = at_m.map(|v| v / self.patch_m);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = ((x - x0) as f32, (y - y0) as f32);
        let corner =
            |dx: i32, dy: i32| cell_hash(x0 as i32 + dx, y0 as i32 + dy, self.seed) as f32 / 2f32.powi(31) - 1.0;
        let (top, bottom) =
            (corner(0, 0) * (1.0 - fx) + corner(1, 0) * fx, corner(0, 1) * (1.0 - fx) + corner(1, 1) * fx);
        top * (1.0 - fy) + bottom * fy
    }
}
