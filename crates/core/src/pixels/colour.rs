//! `Colour`: 8-bit red, green, blue.

use super::gray::Gray;

/// An image of 8-bit RGB triples, row by row from the top, shape (height, width, 3).
#[derive(Debug, Clone, PartialEq)]
pub struct Colour {
    width_px: usize,
    height_px: usize,
    values: Vec<u8>,
}

impl Colour {
    /// Makes a black image.
    pub fn black(width_px: usize, height_px: usize) -> Self {
        Self { width_px, height_px, values: vec![0; width_px * height_px * 3] }
    }

    /// Makes an image of given values, interleaved RGB; `None` where the count does not fit the size.
    pub fn from_values(width_px: usize, height_px: usize, values: Vec<u8>) -> Option<Self> {
        (values.len() == width_px * height_px * 3).then_some(Self { width_px, height_px, values })
    }

    /// Columns.
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Rows.
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// Interleaved RGB, row by row.
    pub fn values(&self) -> &[u8] {
        &self.values
    }

    /// As [`Colour::values`], mutable.
    pub fn values_mut(&mut self) -> &mut [u8] {
        &mut self.values
    }

    /// The triple at column x, row y.
    pub fn at(&self, x: usize, y: usize) -> [u8; 3] {
        let i = (y * self.width_px + x) * 3;
        [self.values[i], self.values[i + 1], self.values[i + 2]]
    }

    /// Sets the triple at column x, row y.
    pub fn set(&mut self, x: usize, y: usize, rgb: [u8; 3]) {
        let i = (y * self.width_px + x) * 3;
        self.values[i..i + 3].copy_from_slice(&rgb);
    }

    /// The luma of ITU-R BT.601 (0.299, 0.587, 0.114), in [0, 255].
    pub fn to_gray(&self) -> Gray {
        let values = self
            .values
            .chunks_exact(3)
            .map(|p| 0.299 * f32::from(p[0]) + 0.587 * f32::from(p[1]) + 0.114 * f32::from(p[2]))
            .collect();
        Gray::from_values(self.width_px, self.height_px, values).expect("one value for each pixel")
    }
}
