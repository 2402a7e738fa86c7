//! `Sortie`: one day over a landscape: its light, season and weather, loose objects, and the state of the camera.

use crate::canvas::SceneCanvas;
use crate::noise::cloudy;
use crate::sight::{HEIGHT_PX, WIDTH_PX};
use crate::sun::Sun;
use crate::survey::Radiometry;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// A day.
pub struct Sortie {
    sun: Sun,
    /// The colour that vegetation turns to, and how far.
    turning: ([f32; 3], f32),
    /// Share of the sky in clouds whose shadows lie on the land.
    clouds: f32,
    /// Number of objects that no map shows.
    objects: usize,
    radiometry: Radiometry,
    /// Standard deviation of the lens's and the motion's blur, pixels across and along the flight.
    blur_px: [f32; 2],
    /// Light lost in the image's corners.
    vignette: f32,
}

impl Sortie {
    /// Draws a day from high summer to late autumn, from morning to evening.
    pub fn plan(rng: &mut ChaCha8Rng) -> Self {
        const STRAW: [f32; 3] = [168.0, 150.0, 104.0];
        const RUST: [f32; 3] = [138.0, 104.0, 62.0];
        const GREEN: [f32; 3] = [96.0, 124.0, 62.0];
        let lens = rng.random_range(0.0..0.8f32);
        Self {
            sun: Sun { azimuth_deg: rng.random_range(95.0..265.0), elevation_deg: rng.random_range(24.0..60.0) },
            turning: ([STRAW, RUST, GREEN][rng.random_range(0..3)], rng.random_range(0.0..0.55)),
            clouds: if rng.random_bool(0.35) { rng.random_range(0.1..0.4) } else { 0.0 },
            objects: rng.random_range(100..900),
            radiometry: Radiometry {
                gain: [rng.random_range(0.92..1.12), 1.0, rng.random_range(0.86..1.06)],
                gamma: rng.random_range(0.75..1.25),
                haze: rng.random_range(0.02..0.28),
                noise: rng.random_range(1.5..7.0),
            },
            blur_px: [lens, lens + rng.random_range(0.0..1.2)],
            vignette: rng.random_range(0.0..0.5),
        }
    }

    /// Draws the ground on that day: changed in colour, strewn with objects, lit, under the shadows of clouds.
    pub fn lit(&self, ground: &SceneCanvas, rng: &mut ChaCha8Rng) -> SceneCanvas {
        let mut canvas =
            SceneCanvas { colours: ground.colours.clone(), heights_m: ground.heights_m.clone(), ..*ground };
        let (tone, share) = self.turning;
        canvas.colours.par_iter_mut().for_each(|c| {
            let green = ((c[1] - c[0].max(c[2])) / 24.0).clamp(0.0, 1.0) * share;
            let level = (c[0] + c[1] + c[2]) / (tone[0] + tone[1] + tone[2]);
            *c = std::array::from_fn(|i| c[i] + (tone[i] * level.min(1.2) - c[i]) * green);
        });
        for _ in 0..self.objects {
            strew(&mut canvas, rng);
        }
        canvas.light(self.sun);
        if self.clouds > 0.0 {
            self.shade(&mut canvas, rng.random());
        }
        canvas
    }

    fn shade(&self, canvas: &mut SceneCanvas, seed: u32) {
        let width = canvas.width;
        canvas.colours.par_chunks_mut(width).enumerate().for_each(|(row, line)| {
            for (column, colour) in line.iter_mut().enumerate() {
                let at = cloudy(seed, column as f64 / 900.0, row as f64 / 900.0);
                let cover = ((at - 0.55 + 1.2 * self.clouds) / 0.1).clamp(0.0, 1.0);
                *colour = std::array::from_fn(|i| colour[i] * (1.0 - cover * [0.55, 0.5, 0.42][i]));
            }
        });
    }

