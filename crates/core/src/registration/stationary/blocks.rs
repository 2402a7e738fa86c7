//! `StillBlocks`: the blocks of an image that show the same as in an earlier image, at the same place.

use crate::pixels::Gray;

/// Images are compared at this edge (square root of the area) at most, px.
const MAX_EDGE_PX: f64 = 360.0;
/// Edge of a block, px of the compared images.
pub const BLOCK_PX: usize = 12;
/// A block with a smaller standard deviation shows nothing, gray levels.
const LEAST_DEVIATION: f64 = 3.0;
/// Least correlation of a block that stands still.
const LEAST_CORRELATION: f64 = 0.8;
/// A block that stands still correlates less when it is shifted by this, px. Ground that moves correlates better in one direction, and
/// an edge along the motion equally well.
const SHIFT_PX: usize = 2;
/// What a shift adds at least to 1 - correlation: a factor, and a constant for images without noise.
const SHIFTED_FACTOR: f64 = 1.3;
const SHIFTED_EXCESS: f64 = 0.002;

/// Whether a block stands still.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Block {
    /// Shows too little in one of the images.
    Plain,
    /// Shows something else.
    Moves,
    /// Shows the same at the same place.
    Still,
}

/// A grid of blocks, compared between two images of one camera. Image coordinates: no motion, tilt or lens is taken out.
#[derive(Debug, Clone, PartialEq)]
pub struct StillBlocks {
    columns: usize,
    blocks: Vec<Block>,
    /// Edge of a block in pixels of the images.
    block_px: usize,
}

impl StillBlocks {
    /// Compares two images; `None` where their sizes differ or they are smaller than three blocks.
    pub fn compare(a: &Gray, b: &Gray) -> Option<Self> {
        let size = |g: &Gray| (g.width_px(), g.height_px());
        if size(a) != size(b) {
            return None;
        }
        let edge_px = ((a.width_px() * a.height_px()) as f64).sqrt();
        let factor = (edge_px / MAX_EDGE_PX).ceil().max(1.0) as usize;
        if factor > 1 { Self::compared(&a.binned(factor), &b.binned(factor), factor) } else { Self::compared(a, b, 1) }
    }

    fn compared(a: &Gray, b: &Gray, factor: usize) -> Option<Self> {
        let count = |n: usize| n.saturating_sub(2 * SHIFT_PX) / BLOCK_PX;
        let (columns, rows) = (count(a.width_px()), count(a.height_px()));
        if columns < 3 || rows < 3 {
            return None;
        }
        let corner = |i: usize| [SHIFT_PX + BLOCK_PX * (i % columns), SHIFT_PX + BLOCK_PX * (i / columns)];
        let blocks = (0..columns * rows).map(|i| block(a, b, corner(i))).collect();
        Some(Self { columns, blocks, block_px: BLOCK_PX * factor })
    }

    /// The blocks, row by row from the upper left.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Blocks in a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Edge of a block, pixels of the images.
    pub fn block_px(&self) -> usize {
        self.block_px
    }

    /// Share of the blocks standing still among those that show something and are not in `known`; 0 where fewer than a tenth of
    /// all blocks show something.
    pub fn still_share(&self, known: &[bool]) -> f64 {
        let unknown = self.blocks.iter().enumerate().filter(|(i, _)| known.get(*i) != Some(&true));
        let (still, moving) = unknown.fold((0usize, 0usize), |(still, moving), (_, block)| match block {
            Block::Plain => (still, moving),
            Block::Moves => (still, moving + 1),
            Block::Still => (still + 1, moving),
        });
        let shown = still + moving;
        if shown * 10 < self.blocks.len() { 0.0 } else { still as f64 / shown as f64 }
    }
}

