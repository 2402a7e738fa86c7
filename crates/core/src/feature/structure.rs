//! `Structure`: the direction of edges instead of brightness.
//!
//! The direction of edges survives years, seasons and sensors. Per pixel the gradient g is taken as a complex
//! number; its doubled and its quadrupled angle, |g| e^(2i phi) and |g| e^(4i phi), forget the sign of the contrast.
//! Both are smoothed a little and divided by the smoothed |g| plus a floor, so that strong and weak edges count alike
//! and flat ground counts for nothing.
//!
//! The published channel features (HOPC; CFOG, Ye et al., IEEE TGRS 57, 2019) sample |g cos(theta - phi)| in 9
//! directions. Over theta that function is 2/pi + 4/(3 pi) cos 2(theta - phi) - 4/(15 pi) cos 4(theta - phi) + ...:
//! after the mean is removed, 96 % of the energy of all 9 channels is the doubled angle. Two complex channels hold
//! the energy of nine real ones, and the full weight of the quadrupled angle makes the peak narrower than theirs.
//!
//! Both moduli stay below 1, so a signed byte for each real number is enough: sums of products are exact integers,
//! the same on every machine and in every order.

use crate::pixels::{Gray, Mask};
use crate::simd::dispatch;

/// Valid pixels needed on every side of a described pixel: one for the gradient, two for the smoothing.
pub const BORDER_PX: usize = 3;
/// The value 1 of a channel, as stored.
pub const CHANNEL_ONE: f32 = 127.0;
/// The value 1 of an energy, as stored.
pub const ENERGY_ONE: f32 = 255.0;

/// Half of the symmetric smoothing kernel, sigma 0.8 px, cut at 2 px, normalised: centre, 1 px, 2 px.
const KERNEL: [f32; 3] = [0.500_3, 0.228_96, 0.020_89];
/// The floor as a share of the image's mean gradient.
const FLOOR_SHARE: f32 = 0.5;
/// Bounds of the floor, gray levels per pixel; with a lower floor sensor noise would count as structure.
const FLOOR_BOUNDS: (f32, f32) = (0.75, 6.0);

/// The structure of an image: two complex channels and the energy of both, each of shape (height, width), row by row.
/// Zero where nothing is known.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Structure {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Real part of the doubled angle, imaginary part, then both of the quadrupled angle, in parts of [`CHANNEL_ONE`].
    pub channels: Vec<[i8; 4]>,
    /// Mean of both channels' squared moduli, in parts of [`ENERGY_ONE`].
    pub energy: Vec<u8>,
}

impl Structure {
    /// Makes a structure of which nothing is known.
    pub fn unknown(width_px: usize, height_px: usize) -> Self {
        let count = width_px * height_px;
        Self { width_px, height_px, channels: vec![[0; 4]; count], energy: vec![0; count] }
    }

    /// Describes an image where `mask` (of the same size) is valid [`BORDER_PX`] around.
    pub fn new(gray: &Gray, mask: &Mask) -> Self {
        let mut structure = Self::unknown(gray.width_px(), gray.height_px());
        if gray.width_px() > 2 * BORDER_PX && gray.height_px() > 2 * BORDER_PX {
            let valid = mask.eroded(BORDER_PX);
            let floor = gradient_floor(mean_gradient(gray, &valid));
            StructurePass { gray, valid: &valid, floor }.write(&mut structure);
        }
        structure
    }

    /// Total energy, in pixels of energy 1: the amount of structure to match.
    pub fn total_energy(&self) -> f64 {
        self.energy.iter().map(|&e| u64::from(e)).sum::<u64>() as f64 / f64::from(ENERGY_ONE)
    }

    /// Mean energy of the pixels with energy, in [0, 1].
    pub fn mean_energy(&self) -> f64 {
        self.total_energy() / self.energy.iter().filter(|&&e| e > 0).count().max(1) as f64
    }

