//! `Structure`: where edges run, not how bright a patch is.
//!
//! What survives years, seasons and sensors is the direction of edges. Per pixel the gradient g is taken as a complex
//! number; its doubled and its quadrupled angle, |g| e^(2i phi) and |g| e^(4i phi), forget the sign of the contrast.
//! Both are smoothed a little and divided by the smoothed |g| plus a floor, so that strong and weak edges count alike
//! and flat ground counts for nothing.
//!
//! The published channel features (HOPC; CFOG, Ye et al., IEEE TGRS 57, 2019) sample |g cos(theta - phi)| in 9
//! directions. Over theta that function is 2/pi + 4/(3 pi) cos 2(theta - phi) - 4/(15 pi) cos 4(theta - phi) + ...:
//! after the mean is removed, 96 % of the energy of all 9 channels is the doubled angle. Two complex channels hold
//! what nine real ones do, and weighing the quadrupled angle fully makes the peak narrower than theirs.

use crate::pixels::{Gray, Mask};

/// A described pixel needs this many valid pixels on every side: one for the gradient, two for the smoothing.
pub const BORDER_PX: usize = 3;

/// Half of the symmetric smoothing kernel, sigma 0.8 px, cut at 2 px, normalised: centre, 1 px, 2 px.
const KERNEL: [f32; 3] = [0.500_3, 0.228_96, 0.020_89];
/// The floor as a share of the image's mean gradient.
const FLOOR_SHARE: f32 = 0.5;
/// Bounds of the floor, gray levels per pixel: below, sensor noise would count as structure.
const FLOOR_BOUNDS: (f32, f32) = (0.75, 6.0);

/// The structure of an image: two complex channels and the energy of the first, each of shape (height, width), row by
/// row. Zero where nothing is known.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Structure {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Real part of the doubled angle, imaginary part, then both of the quadrupled angle.
    pub planes: [Vec<f32>; 4],
    /// Mean of both channels' squared moduli.
    pub energy: Vec<f32>,
    /// Share of pixels whose neighbourhood was valid.
    pub valid_fraction: f64,
}

impl Structure {
    /// Describes an image where `mask` (same size) is valid [`BORDER_PX`] around.
    pub fn of(gray: &Gray, mask: &Mask) -> Self {
        let (width, height) = (gray.width_px(), gray.height_px());
        let count = width * height;
        let mut planes: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; count]);
        let mut magnitude = vec![0f32; count];
        if width > 2 * BORDER_PX && height > 2 * BORDER_PX {
            gradients(gray, &mut planes, &mut magnitude);
            let mut scratch = vec![0f32; count];
            for plane in planes.iter_mut().chain([&mut magnitude]) {
                smooth(plane, &mut scratch, width, height);
            }
        }
        let valid = mask.eroded(BORDER_PX);
        let floor = floor_of(&magnitude, valid.values());
        let mut energy = vec![0f32; count];
        for i in 0..count {
            let weight = if valid.values()[i] != 0 { 1.0 / (magnitude[i] + floor) } else { 0.0 };
            let mut sum = 0.0;
            for plane in &mut planes {
                plane[i] *= weight;
                sum += plane[i] * plane[i];
            }
            energy[i] = 0.5 * sum;
        }
        Self { width_px: width, height_px: height, planes, energy, valid_fraction: valid.valid_fraction() }
    }

    /// Total energy: how much there is to match.
    pub fn total_energy(&self) -> f64 {
        self.energy.iter().map(|&e| f64::from(e)).sum()
    }
}

