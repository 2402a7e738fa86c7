//! `Mask`: which pixels are valid.

use crate::simd::dispatch;

/// One byte a pixel, 255 valid, 0 missing, row by row from the top, shape (height, width).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    width_px: usize,
    height_px: usize,
    values: Vec<u8>,
}

impl Mask {
    /// Makes a mask with all pixels valid, or all missing.
    pub fn filled(width_px: usize, height_px: usize, valid: bool) -> Self {
        Self { width_px, height_px, values: vec![if valid { 255 } else { 0 }; width_px * height_px] }
    }

    /// Makes a mask of given bytes (all but 0 are valid); `None` where the count does not fit the size.
    pub fn from_values(width_px: usize, height_px: usize, mut values: Vec<u8>) -> Option<Self> {
        for value in &mut values {
            *value = if *value == 0 { 0 } else { 255 };
        }
        (values.len() == width_px * height_px).then_some(Self { width_px, height_px, values })
    }

    /// Columns.
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Rows.
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// All bytes, row by row.
    pub fn values(&self) -> &[u8] {
        &self.values
    }

    /// As [`Mask::values`], mutable; write only 0 or 255.
    pub fn values_mut(&mut self) -> &mut [u8] {
        &mut self.values
    }

    /// Whether the pixel at column x, row y is valid.
    pub fn at(&self, x: usize, y: usize) -> bool {
        self.values[y * self.width_px + x] != 0
    }

    /// Marks the pixel at column x, row y.
    pub fn set(&mut self, x: usize, y: usize, valid: bool) {
        self.values[y * self.width_px + x] = if valid { 255 } else { 0 };
    }

    /// Share of valid pixels in [0, 1]; 0 for an empty mask.
    pub fn valid_fraction(&self) -> f64 {
        let valid = self.values.iter().filter(|&&v| v != 0).count();
        if self.values.is_empty() { 0.0 } else { valid as f64 / self.values.len() as f64 }
    }

    /// Whether every pixel is valid.
    pub fn is_full(&self) -> bool {
        self.values.iter().all(|&v| v != 0)
    }

    /// The mask eroded by `radius_px` around every hole and along the image's edge: a square neighbourhood must be valid.
    pub fn eroded(&self, radius_px: usize) -> Self {
        let (width, height) = (self.width_px, self.height_px);
        let mut rows = vec![0u8; width * height];
        let mut values = vec![0u8; width * height];
        let size = 2 * radius_px + 1;
        if size > width || size > height {
            return Self { width_px: width, height_px: height, values };
        }
        for (line, out) in self.values.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
            let shifted = |d: usize| &line[d..d + width - size + 1];
            and_all(size, shifted, &mut out[radius_px..width - radius_px]);
        }
        for y in radius_px..height - radius_px {
            let row = |d: usize| &rows[(y + d - radius_px) * width..][..width];
            and_all(size, row, &mut values[y * width..(y + 1) * width]);
        }
        Self { width_px: width, height_px: height, values }
    }
}

/// Writes the bitwise "and" of `count` rows.
fn and_all<'a>(count: usize, row: impl Fn(usize) -> &'a [u8], out: &mut [u8]) {
    out.fill(255);
    for d in 0..count {
        and_row(row(d), out);
    }
}

dispatch! {
    fn and_row(row: &[u8], out: &mut [u8]) {
        for (o, v) in out.iter_mut().zip(row) {
            *o &= v;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn erosion_agrees_with_the_definition(width in 1usize..20, height in 1usize..20, radius in 0usize..4,
                                         holes in proptest::collection::vec((0usize..20, 0usize..20), 0..5)) {
            let mut mask = Mask::filled(width, height, true);
            for (x, y) in holes {
                if x < width && y < height {
                    mask.set(x, y, false);
                }
            }
            let eroded = mask.eroded(radius);
            for y in 0..height {
                for x in 0..width {
                    let inside = x >= radius && y >= radius && x + radius < width && y + radius < height;
                    let expected = inside && (x - radius..=x + radius)
                        .all(|i| (y - radius..=y + radius).all(|j| mask.at(i, j)));
                    prop_assert_eq!(eroded.at(x, y), expected);
                }
            }
        }
    }
}