    /// Copies the part of `source` that falls inside, the corner of `source` at (`x_px`, `y_px`).
    pub fn paste(&mut self, source: &Self, x_px: i64, y_px: i64) {
        let (from_x, to_x) = (x_px.max(0), (x_px + source.width_px as i64).min(self.width_px as i64));
        let (from_y, to_y) = (y_px.max(0), (y_px + source.height_px as i64).min(self.height_px as i64));
        if from_x >= to_x {
            return;
        }
        let count = (to_x - from_x) as usize;
        for y in from_y..to_y {
            let from = (y - y_px) as usize * source.width_px + (from_x - x_px) as usize;
            let to = y as usize * self.width_px + from_x as usize;
            self.channels[to..to + count].copy_from_slice(&source.channels[from..from + count]);
            self.energy[to..to + count].copy_from_slice(&source.energy[from..from + count]);
        }
    }
}

/// The inputs of one pass over an image.
struct StructurePass<'a> {
    gray: &'a Gray,
    valid: &'a Mask,
    floor: f32,
}

/// Rows of the four channels and of |g|, in this order.
type Rows = [Vec<f32>; 5];

impl StructurePass<'_> {
    /// Streams over the rows: gradient, smoothing along x into a ring of five rows, smoothing along y, division.
    fn write(&self, out: &mut Structure) {
        let (width, height) = (self.gray.width_px(), self.gray.height_px());
        let blank = || -> Rows { std::array::from_fn(|_| vec![0f32; width]) };
        let (mut raw, mut smooth) = (blank(), blank());
        let mut ring: [Rows; 5] = std::array::from_fn(|_| blank());
        for y in 1..height - 1 {
            let lines = [self.gray.row(y - 1), self.gray.row(y), self.gray.row(y + 1)];
            gradient_row(lines, &mut raw);
            smooth_row(&raw, &mut ring[y % 5]);
            if y < 2 + BORDER_PX {
                continue;
            }
            let middle = y - 2;
            let range = middle * width..(middle + 1) * width;
            for (k, smooth) in smooth.iter_mut().enumerate() {
                smooth_column(std::array::from_fn(|i| ring[(middle + 3 + i) % 5][k].as_slice()), smooth);
            }
            let target = Target { channels: &mut out.channels[range.clone()], energy: &mut out.energy[range.clone()] };
            divide_row(&smooth, &self.valid.values()[range], self.floor, target);
        }
    }
}

/// The rows to write.
struct Target<'a> {
    channels: &'a mut [[i8; 4]],
    energy: &'a mut [u8],
}

/// Sobel's gradient, gray levels per pixel, at column x + 1 of three lines cut to start at x.
#[inline(always)]
fn gradient(a: &[f32], b: &[f32], c: &[f32], x: usize) -> (f32, f32) {
    let gx = (a[x + 2] - a[x] + 2.0 * (b[x + 2] - b[x]) + c[x + 2] - c[x]) * 0.125;
    let gy = (c[x] - a[x] + 2.0 * (c[x + 1] - a[x + 1]) + c[x + 2] - a[x + 2]) * 0.125;
    (gx, gy)
}

dispatch! {
    /// Writes |g| e^(2i phi), |g| e^(4i phi) and |g| of the middle one of three rows; the first and the last pixel stay.
    fn gradient_row(lines: [&[f32]; 3], out: &mut Rows) {
        let [a, b, c] = lines;
        let count = a.len() - 2;
        let (a, b, c) = (&a[..count + 2], &b[..count + 2], &c[..count + 2]);
        let [re2, im2, re4, im4, magnitude] = out;
        let (re2, im2) = (&mut re2[1..count + 1], &mut im2[1..count + 1]);
        let (re4, im4) = (&mut re4[1..count + 1], &mut im4[1..count + 1]);
        let magnitude = &mut magnitude[1..count + 1];
        for x in 0..count {
            let (gx, gy) = gradient(a, b, c, x);
            let m = (gx * gx + gy * gy).sqrt();
            let inverse = 1.0 / (m + 1e-6);
            let (re, im) = ((gx * gx - gy * gy) * inverse, 2.0 * gx * gy * inverse);
            magnitude[x] = m;
            re2[x] = re;
            im2[x] = im;
            re4[x] = (re * re - im * im) * inverse;
            im4[x] = 2.0 * re * im * inverse;
        }
    }
}

dispatch! {
    /// Applies the kernel along x; the outermost two pixels stay.
    fn smooth_row(raw: &Rows, out: &mut Rows) {
        let [k0, k1, k2] = KERNEL;
        for (source, target) in raw.iter().zip(out) {
            let count = source.len() - 4;
            let (source, target) = (&source[..count + 4], &mut target[2..count + 2]);
            for x in 0..count {
                target[x] = k0 * source[x + 2] + k1 * (source[x + 1] + source[x + 3]) + k2 * (source[x] + source[x + 4]);
            }
        }
    }
}