/// Fills `planes` with |g| e^(2i phi), |g| e^(4i phi) and `magnitude` with |g|, gray levels per pixel (Sobel / 8).
fn gradients(gray: &Gray, planes: &mut [Vec<f32>; 4], magnitude: &mut [f32]) {
    let (width, height) = (gray.width_px(), gray.height_px());
    let [re2, im2, re4, im4] = planes;
    for y in 1..height - 1 {
        let (a, b, c) = (gray.row(y - 1), gray.row(y), gray.row(y + 1));
        for x in 1..width - 1 {
            let i = y * width + x;
            let gx = (a[x + 1] - a[x - 1] + 2.0 * (b[x + 1] - b[x - 1]) + c[x + 1] - c[x - 1]) * 0.125;
            let gy = (c[x - 1] - a[x - 1] + 2.0 * (c[x] - a[x]) + c[x + 1] - a[x + 1]) * 0.125;
            let m = (gx * gx + gy * gy).sqrt();
            let inverse = 1.0 / (m + 1e-6);
            let (re, im) = ((gx * gx - gy * gy) * inverse, 2.0 * gx * gy * inverse);
            magnitude[i] = m;
            re2[i] = re;
            im2[i] = im;
            re4[i] = (re * re - im * im) * inverse;
            im4[i] = 2.0 * re * im * inverse;
        }
    }
}

/// The separable kernel, in place; the outermost two pixels stay as they are.
fn smooth(plane: &mut [f32], scratch: &mut [f32], width: usize, height: usize) {
    let [k0, k1, k2] = KERNEL;
    for (source, target) in plane.chunks_exact(width).zip(scratch.chunks_exact_mut(width)) {
        target.copy_from_slice(source);
        let windows = source.windows(5);
        for (out, w) in target[2..width - 2].iter_mut().zip(windows) {
            *out = k0 * w[2] + k1 * (w[1] + w[3]) + k2 * (w[0] + w[4]);
        }
    }
    for y in 2..height - 2 {
        let rows = |dy: usize| &scratch[(y + dy - 2) * width..(y + dy - 1) * width];
        let (a, b, c, d, e) = (rows(0), rows(1), rows(2), rows(3), rows(4));
        let target = &mut plane[y * width..(y + 1) * width];
        for x in 0..width {
            target[x] = k0 * c[x] + k1 * (b[x] + d[x]) + k2 * (a[x] + e[x]);
        }
    }
}

/// Half the mean gradient over the valid pixels, within bounds.
fn floor_of(magnitude: &[f32], valid: &[u8]) -> f32 {
    let (sum, count) = magnitude
        .iter()
        .zip(valid)
        .filter(|&(_, &v)| v != 0)
        .fold((0f64, 0usize), |(sum, count), (&m, _)| (sum + f64::from(m), count + 1));
    let mean = if count == 0 { 0.0 } else { (sum / count as f64) as f32 };
    (mean * FLOOR_SHARE).clamp(FLOOR_BOUNDS.0, FLOOR_BOUNDS.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy(sign: f32) -> Gray {
        let value = |i: usize| {
            let (x, y) = ((i % 40) as f32, (i / 40) as f32);
            128.0 + sign * 60.0 * (0.7 * x + 0.3 * y).sin()
        };
        Gray::from_values(40, 30, (0..1200).map(value).collect()).unwrap()
    }

    #[test]
    fn the_kernel_sums_to_one() {
        assert!((KERNEL[0] + 2.0 * (KERNEL[1] + KERNEL[2]) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn forgets_the_sign_of_the_contrast() {
        let mask = Mask::filled(40, 30, true);
        let (a, b) = (Structure::of(&wavy(1.0), &mask), Structure::of(&wavy(-1.0), &mask));
        for (p, q) in a.planes.iter().zip(&b.planes) {
            assert!(p.iter().zip(q).all(|(x, y)| (x - y).abs() < 1e-3));
        }
    }

    #[test]
    fn knows_nothing_near_a_hole() {
        let mut mask = Mask::filled(40, 30, true);
        mask.set(20, 15, false);
        let s = Structure::of(&wavy(1.0), &mask);
        for y in 12..=18 {
            for x in 17..=23 {
                assert_eq!(s.energy[y * 40 + x], 0.0);
            }
        }
        assert!(s.energy[15 * 40 + 16] > 0.0 && s.energy[0] == 0.0);
    }

    #[test]
    fn accepts_images_too_small_to_describe() {
        let s = Structure::of(&Gray::filled(5, 3, 1.0), &Mask::filled(5, 3, true));
        assert_eq!(s.total_energy(), 0.0);
    }
}
