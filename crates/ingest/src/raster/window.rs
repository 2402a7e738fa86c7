//! `Window`: a rectangle of source pixels as floats, and values interpolated between its pixels.
//!
//! Colours are premultiplied by validity, so that an invalid pixel has no weight and never bleeds into its neighbours.

use super::block::{BlockCache, BlockSource, PixelBlock, RasterLevel};
use super::error::RasterError;

/// Red, green, blue in [0, 255], zero where invalid; then the validity, 255 or 0. All four pass through every step, so that
/// the compiler can use a vector register.
pub(super) type Sample = [f32; 4];

/// A rectangle of one level of a source. Pixels outside the image are invalid.
#[derive(Debug, Default)]
pub(super) struct Window {
    x0: i64,
    y0: i64,
    width_px: usize,
    height_px: usize,
    values: Vec<Sample>,
    all_valid: bool,
}

/// A source's blocks, and the cache of decoded ones.
pub(super) struct CachedBlocks<'a> {
    pub source: &'a dyn BlockSource,
    pub cache: &'a BlockCache,
    pub source_key: u64,
}

impl Window {
    /// Fills the rectangle [x0, x1) x [y0, y1) of a level from its blocks.
    pub fn load(&mut self, blocks: &CachedBlocks, level: usize, [x0, y0, x1, y1]: [i64; 4]) -> Result<(), RasterError> {
        let &CachedBlocks { source, cache, source_key } = blocks;
        self.reset(x0, y0, (x1 - x0) as usize, (y1 - y0) as usize);
        let RasterLevel { width_px, height_px, block_width_px, block_height_px } = source.levels()[level];
        let inside = x0 >= 0 && y0 >= 0 && x1 <= width_px as i64 && y1 <= height_px as i64;
        let clip = |v: i64, size: u64| v.clamp(0, size as i64) as u64;
        let (left, right) = (clip(x0, width_px), clip(x1, width_px));
        let (top, bottom) = (clip(y0, height_px), clip(y1, height_px));
        let mut all_valid = inside;
        if left < right && top < bottom {
            for row in top / block_height_px..=(bottom - 1) / block_height_px {
                for column in left / block_width_px..=(right - 1) / block_width_px {
                    if source.is_missing(level, column, row) {
                        all_valid = false;
                        continue;
                    }
                    let key = (source_key, level, column, row);
                    let block = cache.get(key, source.decodes_alone(), || source.read(level, column, row))?;
                    let corner = ((column * block_width_px) as i64, (row * block_height_px) as i64);
                    all_valid &= self.paste(&block, corner.0, corner.1);
                }
            }
        }
        self.set_all_valid(all_valid);
        Ok(())
    }

    /// Returns all pixels, row by row.
    pub fn values(&self) -> &[Sample] {
        &self.values
    }

    /// Makes the window an invalid rectangle with its corner at `x0`, `y0`. The memory is kept between uses.
    pub fn reset(&mut self, x0: i64, y0: i64, width_px: usize, height_px: usize) {
        (self.x0, self.y0, self.width_px, self.height_px) = (x0, y0, width_px, height_px);
        self.values.clear();
        self.values.resize(width_px * height_px, [0.0; 4]);
        self.all_valid = false;
    }

