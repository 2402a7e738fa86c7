//! Frames that show no place: noise, water, blanks, repeated fields. Gray levels are whole numbers in [0, 255], as a
//! sensor's are.

use super::cell_hash::cell_hash;
use overfly_core::pixels::Gray;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

/// Draws white noise, or noise smoothed over a random mixture of scales.
pub fn noise(width: usize, height: usize, rng: &mut ChaCha8Rng) -> Gray {
    let contrast = rng.random_range(4.0..60.0f32);
    let middle = rng.random_range(60.0..190.0f32);
    let field = if rng.random_bool(0.3) {
        Gray::from_values(width, height, (0..width * height).map(|_| normal(rng)).collect())
            .expect("one value for each pixel")
    } else {
        // From white noise (slope 0) to the spectrum of natural scenes (slope 1 and more).
        let slope = rng.random_range(0.2..1.4f32);
        octaves(width, height, slope, rng)
    };
    developed(&field, middle, contrast, 0.0, rng)
}

/// Draws low-contrast waves of many lengths about one wind direction, under a gradient from the sky.
pub fn water(width: usize, height: usize, rng: &mut ChaCha8Rng) -> Gray {
    let wind = rng.random_range(0.0..TAU);
    let waves: Vec<[f32; 4]> = (0..14)
        .map(|_| {
            let length_px = 2.5 * 10f64.powf(rng.random_range(0.0..1.2));
            let towards = wind + rng.random_range(-0.5..0.5);
            let (sin, cos) = towards.sin_cos();
            let amplitude = (length_px / 10.0).sqrt();
            [TAU * cos / length_px, TAU * sin / length_px, rng.random_range(0.0..TAU), amplitude].map(|v| v as f32)
        })
        .collect();
    let mut field = painted(width, height, |x, y| {
        waves.iter().map(|[kx, ky, phase, amplitude]| amplitude * (kx * x + ky * y + phase).sin()).sum()
    });
    let glint = gradient(width, height, rng.random_range(0.0..3.0), rng);
    field.values_mut().iter_mut().zip(glint.values()).for_each(|(v, g)| *v += g);
    let (middle, contrast) = (rng.random_range(30.0..110.0), rng.random_range(1.0..7.0));
    let grain = rng.random_range(0.3..2.5);
    developed(&field, middle, contrast, grain, rng)
}

/// Draws one value, a gradient, or a vignette, with or without faint sensor noise.
pub fn blank(width: usize, height: usize, rng: &mut ChaCha8Rng) -> Gray {
    let field = match rng.random_range(0..3) {
        0 => Gray::filled(width, height, 0.0),
        1 => gradient(width, height, 1.0, rng),
        _ => {
            let (cx, cy) = (width as f32 * rng.random_range(0.3..0.7), height as f32 * rng.random_range(0.3..0.7));
            let reach = (width as f32).hypot(height as f32) / 2.0;
            painted(width, height, |x, y| {
                let r2 = ((x - cx).powi(2) + (y - cy).powi(2)) / reach.powi(2);
                1.0 / (1.0 + r2).powi(2)
            })
        }
    };
    let (middle, contrast) = (rng.random_range(0.0..255.0), rng.random_range(2.0..50.0));
    let grain = if rng.random_bool(0.5) { 0.0 } else { rng.random_range(0.2..1.5) };
    developed(&field, middle, contrast, grain, rng)
}

/// Draws a repeated pattern of fields. Half of them run along north, as surveyed land does; `north_rad` is its
/// direction in the frame, radians clockwise from up. The others have a random direction.
pub fn fields(width: usize, height: usize, north_rad: f64, rng: &mut ChaCha8Rng) -> Gray {
    let turn = if rng.random_bool(0.5) { north_rad } else { rng.random_range(0.0..PI) };
    let (sin, cos) = turn.sin_cos();
    let (sin, cos) = (sin as f32, cos as f32);
    let shift = [rng.random_range(0.0..500.0f32), rng.random_range(0.0..500.0f32)];
    let pattern = FieldPattern::random(rng);
    let field = painted(width, height, |x, y| pattern.at(x * cos + y * sin + shift[0], y * cos - x * sin + shift[1]));
    let (middle, contrast) = (rng.random_range(70.0..170.0), rng.random_range(6.0..50.0));
    let grain = rng.random_range(0.5..9.0);
    developed(&field, middle, contrast, grain, rng)
}

/// A pattern over the plane, pixels.
enum FieldPattern {
    Stripes { pitch: f32, share: f32 },
    Chequer { pitch: [f32; 2] },
    Rows { pitch: f32, lines: f32 },
    Parcels { pitch: [f32; 2], seed: u32, edge: f32, is_bonded: bool },
}

impl FieldPattern {
    fn random(rng: &mut ChaCha8Rng) -> Self {
        let mut pitch = |from: f32, to: f32| from * (to / from).powf(rng.random::<f32>());
        let (long, across, fine) = (pitch(8.0, 110.0), pitch(8.0, 80.0), pitch(2.2, 8.0));
        match rng.random_range(0..4) {
            0 => Self::Stripes { pitch: long, share: rng.random_range(0.3..0.7) },
            1 => Self::Chequer { pitch: [long, if rng.random_bool(0.5) { long } else { across }] },
            2 => Self::Rows { pitch: fine, lines: fine * f32::from(rng.random_range(6u8..16)) },
            _ => Self::Parcels {
                pitch: [long, across],
                seed: rng.random(),
                edge: rng.random_range(0.0..2.5),
                is_bonded: rng.random_bool(0.4),
            },
        }
    }

