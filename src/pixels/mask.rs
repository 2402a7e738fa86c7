//! `Mask`: which pixels are real.

/// One byte a pixel, 255 valid, 0 missing, row by row from the top, shape (height, width).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    width_px: usize,
    height_px: usize,
    values: Vec<u8>,
}

impl Mask {
    /// All pixels valid, or none.
    pub fn filled(width_px: usize, height_px: usize, valid: bool) -> Self {
        Self { width_px, height_px, values: vec![if valid { 255 } else { 0 }; width_px * height_px] }
    }

    /// A mask of given bytes (anything but 0 is valid); `None` where the count does not fit the size.
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
}
