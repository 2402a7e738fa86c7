//! Cells: the mean structure of a tile in coarse squares, kept to find a lost aircraft.
//!
//! A cell is the mean of [`Structure`]'s four components over 16 x 16 pixels. The mean is taken after every pixel was
//! normalised at full resolution: a road of one pixel still turns its cell, whereas in a shrunk image the road would vanish.
//! HOG (Dalal and Triggs, 2005) keeps similar numbers, a histogram of directions instead of two harmonics.

use super::{BORDER_PX, Structure};
use crate::pixels::{Gray, Mask};

/// Edge of a cell, pixels of its level.
pub const CELL_PX: usize = 16;
/// Cells along a tile's edge (512 px).
pub const CELLS: usize = 32;
/// Length of a tile's blob: four values a cell, row by row.
pub const CELLS_BLOB_LEN: usize = CELLS * CELLS * 4;
/// The value of each component of a cell of which less than [`LEAST_VALID`] is known.
pub const MISSING: i8 = i8::MIN;

/// Least share of described pixels of a known cell.
pub const LEAST_VALID: f32 = 0.35;

/// The cells of an image, as stored: `[re 2phi, im 2phi, re 4phi, im 4phi]` in 254ths for each cell, row by row;
/// [`MISSING`] where too little is known. A remainder of the image that fills no cell is left out.
pub fn describe_cells(gray: &Gray, mask: &Mask) -> Vec<i8> {
    let structure = Structure::new(gray, mask);
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

/// Twice the mean, rounded: means stay below 1/2 on real ground.
fn quantised(sum: i32, count: i32) -> i8 {
    ((4 * sum + count * sum.signum()) / (2 * count)).clamp(-127, 127) as i8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_of_upright_stripes_points_one_way_everywhere() {
        let stripes = Gray::from_values(512, 512, (0..512 * 512).map(|i| (i / 4 % 2 * 90) as f32).collect()).unwrap();
        let cells = describe_cells(&stripes, &Mask::filled(512, 512, true));
        assert_eq!(cells.len(), CELLS_BLOB_LEN);
        // The gradient lies along x: its doubled and quadrupled angle are 0.
        assert!(cells.chunks_exact(4).all(|c| c[0] > 80 && c[1] == 0 && c[2] > 80 && c[3] == 0));
    }

    #[test]
    fn a_cell_without_pixels_is_missing() {
        let mut mask = Mask::filled(64, 32, true);
        (0..32).for_each(|y| (0..30).for_each(|x| mask.set(x, y, false)));
        let gray = Gray::from_values(64, 32, (0..64 * 32).map(|i| (i * 7 % 97) as f32).collect()).unwrap();
        let cells = describe_cells(&gray, &mask);
        assert_eq!(cells.len(), 4 * 2 * 4);
        assert!(cells[..8].iter().all(|&v| v == MISSING) && cells[8..16].iter().all(|&v| v != MISSING));
    }
}