    /// Copies the part of a block that lies in the window; true where every copied pixel is valid. `block_x`, `block_y` is
    /// the block's corner in the level.
    pub fn paste(&mut self, block: &PixelBlock, block_x: i64, block_y: i64) -> bool {
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

    /// States whether every pixel of the window is valid.
    pub fn set_all_valid(&mut self, all_valid: bool) {
        self.all_valid = all_valid;
    }

    /// Returns the positions `start + i * step` (level pixels), relative to this window.
    pub fn walk(&self, start: [f64; 2], step: [f64; 2]) -> Walk {
        let corner = [self.x0 as f64 + 0.5, self.y0 as f64 + 0.5];
        let fixed = |v: f64| (v * ONE) as i64;
        Walk { at: [0, 1].map(|i| fixed(start[i] - corner[i])), step: step.map(fixed) }
    }

    /// Interpolates by cubic convolution (Keys, a = -1/2) where all sixteen neighbours are valid, else bilinearly over the
    /// valid ones of four. `None` where the pixel that contains the position is invalid. Positions must lie two pixels inside
    /// the window.
    // Inlined because otherwise the result passes through memory: 2 x slower.
    #[inline(always)]
    pub fn interpolate(&self, at: SamplePosition) -> Option<Sample> {
        let first = (at.row - 1) * self.width_px + at.column - 1;
        if !self.all_valid && !self.is_valid_around(first) {
            return self.bilinear_of_valid(at);
        }
        let (wx, wy) = (keys(at.fx), keys(at.fy));
        let mut sum = [0.0f32; 4];
        for (j, weight_y) in wy.into_iter().enumerate() {
            let taps: &[Sample; 4] = self.values[first + j * self.width_px..][..4].try_into().expect("four of them");
            let mut line = [0.0f32; 4];
            for (tap, weight_x) in taps.iter().zip(wx) {
                for c in 0..4 {
                    line[c] += tap[c] * weight_x;
                }
            }
            for c in 0..4 {
                sum[c] += line[c] * weight_y;
            }
        }
        Some(sum)
    }

    #[inline(never)]
    fn is_valid_around(&self, first: usize) -> bool {
        (0..4).all(|j| self.values[first + j * self.width_px..][..4].iter().all(|tap| tap[3] != 0.0))
    }

    #[cold]
    fn bilinear_of_valid(&self, at: SamplePosition) -> Option<Sample> {
        let nearest = (at.row + usize::from(at.fy >= 0.5)) * self.width_px + at.column + usize::from(at.fx >= 0.5);
        if self.values[nearest][3] == 0.0 {
            return None;
        }
        // The nearest pixel is valid and has a weight of at least a quarter.
        let sum = self.sample(at);
        Some(unmultiplied(sum))
    }

    /// Returns the bilinear sample, premultiplied.
    #[inline(always)]
    pub fn sample(&self, at: SamplePosition) -> Sample {
        let first = at.row * self.width_px + at.column;
        let top: &[Sample; 2] = self.values[first..][..2].try_into().expect("two of them");
        let bottom: &[Sample; 2] = self.values[first + self.width_px..][..2].try_into().expect("two of them");
        let mut sum = [0.0f32; 4];
        for c in 0..4 {
            let upper = top[0][c] + (top[1][c] - top[0][c]) * at.fx;
            let lower = bottom[0][c] + (bottom[1][c] - bottom[0][c]) * at.fx;
            sum[c] = upper + (lower - upper) * at.fy;
        }
        sum
    }
}

/// 1 in the fixed-point numbers of a [`Walk`]: 32 integer bits and 32 fraction bits, so that a step costs two additions,
/// and splitting a position costs two shifts.
const ONE: f64 = 4_294_967_296.0;

/// Equally spaced positions in a window.
#[derive(Debug, Clone, Copy)]
pub(super) struct Walk {
    at: [i64; 2],
    step: [i64; 2],
}

/// A position between four pixels of a window: the upper-left pixel, and the offset from its centre, in [0, 1).
#[derive(Debug, Clone, Copy)]
pub(super) struct SamplePosition {
    column: usize,
    row: usize,
    fx: f32,
    fy: f32,
}

impl Walk {
    /// Returns the current position and advances by one step.
    pub fn next_position(&mut self) -> SamplePosition {
        let [x, y] = self.at;
        self.at = [x.wrapping_add(self.step[0]), y.wrapping_add(self.step[1])];
        // An f32 holds 24 bits.
        let fraction = |v: i64| ((v as u32) >> 8) as i32 as f32 * (1.0 / 16_777_216.0);
        SamplePosition { column: (x >> 32) as usize, row: (y >> 32) as usize, fx: fraction(x), fy: fraction(y) }
    }
}

/// Returns the colour of a premultiplied mean that is not wholly invalid; its validity is 255.
pub(super) fn unmultiplied(mean: Sample) -> Sample {
    let scale = 255.0 / mean[3];
    mean.map(|v| v * scale)
}

fn copy<const N: usize>(target: &mut [Sample], source: &[u8], rgbv: impl Fn([u8; N]) -> [u8; 4]) {
    for (to, from) in target.iter_mut().zip(source.chunks_exact(N)) {
        let [r, g, b, v] = rgbv(from.try_into().expect("chunks of N"));
        *to = [f32::from(r), f32::from(g), f32::from(b), f32::from(v)];
    }
}

/// Returns the weights of the pixels at -1, 0, 1, 2 for a position f in [0, 1) between 0 and 1.
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

    /// Pixels of the value 10 x + y, all valid except those named.
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
        let all_valid = window.paste(&PixelBlock { width_px: 8, height_px: 8, channels: 2, data }, 0, 0);
        window.set_all_valid(all_valid);
        window
    }

    #[test]
    fn a_ramp_stays_a_ramp() {
        for missing in [vec![], vec![(5, 5)]] {
            let window = ramp(&missing);
            for (x, y) in [(2.5, 2.5), (3.1, 2.9), (2.75, 3.25)] {
                let expected = (10.0 * (x - 0.5) + (y - 0.5)) as f32;
                let at = window.walk([x, y], [0.0; 2]).next_position();
                let value = window.interpolate(at).unwrap()[0];
                assert!((value - expected).abs() < 1e-4, "{x} {y}: {value} for {expected}");
                assert!((window.sample(at)[0] - expected).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn an_invalid_pixel_has_no_weight() {
        let window = ramp(&[(3, 3)]);
        let at = |x: f64, y: f64| window.walk([x, y], [0.0; 2]).next_position();
        assert_eq!(window.interpolate(at(3.6, 3.4)), None);
        // Half way to the invalid pixel: the value of the valid neighbour, not a mixture with black.
        let value = window.interpolate(at(4.05, 3.5)).unwrap()[0];
        assert!((value - 43.0).abs() < 1e-4, "{value}");
        let half = window.sample(at(4.0, 3.5));
        assert!((half[3] - 127.5).abs() < 1e-4 && (unmultiplied(half)[0] - 43.0).abs() < 1e-4);
    }
}
