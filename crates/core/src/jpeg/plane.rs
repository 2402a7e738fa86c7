//! `Plane`: the pixels of one component, block by block.

use super::frame_header::Component;
use super::inverse_transform::InverseTransform;
use super::quantization::ZIGZAG;

/// How much smaller than the file an image is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reduction {
    /// Every pixel of the file.
    #[default]
    None,
    /// A pixel for 2 x 2 of the file.
    Half,
    /// A pixel for 4 x 4 of the file.
    Quarter,
    /// A pixel for 8 x 8 of the file.
    Eighth,
}

impl Reduction {
    /// Pixels of the file along each axis of one pixel.
    pub fn divisor(self) -> usize {
        match self {
            Self::None => 1,
            Self::Half => 2,
            Self::Quarter => 4,
            Self::Eighth => 8,
        }
    }
}

/// The coefficients of a block, multiplied by their steps.
pub(super) struct Block {
    /// By place, column * 8 + row of the frequencies.
    values: [i32; 64],
    /// Whether only the first may differ from 0.
    is_flat: bool,
}

impl Block {
    pub fn new() -> Self {
        Self { values: [0; 64], is_flat: true }
    }

    /// Sets all coefficients to 0 but the first.
    #[inline(always)]
    pub fn begin(&mut self, first: i32) {
        if !self.is_flat {
            *self = Self::new();
        }
        self.values[0] = first;
    }

    /// Sets the k-th coefficient in coded order; k is at least 1.
    #[inline(always)]
    pub fn put(&mut self, k: usize, value: i32) {
        self.values[usize::from(ZIGZAG[k & 63])] = value;
        self.is_flat = false;
    }
}

/// A pixel's value made of a level in [0, 255].
pub(super) trait Level: Copy + Default {
    /// The value of a level.
    fn from_level(level: f32) -> Self;
}

impl Level for f32 {
    fn from_level(level: f32) -> Self {
        level
    }
}

impl Level for u8 {
    fn from_level(level: f32) -> Self {
        (level + 0.5) as u8
    }
}

/// The pixels of one component.
pub(super) struct Plane<L> {
    pub width_px: usize,
    pub height_px: usize,
    pub values: Vec<L>,
    transform: InverseTransform,
}

impl<L: Level> Plane<L> {
    /// An empty plane for a component. Rows and columns of the file that fill no pixel are dropped.
    pub fn new(component: &Component, reduction: Reduction) -> Self {
        let length = |pixels: usize| (pixels / reduction.divisor()).max(1);
        let (width_px, height_px) = (length(component.width_px), length(component.height_px));
        let values = vec![L::default(); width_px * height_px];
        Self { width_px, height_px, values, transform: InverseTransform::new(8 / reduction.divisor()) }
    }

    /// Transforms a block into the pixels at a column and row of blocks; what lies outside is dropped.
    pub fn put(&mut self, column: usize, row: usize, block: &Block) {
        let size = self.transform.size();
        let (x, y) = (column * size, row * size);
        if x >= self.width_px || y >= self.height_px {
            return;
        }
        let (width, height) = (size.min(self.width_px - x), size.min(self.height_px - y));
        let pixels = self.transform.pixels(&block.values, block.is_flat);
        for (line, levels) in pixels[..height].iter().enumerate() {
            let first = (y + line) * self.width_px + x;
            for (out, level) in self.values[first..first + width].iter_mut().zip(levels) {
                *out = L::from_level(level.clamp(0.0, 255.0));
            }
        }
    }
}
