//! `StationaryMask`: what stands still in the images of a flight.

use super::blocks::{Block, StillBlocks};
use crate::pixels::Gray;

/// A block is masked where it stood still in at least this share of the comparisons in which it showed something,
const LEAST_SHARE: f64 = 0.6;
/// and in at least this many of them.
const LEAST_STILL: u32 = 4;
/// Older comparisons count less and less: the counts are halved when they reach this.
const MOST_COUNTED: u32 = 64;

/// The parts of the images of one camera that stand still while the ground moves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StationaryMask {
    columns: usize,
    block_px: usize,
    counts: Vec<Counts>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Counts {
    still: u32,
    moving: u32,
}

impl StationaryMask {
    /// Adds the comparison of two images between which the ground moved. Images of another size begin a new mask.
    pub fn add(&mut self, compared: &StillBlocks) {
        let is_same = (self.columns, self.block_px, self.counts.len())
            == (compared.columns(), compared.block_px(), compared.blocks().len());
        if !is_same {
            self.columns = compared.columns();
            self.block_px = compared.block_px();
            self.counts = vec![Counts::default(); compared.blocks().len()];
        }
        for (counts, block) in self.counts.iter_mut().zip(compared.blocks()) {
            match block {
                Block::Plain => continue,
                Block::Moves => counts.moving += 1,
                Block::Still => counts.still += 1,
            }
            if counts.still + counts.moving >= MOST_COUNTED {
                counts.still /= 2;
                counts.moving /= 2;
            }
        }
    }

    /// Whether each block is masked, row by row from the upper left.
    pub fn masked(&self) -> Vec<bool> {
        self.counts.iter().map(|c| c.is_masked()).collect()
    }

    /// Whether nothing is masked.
    pub fn is_empty(&self) -> bool {
        !self.counts.iter().any(|c| c.is_masked())
    }

    /// Whether a point of the image lies in a masked block or within half a block of one; pixels from the corner.
    pub fn holds(&self, x_px: f64, y_px: f64) -> bool {
        if self.counts.is_empty() {
            return false;
        }
        let half = self.block_px as f64 / 2.0;
        let block = |v: f64, count: usize| ((v / self.block_px as f64).max(0.0) as usize).min(count - 1);
        let rows = self.counts.len() / self.columns;
        [-half, half].into_iter().any(|dy| {
            let row = block(y_px + dy, rows);
            [-half, half]
                .into_iter()
                .any(|dx| self.counts[row * self.columns + block(x_px + dx, self.columns)].is_masked())
        })
    }

    /// An image whose masked parts, and half a block around them, show nothing: they are filled smoothly from their surroundings.
    /// `None` where nothing is masked.
    pub fn filled(&self, image: &Gray) -> Option<Gray> {
        if self.is_empty() {
            return None;
        }
        let (width, height) = (image.width_px(), image.height_px());
        let mut weights = Gray::filled(width, height, 1.0);
        let half = self.block_px / 2;
        for (i, _) in self.counts.iter().enumerate().filter(|(_, c)| c.is_masked()) {
            let (left, top) = (i % self.columns * self.block_px, i / self.columns * self.block_px);
            let columns = left.saturating_sub(half).min(width)..(left + self.block_px + half).min(width);
            for y in top.saturating_sub(half).min(height)..(top + self.block_px + half).min(height) {
                weights.values_mut()[y * width..][columns.clone()].fill(0.0);
            }
        }
        Some(filled_where(image, &weights))
    }
}

/// Fills the pixels of weight 0 from the means of their surroundings (pull and push over halved images).
fn filled_where(image: &Gray, weights: &Gray) -> Gray {
    let (width, height) = (image.width_px(), image.height_px());
    if weights.values().iter().all(|w| *w > 0.0) || width < 2 || height < 2 {
        return image.clone();
    }
    let mut weighted = image.clone();
    weighted.values_mut().iter_mut().zip(weights.values()).for_each(|(v, w)| *v *= w);
    let (sums, half_weights) = (weighted.binned(2), weights.binned(2));
    let mut half = sums;
    half.values_mut().iter_mut().zip(half_weights.values()).for_each(|(v, w)| *v = if *w > 0.0 { *v / w } else { 0.0 });
    let half = filled_where(&half, &half_weights);
    let mut filled = image.clone();
    for (i, v) in filled.values_mut().iter_mut().enumerate() {
        if weights.values()[i] <= 0.0 {
            *v = half.sample(((i % width) as f64 + 0.5) / 2.0, ((i / width) as f64 + 0.5) / 2.0);
        }
    }
    filled
}

impl Counts {
    fn is_masked(self) -> bool {
        self.still >= LEAST_STILL && f64::from(self.still) >= LEAST_SHARE * f64::from(self.still + self.moving)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(number: usize, overlay: bool) -> Gray {
        let value = |i: usize| {
            let (x, y) = (i % 240, i / 240);
            if overlay && (20..100).contains(&x) && (30..60).contains(&y) && (x / 4 + y / 5) % 2 == 0 {
                return 250.0;
            }
            let (x, y) = (x as f64 + 37.0 * number as f64, y as f64);
            let wave = (0.31 * x + 0.11 * y).sin() + (0.17 * x - 0.23 * y).cos() + (0.05 * x + 0.4 * y).sin();
            128.0 + 20.0 * wave as f32
        };
        Gray::from_values(240, 180, (0..240 * 180).map(value).collect()).unwrap()
    }

    fn mask(frames: usize, overlay: bool) -> StationaryMask {
        let mut mask = StationaryMask::default();
        for number in 1..frames {
            mask.add(&StillBlocks::compare(&frame(number - 1, overlay), &frame(number, overlay)).unwrap());
        }
        mask
    }

    #[test]
    fn an_overlay_is_masked_after_a_few_images_and_the_ground_is_not() {
        assert!(mask(4, true).is_empty());
        let found = mask(8, true);
        assert!(found.holds(60.0, 45.0) && !found.holds(200.0, 150.0) && !found.holds(60.0, 120.0));
        let (seen, filled) = (frame(9, true), found.filled(&frame(9, true)).unwrap());
        let changed = seen.values().iter().zip(filled.values()).filter(|(a, b)| a != b).count();
        // The overlay has 80 x 30 px; blocks of 12 px and half a block around them.
        assert!((2400..3 * 2400).contains(&changed), "{changed}");
        assert!(filled.at(60, 45) < 200.0 && filled.values().iter().all(|v| (0.0..256.0).contains(v)));
        assert!(mask(12, false).is_empty() && mask(12, false).filled(&frame(3, false)).is_none());
    }

    #[test]
    fn a_mask_of_another_image_size_begins_anew() {
        let mut found = mask(8, true);
        let small = Gray::from_values(120, 90, (0..120 * 90).map(|i| (i % 7 * 30) as f32).collect()).unwrap();
        found.add(&StillBlocks::compare(&small, &small).unwrap());
        assert!(found.is_empty());
    }
}
