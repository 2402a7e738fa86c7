//! `Exposure`: what lens, motion, sensor and the camera's own processing make of light.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// A picture as light: red, green, blue in [0, 255], row by row.
pub struct Light {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Colours.
    pub colours: Vec<[f32; 3]>,
}

/// How a camera turns light into an image.
#[derive(Debug, Clone, Copy)]
pub struct Exposure {
    /// Standard deviation of the lens's blur, pixels.
    pub defocus_px: f32,
    /// Path of a ground point over the sensor while the shutter is open: right and down, pixels.
    pub motion_px: [f32; 2],
    /// Light lost in the corners, as a share.
    pub vignette: f32,
    /// Factors on red, green, blue.
    pub gain: [f32; 3],
    /// Exponent on [0, 1].
    pub gamma: f32,
    /// Share of haze over everything.
    pub haze: f32,
    /// Standard deviation of the noise, grey levels.
    pub noise: f32,
    /// Weight of the unsharp mask; 0 for none.
    pub sharpening: f32,
}

impl Exposure {
    /// A drone's camera: sharpened, contrasty.
    pub const DRONE: Self = Self {
        defocus_px: 0.6,
        motion_px: [0.0; 2],
        vignette: 0.18,
        gain: [1.04, 1.0, 0.96],
        gamma: 0.92,
        haze: 0.03,
        noise: 2.4,
        sharpening: 0.9,
    };
    /// The sensor of a town's map.
    pub const SURVEY: Self = Self {
        defocus_px: 1.0,
        vignette: 0.0,
        gain: [0.98, 1.0, 1.02],
        gamma: 1.05,
        haze: 0.07,
        noise: 2.0,
        sharpening: 0.5,
        ..Self::DRONE
    };
}

impl Exposure {
    /// Develops a picture, interleaved RGB.
    pub fn develop(&self, light: Light, rng: &mut ChaCha8Rng) -> Vec<u8> {
        const AIR: [f32; 3] = [178.0, 190.0, 204.0];
        let mut picture = light.moved(self.motion_px).blurred(self.defocus_px);
        let (cx, cy) = (picture.width as f32 / 2.0, picture.height as f32 / 2.0);
        let width = picture.width;
        let tone = ToneCurve::new(self.gamma);
        for (i, colour) in picture.colours.iter_mut().enumerate() {
            let (x, y) = ((i % width) as f32 + 0.5 - cx, (i / width) as f32 + 0.5 - cy);
            let fall = 1.0 - self.vignette * (x * x + y * y) / (cx * cx + cy * cy);
            for (k, value) in colour.iter_mut().enumerate() {
                let exposed = tone.at(*value * self.gain[k] * fall);
                // Noise is the sensor's: the same lightness noise in all colours, and a little of their own.
                *value = exposed * (1.0 - self.haze) + AIR[k] * self.haze;
            }
            let common = normal(rng) * self.noise;
            colour.iter_mut().for_each(|value| *value += common + 0.5 * self.noise * normal(rng));
        }
        if self.sharpening > 0.0 {
            let soft = Light { colours: picture.colours.clone(), ..picture }.blurred(1.0);
            for (colour, soft) in picture.colours.iter_mut().zip(&soft.colours) {
                *colour = std::array::from_fn(|k| colour[k] + self.sharpening * (colour[k] - soft[k]));
            }
        }
        picture.colours.iter().flatten().map(|v| v.round().clamp(0.0, 255.0) as u8).collect()
    }
}

/// A power on [0, 1] with a soft shoulder, as a table.
struct ToneCurve([f32; 513]);

impl ToneCurve {
    fn new(gamma: f32) -> Self {
        // Values up to 1.5 are squeezed below 1: cameras do not clip hard.
        Self(std::array::from_fn(|i| {
            let v = (i as f32 * 1.5 / 512.0).powf(gamma);
            let squeezed = if v > 0.8 { 0.8 + 0.2 * (1.0 - (-(v - 0.8) / 0.2).exp()) } else { v };
            squeezed * 255.0
        }))
    }

