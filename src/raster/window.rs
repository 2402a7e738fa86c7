//! `Window`: a rectangle of source pixels as floats, and values between its pixels.
//!
//! Colours are premultiplied by validity (0 or 1), so that a missing pixel weighs nothing and never bleeds.

use super::block::Block;

/// Red, green, blue in [0, 255], each times the validity in the last place.
pub(super) type Sample = [f32; 4];

/// A rectangle of one level of a source; what lies outside the image is invalid.
#[derive(Debug, Default)]
pub(super) struct Window {
    x0: i64,
    y0: i64,
    width_px: usize,
    height_px: usize,
    values: Vec<Sample>,
    all_valid: bool,
}

impl Window {
    /// An empty (wholly invalid) rectangle from `x0`, `y0`; keeps its memory between uses.
    pub fn reset(&mut self, x0: i64, y0: i64, width_px: usize, height_px: usize) {
        (self.x0, self.y0, self.width_px, self.height_px) = (x0, y0, width_px, height_px);
        self.values.clear();
        self.values.resize(width_px * height_px, [0.0; 4]);
        self.all_valid = false;
    }

    /// Copies the part of a block that lies in the window. `block_x`, `block_y`: the block's corner in the level.
    /// True where every pixel copied is valid.
    pub fn paste(&mut self, block: &Block, block_x: i64, block_y: i64) -> bool {
        let left = self.x0.max(block_x);
        let right = (self.x0 + self.width_px as i64).min(block_x + block.width_px as i64);
        let top = self.y0.max(block_y);
        let bottom = (self.y0 + self.height_px as i64).min(block_y + block.height_px as i64);
        let mut all_valid = true;
        for y in top..bottom {
            let count = (right - left).max(0) as usize;
            let from = ((y - block_y) as usize * block.width_px + (left - block_x) as usize) * block.channels;
            let to = (y - self.y0) as usize * self.width_px + (left - self.x0) as usize;
            let source = &block.data[from..from + count * block.channels];
            let target = &mut self.values[to..to + count];
            match block.channels {
                1 => copy::<1>(target, source, |[g]| [g, g, g, 255]),
                2 => copy::<2>(target, source, |[g, v]| [g, g, g, v]),
                3 => copy::<3>(target, source, |[r, g, b]| [r, g, b, 255]),
                _ => copy::<4>(target, source, |p| p),
            }
            if block.has_validity() {
                all_valid &= target.iter().all(|p| p[3] != 0.0);
            }
        }
        all_valid
    }

    /// States that every pixel of the window was pasted valid.
    pub fn set_all_valid(&mut self, all_valid: bool) {
        self.all_valid = all_valid;
    }

    /// Cubic convolution (Keys, a = -1/2) where all sixteen neighbours are valid, else bilinear over the valid ones of
    /// four; `None` where the pixel that holds the position is missing. Positions in level pixels.
    pub fn interpolate(&self, x_px: f64, y_px: f64) -> Option<[f32; 3]> {
        let (x, y) = (x_px - 0.5 - self.x0 as f64, y_px - 0.5 - self.y0 as f64);
        let (column, row) = (x.floor(), y.floor());
        let (fx, fy) = ((x - column) as f32, (y - row) as f32);
        let (column, row) = (column as usize, row as usize);
        let (wx, wy) = (keys(fx), keys(fy));
        let first = (row - 1) * self.width_px + column - 1;
        let mut sum = [0.0f32; 4];
        for (j, weight_y) in wy.into_iter().enumerate() {
            let taps: &[Sample; 4] = self.values[first + j * self.width_px..][..4].try_into().expect("four of them");
            if !self.all_valid && taps.iter().any(|t| t[3] == 0.0) {
                return self.bilinear_of_valid(column, row, fx, fy);
            }
            for c in 0..4 {
                let line = taps[0][c] * wx[0] + taps[1][c] * wx[1] + taps[2][c] * wx[2] + taps[3][c] * wx[3];
                sum[c] += line * weight_y;
            }
        }
        Some([sum[0], sum[1], sum[2]])
    }