    /// Develops the camera's picture, interleaved RGB.
    pub fn develop(&self, colours: Vec<[f32; 3]>, rng: &mut ChaCha8Rng) -> Vec<u8> {
        let colours = blurred(&blurred(&colours, self.blur_px[0], false), self.blur_px[1], true);
        let exposure = rng.random_range(0.85..1.15f32);
        let sensor = Radiometry { gain: self.radiometry.gain.map(|g| g * exposure), ..self.radiometry };
        let (cx, cy) = (WIDTH_PX as f32 / 2.0, HEIGHT_PX as f32 / 2.0);
        let lit = colours.into_iter().enumerate().map(|(i, c)| {
            let (x, y) = ((i % WIDTH_PX) as f32 + 0.5 - cx, (i / WIDTH_PX) as f32 + 0.5 - cy);
            let light = 1.0 - self.vignette * (x * x + y * y) / (cx * cx + cy * cy);
            c.map(|v| v * light)
        });
        lit.flat_map(|c| sensor.develop(c, rng)).collect()
    }
}

/// Draws a car, a bale, a container or a sheet of plastic: an upright box at a random place.
fn strew(canvas: &mut SceneCanvas, rng: &mut ChaCha8Rng) {
    const TONES: [[f32; 3]; 6] = [
        [226.0, 226.0, 222.0],
        [40.0, 42.0, 46.0],
        [170.0, 44.0, 38.0],
        [52.0, 84.0, 150.0],
        [196.0, 176.0, 120.0],
        [120.0, 122.0, 124.0],
    ];
    let size_m = [canvas.width as f64, canvas.height as f64].map(|n| n / crate::canvas::PIXELS_PER_M);
    let centre = [rng.random_range(0.0..size_m[0]), rng.random_range(0.0..size_m[1])];
    let is_large = rng.random_bool(0.06);
    let half_m: [f64; 2] = if is_large {
        [rng.random_range(6.0..26.0), rng.random_range(4.0..12.0)]
    } else {
        [rng.random_range(0.8..4.5), rng.random_range(0.7..1.6)]
    };
    let height_m = if is_large { rng.random_range(0.1..5.0f32) } else { rng.random_range(1.0..2.6) };
    let tone = TONES[rng.random_range(0..TONES.len())];
    let (sin, cos) = rng.random_range(0.0..std::f64::consts::PI).sin_cos();
    canvas.draw_within(centre, half_m[0].hypot(half_m[1]), |x, y| {
        let (dx, dy) = (x - centre[0], y - centre[1]);
        let inside = (dx * cos + dy * sin).abs() <= half_m[0] && (dy * cos - dx * sin).abs() <= half_m[1];
        inside.then_some((tone, height_m))
    });
}

/// Blurs by a Gaussian along the columns (the direction of flight) or the rows; the edge is repeated.
fn blurred(colours: &[[f32; 3]], sigma_px: f32, is_along: bool) -> Vec<[f32; 3]> {
    if sigma_px < 0.2 {
        return colours.to_vec();
    }
    let reach = (3.0 * sigma_px).ceil() as isize;
    let weights: Vec<f32> = (-reach..=reach).map(|k| (-0.5 * (k as f32 / sigma_px).powi(2)).exp()).collect();
    let total: f32 = weights.iter().sum();
    let clamp = |v: isize, n: usize| v.clamp(0, n as isize - 1) as usize;
    (0..colours.len())
        .into_par_iter()
        .map(|i| {
            let (x, y) = ((i % WIDTH_PX) as isize, (i / WIDTH_PX) as isize);
            let mut sum = [0f32; 3];
            for (k, weight) in (-reach..=reach).zip(&weights) {
                let (u, v) = if is_along { (x, y + k) } else { (x + k, y) };
                let colour = colours[clamp(v, HEIGHT_PX) * WIDTH_PX + clamp(u, WIDTH_PX)];
                (0..3).for_each(|c| sum[c] += weight * colour[c] / total);
            }
            sum
        })
        .collect()
}