    fn at(&self, u: f32, v: f32) -> f32 {
        let cell = |a: f32, pitch: f32| (a / pitch).floor();
        let within = |a: f32, pitch: f32| a - cell(a, pitch) * pitch;
        match *self {
            Self::Stripes { pitch, share } => f32::from(within(u, pitch) < share * pitch),
            Self::Chequer { pitch } => (cell(u, pitch[0]) + cell(v, pitch[1])).rem_euclid(2.0),
            Self::Rows { pitch, lines } => {
                (u * std::f32::consts::TAU / pitch).sin() - 2.0 * f32::from(within(u, lines) < 1.5)
            }
            Self::Parcels { pitch, seed, edge, is_bonded } => {
                let row = cell(v, pitch[1]);
                let u = if is_bonded { u + 0.5 * pitch[0] * row.rem_euclid(2.0) } else { u };
                let is_edge = within(u, pitch[0]) < edge || within(v, pitch[1]) < edge;
                // Only five crops, so that neighbours often look alike.
                if is_edge { -0.6 } else { (cell_hash(cell(u, pitch[0]) as i32, row as i32, seed) % 5) as f32 / 4.0 }
            }
        }
    }
}

/// Draws a function of the centre of each pixel.
fn painted(width: usize, height: usize, at: impl Fn(f32, f32) -> f32) -> Gray {
    let values = (0..width * height).map(|i| at((i % width) as f32 + 0.5, (i / width) as f32 + 0.5)).collect();
    Gray::from_values(width, height, values).expect("one value for each pixel")
}

fn gradient(width: usize, height: usize, strength: f32, rng: &mut ChaCha8Rng) -> Gray {
    let (sin, cos) = rng.random_range(0.0..TAU).sin_cos();
    let edge = width.max(height) as f32;
    painted(width, height, |x, y| strength * (x * cos as f32 + y * sin as f32) / edge)
}

/// White noise at each power of two of scale; coarser scales are stronger by `slope`.
fn octaves(width: usize, height: usize, slope: f32, rng: &mut ChaCha8Rng) -> Gray {
    let mut sum = Gray::filled(width, height, 0.0);
    for scale in [1usize, 2, 4, 8, 16, 32] {
        let (w, h) = (width.div_ceil(scale) + 1, height.div_ceil(scale) + 1);
        let coarse =
            Gray::from_values(w, h, (0..w * h).map(|_| normal(rng)).collect()).expect("one value for each pixel");
        let strength = (scale as f32).powf(slope);
        let per = 1.0 / scale as f64;
        for (i, value) in sum.values_mut().iter_mut().enumerate() {
            let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            *value += strength * coarse.sample(x * per, y * per);
        }
    }
    sum
}

/// Scales a field to a mean and a standard deviation, adds sensor noise, and rounds to whole gray levels.
fn developed(field: &Gray, middle: f32, contrast: f32, grain: f32, rng: &mut ChaCha8Rng) -> Gray {
    let n = field.values().len().max(1) as f32;
    let mean = field.values().iter().sum::<f32>() / n;
    let deviation = (field.values().iter().map(|v| (v - mean).powi(2)).sum::<f32>() / n).sqrt();
    let scale = if deviation > 0.0 { contrast / deviation } else { 0.0 };
    let mut out = field.clone();
    for value in out.values_mut() {
        let noise = if grain > 0.0 { grain * normal(rng) } else { 0.0 };
        *value = (middle + (*value - mean) * scale + noise).round().clamp(0.0, 255.0);
    }
    out
}

/// The sum of twelve uniform numbers, minus six: close enough to normal, and the same on every machine.
fn normal(rng: &mut ChaCha8Rng) -> f32 {
    (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn deviation(gray: &Gray) -> f32 {
        let n = gray.values().len() as f32;
        let mean = gray.values().iter().sum::<f32>() / n;
        (gray.values().iter().map(|v| (v - mean).powi(2)).sum::<f32>() / n).sqrt()
    }

    #[test]
    fn drawn_frames_are_gray_levels_and_hang_on_the_seed_alone() {
        for seed in 0..40 {
            let draw = |kind: usize| {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                match kind {
                    0 => noise(64, 48, &mut rng),
                    1 => water(64, 48, &mut rng),
                    2 => blank(64, 48, &mut rng),
                    _ => fields(64, 48, 0.3, &mut rng),
                }
            };
            for kind in 0..4 {
                let gray = draw(kind);
                assert!(gray.values().iter().all(|v| (0.0..=255.0).contains(v) && v.fract() == 0.0), "{kind} {seed}");
                assert_eq!(gray, draw(kind));
            }
            assert!(deviation(&draw(0)) > 2.0 && deviation(&draw(1)) < 12.0 && deviation(&draw(3)) > 3.0);
        }
    }

    #[test]
    fn stripes_run_along_the_stated_north() {
        // Turned clockwise by 30 degrees in the frame: nothing changes along it, everything repeats across it.
        let pattern = FieldPattern::Stripes { pitch: 12.0, share: 0.5 };
        let at = |x: f32, y: f32| {
            let (sin, cos) = 30f32.to_radians().sin_cos();
            pattern.at(x * cos + y * sin, y * cos - x * sin)
        };
        let (sin, cos) = 30f32.to_radians().sin_cos();
        let (along, across) = ([sin, -cos], [cos, sin]);
        for i in 0..200 {
            let (x, y, step) = (0.37 + 1.31 * i as f32, 0.11 + 0.73 * i as f32, 5.0);
            assert_eq!(at(x, y), at(x + along[0] * step, y + along[1] * step));
            assert_ne!(at(x, y), at(x + across[0] * 6.0, y + across[1] * 6.0));
        }
    }
}