    fn bilinear_of_valid(&self, column: usize, row: usize, fx: f32, fy: f32) -> Option<[f32; 3]> {
        let nearest = (row + usize::from(fy >= 0.5)) * self.width_px + column + usize::from(fx >= 0.5);
        if self.values[nearest][3] == 0.0 {
            return None;
        }
        // The nearest pixel is valid and weighs at least a quarter.
        let sum = self.bilinear(row * self.width_px + column, fx, fy);
        Some([sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]])
    }

    /// Bilinear sample, premultiplied. Position in level pixels.
    pub fn sample(&self, x_px: f64, y_px: f64) -> Sample {
        let (x, y) = (x_px - 0.5 - self.x0 as f64, y_px - 0.5 - self.y0 as f64);
        let (column, row) = (x as usize, y as usize);
        self.bilinear(row * self.width_px + column, (x - column as f64) as f32, (y - row as f64) as f32)
    }

    fn bilinear(&self, first: usize, fx: f32, fy: f32) -> Sample {
        let top: &[Sample; 2] = self.values[first..][..2].try_into().expect("two of them");
        let bottom: &[Sample; 2] = self.values[first + self.width_px..][..2].try_into().expect("two of them");
        std::array::from_fn(|c| {
            let upper = top[0][c] + (top[1][c] - top[0][c]) * fx;
            let lower = bottom[0][c] + (bottom[1][c] - bottom[0][c]) * fx;
            upper + (lower - upper) * fy
        })
    }
}

fn copy<const N: usize>(target: &mut [Sample], source: &[u8], rgbv: impl Fn([u8; N]) -> [u8; 4]) {
    for (to, from) in target.iter_mut().zip(source.chunks_exact(N)) {
        let [r, g, b, v] = rgbv(from.try_into().expect("chunks of N"));
        *to = [f32::from(r), f32::from(g), f32::from(b), if v == 0 { 0.0 } else { 1.0 }];
    }
}

/// Weights of the pixels at -1, 0, 1, 2 for a position f in [0, 1) between 0 and 1.
///
/// # References
/// R. G. Keys, Cubic convolution interpolation for digital image processing, IEEE ASSP 29 (1981), equation 15.
fn keys(f: f32) -> [f32; 4] {
    let (f2, f3) = (f * f, f * f * f);
    [0.5 * (-f3 + 2.0 * f2 - f), 0.5 * (3.0 * f3 - 5.0 * f2 + 2.0), 0.5 * (-3.0 * f3 + 4.0 * f2 + f), 0.5 * (f3 - f2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value 10 x + y, all valid but for the pixels named.
    fn ramp(missing: &[(usize, usize)]) -> Window {
        let mut data = Vec::new();
        for y in 0..8usize {
            for x in 0..8usize {
                let valid = !missing.contains(&(x, y));
                data.extend(if valid { [(10 * x + y) as u8, 255] } else { [0, 0] });
            }
        }
        let mut window = Window::default();
        window.reset(0, 0, 8, 8);
        let all_valid = window.paste(&Block { width_px: 8, height_px: 8, channels: 2, data }, 0, 0);
        window.set_all_valid(all_valid);
        window
    }

    #[test]
    fn a_ramp_stays_a_ramp() {
        for missing in [vec![], vec![(5, 5)]] {
            let window = ramp(&missing);
            for (x, y) in [(2.5, 2.5), (3.1, 2.9), (2.75, 3.25)] {
                let expected = (10.0 * (x - 0.5) + (y - 0.5)) as f32;
                let value = window.interpolate(x, y).unwrap()[0];
                assert!((value - expected).abs() < 1e-4, "{x} {y}: {value} for {expected}");
                assert!((window.sample(x, y)[0] - expected).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_missing_pixel_weighs_nothing() {
        let window = ramp(&[(3, 3)]);
        assert_eq!(window.interpolate(3.6, 3.4), None);
        // Half way to the missing pixel's neighbour: the neighbour's own value, not a mixture with black.
        let value = window.interpolate(4.05, 3.5).unwrap()[0];
        assert!((value - 43.0).abs() < 1e-4, "{value}");
        let half = window.sample(4.0, 3.5);
        assert!((half[3] - 0.5).abs() < 1e-6 && (half[0] / half[3] - 43.0).abs() < 1e-4);
    }
}