    fn at(&self, value: f32) -> f32 {
        let at = (value / 255.0 * 512.0 / 1.5).clamp(0.0, 511.99);
        let i = at as usize;
        self.0[i] + (self.0[i + 1] - self.0[i]) * (at - i as f32)
    }
}

/// Four uniform numbers, centred and scaled: near enough to normal, and the same on every machine.
fn normal(rng: &mut ChaCha8Rng) -> f32 {
    let bits: u32 = rng.random();
    let sum: u32 = (0..4).map(|k| (bits >> (8 * k)) & 0xff).sum();
    (sum as f32 - 510.0) / 147.8
}

impl Light {
    /// Blurred by a Gaussian; the edge is repeated.
    pub fn blurred(self, sigma_px: f32) -> Self {
        if sigma_px < 0.15 {
            return self;
        }
        let reach = (3.0 * sigma_px).ceil() as i64;
        let weights: Vec<f32> = (-reach..=reach).map(|k| (-0.5 * (k as f32 / sigma_px).powi(2)).exp()).collect();
        let total: f32 = weights.iter().sum();
        let weights: Vec<f32> = weights.iter().map(|w| w / total).collect();
        let width = self.width;
        let clamp = |v: i64, n: usize| v.clamp(0, n as i64 - 1) as usize;
        let mut across = vec![[0f32; 3]; self.colours.len()];
        for (from, to) in self.colours.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
            for (column, sum) in to.iter_mut().enumerate() {
                for (k, weight) in (-reach..=reach).zip(&weights) {
                    let colour = &from[clamp(column as i64 + k, width)];
                    (0..3).for_each(|c| sum[c] += weight * colour[c]);
                }
            }
        }
        let mut colours = vec![[0f32; 3]; self.colours.len()];
        for (row, to) in colours.chunks_exact_mut(width).enumerate() {
            for (k, weight) in (-reach..=reach).zip(&weights) {
                let first = clamp(row as i64 + k, self.height) * width;
                for (sum, colour) in to.iter_mut().zip(&across[first..first + width]) {
                    (0..3).for_each(|c| sum[c] += weight * colour[c]);
                }
            }
        }
        Self { colours, ..self }
    }

    /// Smeared along a path over the sensor, right and down, pixels.
    fn moved(self, [right, down]: [f32; 2]) -> Self {
        let length = right.hypot(down);
        if length < 0.3 {
            return self;
        }
        let steps = (2.0 * length).ceil().max(2.0) as i32;
        let mut colours = vec![[0f32; 3]; self.colours.len()];
        for k in 0..=steps {
            let t = k as f32 / steps as f32 - 0.5;
            self.add_shifted([right * t, down * t], 1.0 / (steps + 1) as f32, &mut colours);
        }
        Self { colours, ..self }
    }

    /// Adds the picture shifted by part of a pixel or more, bilinear.
    fn add_shifted(&self, [right, down]: [f32; 2], weight: f32, sums: &mut [[f32; 3]]) {
        let (dx, dy) = (right.floor(), down.floor());
        let (fx, fy) = (right - dx, down - dy);
        let clamp = |v: i64, n: usize| v.clamp(0, n as i64 - 1) as usize;
        let corners =
            [(0, 0, (1.0 - fx) * (1.0 - fy)), (1, 0, fx * (1.0 - fy)), (0, 1, (1.0 - fx) * fy), (1, 1, fx * fy)];
        for (row, line) in sums.chunks_exact_mut(self.width).enumerate() {
            for (column, sum) in line.iter_mut().enumerate() {
                for (ex, ey, share) in corners {
                    let x = clamp(column as i64 + dx as i64 + ex, self.width);
                    let y = clamp(row as i64 + dy as i64 + ey, self.height);
                    let colour = &self.colours[y * self.width + x];
                    (0..3).for_each(|c| sum[c] += weight * share * colour[c]);
                }
            }
        }
    }
}