dispatch! {
    /// Applies the kernel along y over five rows.
    fn smooth_column(rows: [&[f32]; 5], out: &mut [f32]) {
        let [k0, k1, k2] = KERNEL;
        let [a, b, c, d, e] = rows.map(|row| &row[..out.len()]);
        for x in 0..out.len() {
            out[x] = k0 * c[x] + k1 * (b[x] + d[x]) + k2 * (a[x] + e[x]);
        }
    }
}

dispatch! {
    /// Divides by |g| and floor, and rounds to bytes.
    fn divide_row(smooth: &Rows, valid: &[u8], floor: f32, out: Target<'_>) {
        let width = valid.len();
        let [re2, im2, re4, im4, magnitude] = smooth;
        let (re2, im2, re4, im4) = (&re2[..width], &im2[..width], &re4[..width], &im4[..width]);
        let (magnitude, channels, energy) = (&magnitude[..width], &mut out.channels[..width], &mut out.energy[..width]);
        for x in 0..width {
            let known = if valid[x] != 0 { 1.0 } else { 0.0 };
            let weight = known / (magnitude[x] + floor);
            let (a, b, c, d) = (re2[x] * weight, im2[x] * weight, re4[x] * weight, im4[x] * weight);
            let packed = (rounded(a * CHANNEL_ONE) & 255)
                | (rounded(b * CHANNEL_ONE) & 255) << 8
                | (rounded(c * CHANNEL_ONE) & 255) << 16
                | rounded(d * CHANNEL_ONE) << 24;
            channels[x] = packed.to_le_bytes().map(|byte| byte as i8);
            energy[x] = rounded(0.5 * ENERGY_ONE * (a * a + b * b + c * c + d * d)) as u8;
        }
    }
}

/// The nearest integer, ties to even, for |v| < 2^22: adding 1.5 x 2^23 leaves the integer in the low bits.
#[inline(always)]
fn rounded(v: f32) -> u32 {
    (v + 12_582_912.0).to_bits()
}

/// The mean gradient over the valid pixels, gray levels per pixel. Rows are summed one by one, so the order is fixed.
fn mean_gradient(gray: &Gray, valid: &Mask) -> f32 {
    let count = valid.values().iter().filter(|&&v| v != 0).count();
    let mut row = vec![0f32; gray.width_px()];
    let mut sum = 0f64;
    for y in 1..gray.height_px() - 1 {
        let lines = [gray.row(y - 1), gray.row(y), gray.row(y + 1)];
        let span = y * gray.width_px()..(y + 1) * gray.width_px();
        magnitude_row(lines, &valid.values()[span], &mut row);
        sum += row.iter().map(|&m| f64::from(m)).sum::<f64>();
    }
    (sum / count.max(1) as f64) as f32
}

dispatch! {
    /// Writes |g| of one row where the mask is valid, else 0.
    fn magnitude_row(lines: [&[f32]; 3], valid: &[u8], out: &mut [f32]) {
        let [a, b, c] = lines;
        let count = a.len() - 2;
        let (a, b, c) = (&a[..count + 2], &b[..count + 2], &c[..count + 2]);
        let (valid, out) = (&valid[1..count + 1], &mut out[1..count + 1]);
        for x in 0..count {
            let (gx, gy) = gradient(a, b, c, x);
            let m = (gx * gx + gy * gy).sqrt();
            out[x] = if valid[x] != 0 { m } else { 0.0 };
        }
    }
}

