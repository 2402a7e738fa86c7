//! Cells: what is kept of a tile's structure to find a lost aircraft.
//!
//! A cell is the mean of [`Structure`]'s four components over 16 x 16 pixels. The mean is taken after every pixel was
//! normalised at full sharpness: a road of one pixel still turns its cell, where in a shrunk image it would have vanished.
//! Numbers of this kind per place are what HOG (Dalal and Triggs, 2005) keeps of an image, with two harmonics of the
//! direction in the place of a histogram.

use super::{BORDER_PX, Structure};
use crate::pixels::{Gray, Mask};

/// Edge of a cell, pixels of its level.
pub const CELL_PX: usize = 16;
/// Cells along a tile's edge (512 px).
pub const CELLS: usize = 32;
/// Length of a tile's blob: four values a cell, row by row.
pub const CELLS_BLOB_LEN: usize = CELLS * CELLS * 4;
/// In the place of each value of a cell where less than [`LEAST_VALID`] of it is known.
pub const MISSING: i8 = i8::MIN;

/// Share of a cell's pixels that must be described.
pub const LEAST_VALID: f32 = 0.35;
/// The cells of an image of whole cells, as stored: `[re 2phi, im 2phi, re 4phi, im 4phi]` in 254ths a cell, row by row,
/// [`MISSING`] where too little is known. A remainder of the image that fills no cell is left out.
pub fn cells_of(gray: &Gray, mask: &Mask) -> Vec<i8> {
    let structure = Structure::of(gray, mask);
    let valid = mask.eroded(BORDER_PX);
    let (columns, rows) = (gray.width_px() / CELL_PX, gray.height_px() / CELL_PX);
    let mut cells = Vec::with_capacity(columns * rows * 4);
    for (row, column) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
        let mut sum = [0i32; 4];
        let mut count = 0;
        for y in row * CELL_PX..(row + 1) * CELL_PX {
            let start = y * structure.width_px + column * CELL_PX;
            count += valid.values()[start..start + CELL_PX].iter().map(|&v| i32::from(v != 0)).sum::<i32>();
            for channels in &structure.channels[start..start + CELL_PX] {
                (0..4).for_each(|i| sum[i] += i32::from(channels[i]));
            }
        }
        let known = count as f32 >= LEAST_VALID * (CELL_PX * CELL_PX) as f32;
        cells.extend(sum.map(|s| if known { quantised(s, count) } else { MISSING }));
    }
    cells
}

/// Twice the mean, rounded: whole means stay below 1/2 on real ground.
fn quantised(sum: i32, count: i32) -> i8 {
    ((4 * sum + count * sum.signum()) / (2 * count)).clamp(-127, 127) as i8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_of_upright_stripes_points_one_way_everywhere() {
        let stripes = Gray::from_values(512, 512, (0..512 * 512).map(|i| (i / 4 % 2 * 90) as f32).collect()).unwrap();
        let cells = cells_of(&stripes, &Mask::filled(512, 512, true));
        assert_eq!(cells.len(), CELLS_BLOB_LEN);
        // The gradient lies along x: its doubled and quadrupled angle are 0.
        assert!(cells.chunks_exact(4).all(|c| c[0] > 80 && c[1] == 0 && c[2] > 80 && c[3] == 0));
    }

    #[test]
    fn a_cell_without_pixels_is_missing() {
        let mut mask = Mask::filled(64, 32, true);
        (0..32).for_each(|y| (0..30).for_each(|x| mask.set(x, y, false)));
        let gray = Gray::from_values(64, 32, (0..64 * 32).map(|i| (i * 7 % 97) as f32).collect()).unwrap();
        let cells = cells_of(&gray, &mask);
        assert_eq!(cells.len(), 4 * 2 * 4);
        assert!(cells[..8].iter().all(|&v| v == MISSING) && cells[8..16].iter().all(|&v| v != MISSING));
    }
}