/// Sums over a block of a and the block of b that is shifted.
fn correlation(a: &Gray, b: &Gray, [x, y]: [usize; 2], [dx, dy]: [usize; 2]) -> Option<f64> {
    let (mut sum_a, mut sum_b, mut aa, mut bb, mut ab) = (0f32, 0f32, 0f32, 0f32, 0f32);
    for row in 0..BLOCK_PX {
        let of_a = &a.row(y + row)[x..x + BLOCK_PX];
        let of_b = &b.row(y + row + dy - SHIFT_PX)[x + dx - SHIFT_PX..][..BLOCK_PX];
        for (&p, &q) in of_a.iter().zip(of_b) {
            // Offset to keep the squares small.
            let (p, q) = (p - 128.0, q - 128.0);
            sum_a += p;
            sum_b += q;
            aa += p * p;
            bb += q * q;
            ab += p * q;
        }
    }
    let n = (BLOCK_PX * BLOCK_PX) as f64;
    let [sum_a, sum_b, aa, bb, ab] = [sum_a, sum_b, aa, bb, ab].map(f64::from);
    let (var_a, var_b) = (aa - sum_a * sum_a / n, bb - sum_b * sum_b / n);
    let least = n * LEAST_DEVIATION.powi(2);
    (var_a >= least && var_b >= least).then(|| (ab - sum_a * sum_b / n) / (var_a * var_b).sqrt())
}

fn block(a: &Gray, b: &Gray, corner: [usize; 2]) -> Block {
    let Some(here) = correlation(a, b, corner, [SHIFT_PX, SHIFT_PX]) else { return Block::Plain };
    if here < LEAST_CORRELATION {
        return Block::Moves;
    }
    let least = SHIFTED_FACTOR * (1.0 - here) + SHIFTED_EXCESS;
    let shifts = [[0, SHIFT_PX], [2 * SHIFT_PX, SHIFT_PX], [SHIFT_PX, 0], [SHIFT_PX, 2 * SHIFT_PX]];
    let peaks = shifts.iter().all(|&shift| correlation(a, b, corner, shift).is_none_or(|c| 1.0 - c >= least));
    if peaks { Block::Still } else { Block::Moves }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves that move by a number of pixels; `noise` in gray levels.
    pub fn ground(shift_px: f64, noise: f32, seed: u32) -> Gray {
        let mut state = seed;
        let mut random = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1u32 << 24) as f32 - 0.5
        };
        let value = |i: usize| {
            let (x, y) = ((i % 240) as f64 + shift_px, (i / 240) as f64);
            let wave = (0.31 * x + 0.11 * y).sin() + (0.17 * x - 0.23 * y).cos() + (0.05 * x + 0.4 * y).sin();
            128.0 + 20.0 * wave as f32 + noise * random()
        };
        Gray::from_values(240, 180, (0..240 * 180).map(value).collect()).unwrap()
    }

    fn still_share(a: &Gray, b: &Gray) -> f64 {
        StillBlocks::compare(a, b).unwrap().still_share(&[])
    }

    #[test]
    fn equal_and_nearly_equal_images_stand_still_and_moved_ones_do_not() {
        assert_eq!(still_share(&ground(0.0, 0.0, 1), &ground(0.0, 0.0, 1)), 1.0);
        assert!(still_share(&ground(0.0, 10.0, 1), &ground(0.0, 10.0, 2)) > 0.9);
        for shift_px in [2.0, 3.0, 9.0, 30.0] {
            let share = still_share(&ground(0.0, 5.0, 1), &ground(shift_px, 5.0, 2));
            assert!(share < 0.1, "{shift_px} px: {share}");
        }
    }

    #[test]
    fn the_frozen_half_of_an_image_is_found() {
        let (a, mut b) = (ground(0.0, 3.0, 1), ground(25.0, 3.0, 2));
        b.values_mut()[..240 * 90].copy_from_slice(&a.values()[..240 * 90]);
        let share = still_share(&a, &b);
        assert!((0.4..0.6).contains(&share), "{share}");
    }

    #[test]
    fn an_edge_along_the_motion_does_not_stand_still() {
        let road = |shift: f64| {
            let mut g = ground(shift, 0.0, 1);
            g.values_mut()[240 * 88..240 * 92].fill(250.0);
            g
        };
        assert!(still_share(&road(0.0), &road(40.0)) < 0.05);
    }

    #[test]
    fn plain_and_small_images_give_no_share() {
        let plain = Gray::filled(240, 180, 90.0);
        assert_eq!(still_share(&plain, &plain), 0.0);
        assert_eq!(StillBlocks::compare(&Gray::filled(20, 20, 1.0), &Gray::filled(20, 20, 1.0)), None);
        assert_eq!(StillBlocks::compare(&plain, &Gray::filled(200, 180, 90.0)), None);
    }
}
