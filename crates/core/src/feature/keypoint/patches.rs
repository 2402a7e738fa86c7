//! Smoothed patches around points of a frame, up to its rim: orientation and descriptor from integers.
//!
//! Sums of integers do not depend on their order, so vectorised code gives the same bits.

use crate::pixels::Gray;
use crate::simd::dispatch;

/// Steps per gray level of the stored values.
const STEPS_PER_GRAY: f32 = 16.0;
/// Radius of the disc whose centroid gives the orientation.
const CENTROID_RADIUS_PX: usize = 13;
/// Length of the disc's rows, padded to a whole number of vector registers.
const DISC_COLUMNS: usize = 32;
const DISC_ROWS: usize = 2 * CENTROID_RADIUS_PX + 1;
/// Width of the mirrored rim around the frame: a patch of any point inside fits.
const RIM_PX: usize = 20;
/// The smoothing kernel: two boxes of five pixels as one (sum 25).
const KERNEL: [f32; 9] = [1.0, 2.0, 3.0, 4.0, 5.0, 4.0, 3.0, 2.0, 1.0];
const KERNEL_RADIUS_PX: usize = 4;

/// A frame smoothed for the comparison of single pixels (two passes of a 5 px box), mirrored at its edges.
pub struct Patches {
    values: Vec<i16>,
    stride: usize,
    disc: Box<Disc>,
}

/// Weights of the disc's pixels for the first moments: their offsets along x and y, zero outside.
struct Disc {
    along_x: [[i16; DISC_COLUMNS]; DISC_ROWS],
    along_y: [[i16; DISC_COLUMNS]; DISC_ROWS],
}

impl Patches {
    /// Makes the patches of a frame of at least 16 x 16 pixels; gray levels are clipped to [0, 255].
    pub fn new(gray: &Gray) -> Self {
        patches(gray)
    }

    /// [`Patches::new`] without a choice of vector registers.
    #[inline(always)]
    fn new_plain(gray: &Gray) -> Self {
        let (width, height) = (gray.width_px(), gray.height_px());
        let stride = width + 2 * RIM_PX;
        let mut rows = vec![0f32; width * height];
        let mut padded = vec![0f32; width + 2 * KERNEL_RADIUS_PX];
        for (y, out) in rows.chunks_exact_mut(width).enumerate() {
            mirror_into(gray.row(y), KERNEL_RADIUS_PX, &mut padded);
            for (x, out) in out.iter_mut().enumerate() {
                let w = &padded[x..x + KERNEL.len()];
                *out = kernel_sum(|k| w[k]);
            }
        }
        let mut values = vec![0i16; stride * (height + 2 * RIM_PX)];
        let mut line = vec![0i16; width];
        for y in 0..height {
            let lines: [&[f32]; KERNEL.len()] = std::array::from_fn(|k| {
                let j = mirrored(y as isize + k as isize - KERNEL_RADIUS_PX as isize, height);
                &rows[j * width..(j + 1) * width]
            });
            for (x, out) in line.iter_mut().enumerate() {
                *out = (kernel_sum(|k| lines[k][x]) * (STEPS_PER_GRAY / 625.0)).clamp(0.0, 4095.0) as i16;
            }
            mirror_into(&line, RIM_PX, &mut values[(y + RIM_PX) * stride..(y + RIM_PX + 1) * stride]);
        }
        for y in (0..RIM_PX).chain(height + RIM_PX..height + 2 * RIM_PX) {
            let source = mirrored(y as isize - RIM_PX as isize, height) + RIM_PX;
            values.copy_within(source * stride..(source + 1) * stride, y * stride);
        }
        Self { values, stride, disc: Disc::new() }
    }

    /// The orientation at pixel (x, y), radians from x towards y, and the descriptor: 256 comparisons of pixels at the points
    /// of `pattern`, turned by the orientation. Bit i of byte i / 8 is set where the first point is darker.
    pub fn describe(&self, pattern: &BriefPattern, x: usize, y: usize) -> (f32, [u8; 32]) {
        describe(self, pattern, x, y)
    }

    #[inline(always)]
    fn describe_at(&self, pattern: &BriefPattern, x: usize, y: usize) -> (f32, [u8; 32]) {
        let corner = (y + RIM_PX - CENTROID_RADIUS_PX) * self.stride + x + RIM_PX - CENTROID_RADIUS_PX;
        let (mut moment_x, mut moment_y) = (0i32, 0i32);
        for (row, (along_x, along_y)) in self.disc.along_x.iter().zip(&self.disc.along_y).enumerate() {
            let line = &self.values[corner + row * self.stride..][..DISC_COLUMNS];
            for k in 0..DISC_COLUMNS {
                moment_x += i32::from(line[k]) * i32::from(along_x[k]);
                moment_y += i32::from(line[k]) * i32::from(along_y[k]);
            }
        }
        let (mx, my) = (moment_x as f32, moment_y as f32);
        let length = (mx * mx + my * my).sqrt();
        let (cos, sin) = if length > 0.0 { (mx / length, my / length) } else { (1.0, 0.0) };
        let patch = &self.values[y * self.stride + x..][..2 * RIM_PX * self.stride + 2 * RIM_PX + 1];
        (my.atan2(mx), self.bits(pattern, patch, cos, sin))
    }

