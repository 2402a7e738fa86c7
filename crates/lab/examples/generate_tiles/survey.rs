//! Orthophotos of a canvas, as files: JPEG, world file, `.prj`.

use crate::canvas::{PIXELS_PER_M, SceneCanvas};
use crate::utm::PRJ;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// Easting and northing of the scene's north-western corner, EPSG:32633.
pub const CORNER: [f64; 2] = [544_000.0, 5_372_000.0];

/// How a sensor and the air turn light into pixel values.
#[derive(Clone, Copy)]
pub struct Radiometry {
    /// Factor on red, green, blue.
    pub gain: [f32; 3],
    /// Exponent on [0, 1].
    pub gamma: f32,
    /// Share of bluish haze over everything.
    pub haze: f32,
    /// Standard deviation of the noise, grey levels.
    pub noise: f32,
}

impl Radiometry {
    /// A pixel value for a colour.
    pub fn develop(&self, colour: [f32; 3], rng: &mut ChaCha8Rng) -> [u8; 3] {
        const AIR: [f32; 3] = [176.0, 190.0, 205.0];
        std::array::from_fn(|i| {
            let exposed = (colour[i] * self.gain[i] / 255.0).clamp(0.0, 1.0).powf(self.gamma) * 255.0;
            // Twelve uniform numbers less six are near enough to normal, and the same on every machine.
            let normal: f32 = (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
            (exposed * (1.0 - self.haze) + AIR[i] * self.haze + normal * self.noise).round().clamp(0.0, 255.0) as u8
        })
    }
}

/// Writes columns `from_m..to_m` of a canvas, whose north-western corner has grid coordinates `corner`, as an
/// orthophoto of 1 m pixels.
pub fn write(
    canvas: &SceneCanvas,
    corner: [f64; 2],
    range_m: (usize, usize),
    radiometry: Radiometry,
    seed: u64,
    quality: u8,
    path: &Path,
) -> anyhow::Result<()> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let per_m = PIXELS_PER_M as usize;
    let (width, height) = (range_m.1 - range_m.0, canvas.height / per_m);
    let mut pixels = Vec::with_capacity(width * height * 3);
    for row in 0..height {
        for column in range_m.0..range_m.1 {
            let mut sum = [0.0f32; 3];
            for i in 0..per_m * per_m {
                let colour = canvas.colours[(row * per_m + i / per_m) * canvas.width + column * per_m + i % per_m];
                (0..3).for_each(|k| sum[k] += colour[k] / (per_m * per_m) as f32);
            }
            pixels.extend(radiometry.develop(sum, &mut rng));
        }
    }
    write_jpeg(path, &pixels, width, height, quality)?;
    let world = format!("1.0\n0.0\n0.0\n-1.0\n{:.1}\n{:.1}\n", corner[0] + range_m.0 as f64 + 0.5, corner[1] - 0.5);
    std::fs::write(path.with_extension("jgw"), world)?;
    std::fs::write(path.with_extension("prj"), PRJ)?;
    Ok(())
}

/// Writes interleaved RGB as a JPEG.
pub fn write_jpeg(path: &Path, pixels: &[u8], width: usize, height: usize, quality: u8) -> anyhow::Result<()> {
    std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
    let encoder = jpeg_encoder::Encoder::new_file(path, quality)?;
    encoder.encode(pixels, u16::try_from(width)?, u16::try_from(height)?, jpeg_encoder::ColorType::Rgb)?;
    Ok(())
}
