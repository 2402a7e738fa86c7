//! `CellMap`: the cells of a whole level in memory, in blocks on the level's own grid.

use super::cells::{CELLS, CELLS_BLOB_LEN, LEAST_VALID, MISSING};
use std::collections::HashMap;

/// The cells of a level, or merged cells. Positions count cells from the world's north-western corner.
#[derive(Debug, Clone, PartialEq)]
pub struct CellMap {
    pitch: usize,
    /// Columns and rows of the blocks, by row, then column.
    blocks: Vec<[i64; 2]>,
    index: HashMap<[i64; 2], usize>,
    cells: Vec<[u8; 4]>,
    energies: Vec<u8>,
    mean_energy: f32,
}

/// Number of cells of a block.
const BLOCK: usize = CELLS * CELLS;
/// The byte of a window for the value 0, and for an unknown cell.
pub const CELL_ZERO: u8 = 128;

/// A rectangle cut from a map, row by row.
#[derive(Debug, Clone)]
pub struct CellWindow {
    width: usize,
    /// Values plus [`CELL_ZERO`]; [`CELL_ZERO`] where a cell is unknown.
    pub cells: Vec<[u8; 4]>,
    /// [`cell_energy`] of each cell; 0 where a cell is unknown, and nowhere else.
    pub energies: Vec<u8>,
}

impl CellWindow {
    /// Makes a window of unknown cells.
    pub fn new(width: usize, height: usize) -> Self {
        let count = width * height;
        Self { width, cells: vec![[CELL_ZERO; 4]; count], energies: vec![0; count] }
    }
}

impl CellMap {
    /// Makes the map of a level from the column, row and blob of each tile, in any order. Blobs of another length are left
    /// out.
    pub fn from_tiles(mut tiles: Vec<([u32; 2], Vec<u8>)>) -> Self {
        tiles.retain(|(_, blob)| blob.len() == CELLS_BLOB_LEN);
        tiles.sort_by_key(|([column, row], _)| [*row, *column]);
        let blocks = tiles.iter().map(|&([column, row], _)| [i64::from(column), i64::from(row)]).collect();
        let bytes = tiles.iter().flat_map(|(_, blob)| blob.chunks_exact(4));
        let values = bytes.map(|b| [b[0] as i8, b[1] as i8, b[2] as i8, b[3] as i8]);
        Self::from_blocks(1, blocks, values)
    }

    fn from_blocks(pitch: usize, blocks: Vec<[i64; 2]>, values: impl Iterator<Item = [i8; 4]>) -> Self {
        let index = blocks.iter().enumerate().map(|(i, &block)| (block, i)).collect();
        let (mut cells, mut energies) =
            (Vec::with_capacity(blocks.len() * BLOCK), Vec::with_capacity(blocks.len() * BLOCK));
        for value in values {
            let is_known = value[0] != MISSING;
            cells.push(if is_known { value.map(|v| (v as u8).wrapping_add(CELL_ZERO)) } else { [CELL_ZERO; 4] });
            energies.push(if is_known { cell_energy(value) } else { 0 });
        }
        let total: u64 = energies.iter().map(|&e| u64::from(e)).sum();
        let known = energies.iter().filter(|&&e| e > 0).count();
        let mean_energy = total as f32 / known.max(1) as f32;
        Self { pitch, blocks, index, cells, energies, mean_energy }
    }

    /// The mean of [`cell_energy`] over all known cells.
    pub fn mean_energy(&self) -> f32 {
        self.mean_energy
    }

    /// Edge of a cell of this map, in cells of the level.
    pub fn pitch(&self) -> usize {
        self.pitch
    }

    /// Column and row of every block of 32 x 32 cells that has known cells.
    pub fn blocks(&self) -> &[[i64; 2]] {
        &self.blocks
    }

    /// Approximate memory use, bytes.
    pub fn bytes(&self) -> usize {
        self.cells.len() * size_of::<[u8; 4]>() + self.energies.len()
    }

    /// Fills a window whose first cell is (`left`, `top`).
    pub fn cut(&self, left: i64, top: i64, window: &mut CellWindow) {
        window.cells.fill([CELL_ZERO; 4]);
        window.energies.fill(0);
        let size = CELLS as i64;
        let (right, bottom) = (left + window.width as i64, top + (window.cells.len() / window.width.max(1)) as i64);
        for row in top.div_euclid(size)..=(bottom - 1).div_euclid(size) {
            for column in left.div_euclid(size)..=(right - 1).div_euclid(size) {
                let Some(&block) = self.index.get(&[column, row]) else { continue };
                let (from, to) = (left.max(column * size), right.min((column + 1) * size));
                let count = (to - from) as usize;
                for y in top.max(row * size)..bottom.min((row + 1) * size) {
                    let source = block * BLOCK + ((y - row * size) * size + from - column * size) as usize;
                    let target = (y - top) as usize * window.width + (from - left) as usize;
                    window.cells[target..][..count].copy_from_slice(&self.cells[source..][..count]);
                    window.energies[target..][..count].copy_from_slice(&self.energies[source..][..count]);
                }
            }
        }
    }