    /// `patch` begins `RIM_PX` above and to the left of the point.
    #[inline(always)]
    fn bits(&self, pattern: &BriefPattern, patch: &[i16], cos: f32, sin: f32) -> [u8; 32] {
        const MIDDLE: f32 = RIM_PX as f32 + 0.5;
        let stride = self.stride as i32;
        let mut places = [[0i32; 256]; 2];
        for (places, points) in places.iter_mut().zip(&pattern.points) {
            for (place, (px, py)) in places.iter_mut().zip(points.x.iter().zip(&points.y)) {
                let (x, y) = ((cos * px - sin * py + MIDDLE) as i32, (sin * px + cos * py + MIDDLE) as i32);
                *place = y * stride + x;
            }
        }
        let mut bits = [0u8; 32];
        for (byte, k) in bits.iter_mut().zip((0..256).step_by(8)) {
            for i in 0..8 {
                let is_darker = patch[places[0][k + i] as usize] < patch[places[1][k + i] as usize];
                *byte |= u8::from(is_darker) << i;
            }
        }
        bits
    }
}

dispatch! {
    fn patches(gray: &Gray) -> Patches {
        Patches::new_plain(gray)
    }
}

dispatch! {
    fn describe(patches: &Patches, pattern: &BriefPattern, x: usize, y: usize) -> (f32, [u8; 32]) {
        patches.describe_at(pattern, x, y)
    }
}

/// The pairs of points that BRIEF compares, pixels from the keypoint, as columns.
pub struct BriefPattern {
    points: [Points; 2],
}

/// Coordinates of 256 points.
struct Points {
    x: [f32; 256],
    y: [f32; 256],
}

impl BriefPattern {
    /// Makes the columns of 256 pairs of points.
    pub fn new(pairs: &[[[f32; 2]; 2]]) -> Self {
        let column = |point: usize, axis: usize| std::array::from_fn(|i| pairs[i][point][axis]);
        Self { points: std::array::from_fn(|p| Points { x: column(p, 0), y: column(p, 1) }) }
    }
}

impl Disc {
    fn new() -> Box<Self> {
        let mut disc =
            Box::new(Self { along_x: [[0; DISC_COLUMNS]; DISC_ROWS], along_y: [[0; DISC_COLUMNS]; DISC_ROWS] });
        let radius = CENTROID_RADIUS_PX as i16;
        for dy in -radius..=radius {
            for dx in (-radius..=radius).filter(|dx| dx * dx + dy * dy <= radius * radius) {
                let (row, column) = ((dy + radius) as usize, (dx + radius) as usize);
                (disc.along_x[row][column], disc.along_y[row][column]) = (dx, dy);
            }
        }
        disc
    }
}

/// The kernel's weighted sum; symmetrical neighbours are added first, so that the sum is symmetrical.
#[inline(always)]
fn kernel_sum(value: impl Fn(usize) -> f32) -> f32 {
    let mut sum = KERNEL[KERNEL_RADIUS_PX] * value(KERNEL_RADIUS_PX);
    for (k, weight) in KERNEL[..KERNEL_RADIUS_PX].iter().enumerate() {
        sum += weight * (value(k) + value(KERNEL.len() - 1 - k));
    }
    sum
}

/// The index in [0, n) of the mirror image of i, edges not repeated; n > 20.
fn mirrored(i: isize, n: usize) -> usize {
    let n = n as isize;
    let i = if i < 0 { -i } else { i };
    let i = if i >= n { 2 * (n - 1) - i } else { i };
    i.clamp(0, n - 1) as usize
}

/// Writes `line` with `rim` mirrored values on both sides.
#[inline(always)]
fn mirror_into<T: Copy>(line: &[T], rim: usize, out: &mut [T]) {
    out[rim..rim + line.len()].copy_from_slice(line);
    for k in 1..=rim {
        out[rim - k] = line[mirrored(-(k as isize), line.len())];
        out[rim + line.len() - 1 + k] = line[mirrored((line.len() - 1 + k) as isize, line.len())];
    }
}

#[cfg(test)]
mod tests {
    use super::super::descriptor;
    use super::super::test_images::blocks;
    use super::*;

    #[test]
    fn both_twins_agree_bit_for_bit_up_to_the_rim() {
        let gray = blocks(70, 50);
        let pattern = BriefPattern::new(&descriptor::pattern());
        let (either, scalar) = (Patches::new(&gray), Patches::new_plain(&gray));
        assert_eq!(either.values, scalar.values);
        for (x, y) in [(0, 0), (69, 49), (35, 25), (4, 45)] {
            let (angle, bits) = either.describe(&pattern, x, y);
            let (twin_angle, twin_bits) = scalar.describe_at(&pattern, x, y);
            assert_eq!((angle.to_bits(), bits), (twin_angle.to_bits(), twin_bits));
        }
    }

    #[test]
    fn the_orientation_points_to_the_bright_side() {
        let bright_below = Gray::from_values(60, 60, (0..3600).map(|i| (i / 60 * 4) as f32).collect()).unwrap();
        let (angle, _) = Patches::new(&bright_below).describe(&BriefPattern::new(&descriptor::pattern()), 30, 30);
        assert!((angle - std::f32::consts::FRAC_PI_2).abs() < 1e-3, "{angle}");
    }

    #[test]
    fn mirrors_without_repeating_the_edge() {
        assert_eq!([-2, -1, 0, 4, 5, 6].map(|i| mirrored(i, 5)), [2, 1, 0, 4, 3, 2]);
    }
}