/// Half the mean gradient, within bounds.
fn gradient_floor(mean_gradient: f32) -> f32 {
    (mean_gradient * FLOOR_SHARE).clamp(FLOOR_BOUNDS.0, FLOOR_BOUNDS.1)
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
    fn does_not_depend_on_the_sign_of_the_contrast() {
        let mask = Mask::filled(40, 30, true);
        let (a, b) = (Structure::new(&wavy(1.0), &mask), Structure::new(&wavy(-1.0), &mask));
        let near = |p: &[i8; 4], q: &[i8; 4]| p.iter().zip(q).all(|(x, y)| x.abs_diff(*y) <= 1);
        assert!(a.channels.iter().zip(&b.channels).all(|(p, q)| near(p, q)));
    }

    #[test]
    fn knows_nothing_near_a_hole() {
        let mut mask = Mask::filled(40, 30, true);
        mask.set(20, 15, false);
        let s = Structure::new(&wavy(1.0), &mask);
        for y in 12..=18 {
            for x in 17..=23 {
                assert_eq!((s.energy[y * 40 + x], s.channels[y * 40 + x]), (0, [0; 4]));
            }
        }
        assert!(s.energy[15 * 40 + 16] > 0 && s.energy[0] == 0);
    }

    #[test]
    fn accepts_images_too_small_to_describe() {
        let s = Structure::new(&Gray::filled(5, 3, 1.0), &Mask::filled(5, 3, true));
        assert_eq!(s.total_energy(), 0.0);
    }

    /// The definition, pixel by pixel, without streaming.
    fn by_definition(gray: &Gray, mask: &Mask, x: usize, y: usize) -> [f32; 4] {
        let g = |i: usize, j: usize| gray.at(i, j);
        let gradient = |i: usize, j: usize| {
            let gx = g(i + 1, j - 1) - g(i - 1, j - 1) + 2.0 * (g(i + 1, j) - g(i - 1, j)) + g(i + 1, j + 1)
                - g(i - 1, j + 1);
            let gy = g(i - 1, j + 1) - g(i - 1, j - 1) + 2.0 * (g(i, j + 1) - g(i, j - 1)) + g(i + 1, j + 1)
                - g(i + 1, j - 1);
            (gx / 8.0, gy / 8.0)
        };
        let magnitude = |i: usize, j: usize| gradient(i, j).0.hypot(gradient(i, j).1);
        let valid = mask.eroded(BORDER_PX);
        let all = (0..gray.width_px() * gray.height_px()).map(|i| (i % gray.width_px(), i / gray.width_px()));
        let known: Vec<_> = all.filter(|&(i, j)| valid.at(i, j)).collect();
        let floor = gradient_floor(known.iter().map(|&(i, j)| magnitude(i, j)).sum::<f32>() / known.len() as f32);
        let (mut sums, mut below) = ([0f32; 4], 0f32);
        for dy in 0..5 {
            for dx in 0..5 {
                let k = KERNEL[2usize.abs_diff(dx)] * KERNEL[2usize.abs_diff(dy)];
                let (i, j) = (x + dx - 2, y + dy - 2);
                let (m, angle) = (magnitude(i, j), gradient(i, j).1.atan2(gradient(i, j).0));
                let each = [(2.0 * angle).cos(), (2.0 * angle).sin(), (4.0 * angle).cos(), (4.0 * angle).sin()];
                (0..4).for_each(|c| sums[c] += k * m * each[c]);
                below += k * m;
            }
        }
        sums.map(|s| if valid.at(x, y) { CHANNEL_ONE * s / (below + floor) } else { 0.0 })
    }

    #[test]
    fn streaming_agrees_with_the_definition() {
        let mut gray = wavy(1.0);
        gray.values_mut().iter_mut().enumerate().for_each(|(i, v)| *v += ((i * 7919) % 31) as f32);
        let mut mask = Mask::filled(40, 30, true);
        mask.set(30, 9, false);
        let s = Structure::new(&gray, &mask);
        for y in BORDER_PX..30 - BORDER_PX {
            for x in BORDER_PX..40 - BORDER_PX {
                let (found, expected) = (s.channels[y * 40 + x], by_definition(&gray, &mask, x, y));
                assert!(
                    (0..4).all(|c| (f32::from(found[c]) - expected[c]).abs() < 0.6),
                    "{x} {y} {found:?} {expected:?}"
                );
            }
        }
    }

    #[test]
    fn pastes_what_falls_inside() {
        let s = Structure::new(&wavy(1.0), &Mask::filled(40, 30, true));
        let mut window = Structure::unknown(20, 20);
        window.paste(&s, -15, 9);
        assert_eq!(window.channels[9 * 20], s.channels[15]);
        assert_eq!(window.channels[19 * 20 + 19], s.channels[10 * 40 + 34]);
        assert_eq!(window.energy[8 * 20 + 3], 0);
    }
}