    /// The map with cells `pitch` times as wide, each smoothed up to the middles of its neighbours, so that an offset of half a
    /// cell costs little. `pitch` is 1, 2 or 3; the map itself has pitch 1.
    pub fn merged(&self, pitch: usize) -> Self {
        let kernel: &[f32] = match pitch {
            2 => &[0.125, 0.375, 0.375, 0.125],
            3 => &[1.0 / 9.0, 2.0 / 9.0, 3.0 / 9.0, 2.0 / 9.0, 1.0 / 9.0],
            _ => return self.clone(),
        };
        let mut blocks: Vec<[i64; 2]> = self.blocks.iter().flat_map(|b| covering(*b, pitch as i64)).collect();
        blocks.sort_by_key(|&[column, row]| [row, column]);
        blocks.dedup();
        let reach = (kernel.len() - pitch) / 2;
        let side = CELLS * pitch + 2 * reach;
        let mut window = CellWindow::new(side, side);
        let values: Vec<[i8; 4]> = blocks
            .iter()
            .flat_map(|&block| {
                let [left, top] = block.map(|b| b * (CELLS * pitch) as i64 - reach as i64);
                self.cut(left, top, &mut window);
                merged_block(&window, pitch, kernel)
            })
            .collect();
        Self::from_blocks(pitch, blocks, values.into_iter())
    }
}

/// The merged cells of a window; the window is as wide as the block and the kernel's reach.
fn merged_block(window: &CellWindow, pitch: usize, kernel: &[f32]) -> Vec<[i8; 4]> {
    let side = window.width;
    let value = |v: u8| f32::from(v) - f32::from(CELL_ZERO);
    let known = |(v, &e): (&[u8; 4], &u8)| {
        if e > 0 { [value(v[0]), value(v[1]), value(v[2]), value(v[3]), 1.0] } else { [0.0; 5] }
    };
    let fine: Vec<[f32; 5]> = window.cells.iter().zip(&window.energies).map(known).collect();
    let weighted_sum = |cells: &mut dyn Iterator<Item = [f32; 5]>| {
        cells.zip(kernel).fold([0f32; 5], |sum, (v, w)| std::array::from_fn(|i| sum[i] + w * v[i]))
    };
    let across: Vec<[f32; 5]> = (0..side * CELLS)
        .map(|i| {
            let (x, y) = (i % CELLS * pitch, i / CELLS);
            weighted_sum(&mut fine[y * side + x..][..kernel.len()].iter().copied())
        })
        .collect();
    let down = |x: usize, y: usize| weighted_sum(&mut (0..kernel.len()).map(|k| across[(y * pitch + k) * CELLS + x]));
    (0..BLOCK)
        .map(|i| {
            let [a, b, c, d, weight] = down(i % CELLS, i / CELLS);
            if weight < LEAST_VALID { [MISSING; 4] } else { [a, b, c, d].map(|v| (v / weight).round() as i8) }
        })
        .collect()
}

/// The energy of a cell: the sum of the squares of its values, in 64ths, from 1 to 255.
pub fn cell_energy(values: [i8; 4]) -> u8 {
    let sum: u32 = values.iter().map(|&v| i32::from(v).pow(2).unsigned_abs()).sum();
    (sum / 64).clamp(1, 255) as u8
}

/// The blocks of merged cells that a block contributes to.
fn covering(block: [i64; 2], pitch: i64) -> impl Iterator<Item = [i64; 2]> {
    let size = CELLS as i64;
    let span = move |b: i64| {
        let (first, last) = (b * size, (b + 1) * size - 1);
        first.div_euclid(pitch).div_euclid(size)..=last.div_euclid(pitch).div_euclid(size)
    };
    span(block[1]).flat_map(move |row| span(block[0]).map(move |column| [column, row]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(value: i8) -> Vec<u8> {
        vec![value as u8; CELLS_BLOB_LEN]
    }

    #[test]
    fn merges_across_tiles_and_keeps_all() {
        let map = CellMap::from_tiles(vec![([6, 9], tile(10)), ([5, 9], tile(10)), ([40, 2], tile(-7))]);
        for pitch in [2, 3] {
            let merged = map.merged(pitch);
            let scale = pitch as i64;
            let mut window = CellWindow::new(60 / pitch, 28 / pitch);
            merged.cut(5 * 32 / scale + 1, 9 * 32 / scale + 1, &mut window);
            assert!(window.cells.iter().all(|&v| v == [CELL_ZERO + 10; 4]));
            assert!(window.energies.iter().all(|&e| e == 6));
            merged.cut(41 * 32 / scale + 2, 2 * 32 / scale, &mut window);
            assert!(window.cells.iter().all(|&v| v == [CELL_ZERO; 4]) && window.energies.iter().all(|&e| e == 0));
        }
    }

    #[test]
    fn does_not_depend_on_the_order_of_tiles() {
        let (a, b) = (([3, 4], tile(1)), ([4, 4], tile(2)));
        assert_eq!(CellMap::from_tiles(vec![a.clone(), b.clone()]), CellMap::from_tiles(vec![b, a]));
    }
}
