//! `CellMap`: the cells of a whole level, resident, in blocks on the level's own grid.

use super::cells::{CELLS, CELLS_BLOB_LEN, LEAST_VALID, MISSING};
use std::collections::HashMap;

/// The cells of a level or merged ones. Positions count cells from the world's north-western corner.
#[derive(Debug, Clone, PartialEq)]
pub struct CellMap {
    pitch: usize,
    /// Columns and rows of the blocks, by row, then column.
    blocks: Vec<[i64; 2]>,
    index: HashMap<[i64; 2], usize>,
    values: Vec<[i8; 4]>,
    mean_energy: f32,
}

/// Cells of a block.
const BLOCK: usize = CELLS * CELLS;

impl CellMap {
    /// Of a level's tiles: column, row and blob of each, in any order; blobs of another length are left out.
    pub fn of_tiles(mut tiles: Vec<([u32; 2], Vec<u8>)>) -> Self {
        tiles.retain(|(_, blob)| blob.len() == CELLS_BLOB_LEN);
        tiles.sort_by_key(|([column, row], _)| [*row, *column]);
        let blocks = tiles.iter().map(|&([column, row], _)| [i64::from(column), i64::from(row)]).collect();
        let bytes = tiles.iter().flat_map(|(_, blob)| blob.chunks_exact(4));
        let values = bytes.map(|b| [b[0] as i8, b[1] as i8, b[2] as i8, b[3] as i8]).collect();
        Self::from_blocks(1, blocks, values)
    }

    fn from_blocks(pitch: usize, blocks: Vec<[i64; 2]>, values: Vec<[i8; 4]>) -> Self {
        let index = blocks.iter().enumerate().map(|(i, &block)| (block, i)).collect();
        let known = || values.iter().filter(|v| v[0] != MISSING);
        let total: u64 = known().map(|v| u64::from(cell_energy(*v))).sum();
        let mean_energy = total as f32 / known().count().max(1) as f32;
        Self { pitch, blocks, index, values, mean_energy }
    }

    /// Mean of [`cell_energy`] over all known cells.
    pub fn mean_energy(&self) -> f32 {
        self.mean_energy
    }

    /// Cells of the level that a cell of this map spans.
    pub fn pitch(&self) -> usize {
        self.pitch
    }

    /// Column and row of every block of 32 x 32 cells that holds any.
    pub fn blocks(&self) -> &[[i64; 2]] {
        &self.blocks
    }

    /// Memory held, bytes, about.
    pub fn bytes(&self) -> usize {
        self.values.len() * size_of::<[i8; 4]>()
    }

    /// Calls `found` for each cell of a window that is known, with its position in the window.
    pub fn for_each_in(
        &self,
        left: i64,
        top: i64,
        width: usize,
        height: usize,
        mut found: impl FnMut(usize, usize, [i8; 4]),
    ) {
        let size = CELLS as i64;
        let (right, bottom) = (left + width as i64, top + height as i64);
        for row in top.div_euclid(size)..=(bottom - 1).div_euclid(size) {
            for column in left.div_euclid(size)..=(right - 1).div_euclid(size) {
                let Some(&block) = self.index.get(&[column, row]) else { continue };
                let values = &self.values[block * BLOCK..(block + 1) * BLOCK];
                for y in top.max(row * size)..bottom.min((row + 1) * size) {
                    for x in left.max(column * size)..right.min((column + 1) * size) {
                        let value = values[((y - row * size) * size + x - column * size) as usize];
                        if value[0] != MISSING {
                            found((x - left) as usize, (y - top) as usize, value);
                        }
                    }
                }
            }
        }
    }

    /// The map with cells `pitch` times as wide, each smoothed as far as its neighbours' middles, so that half a cell's
    /// offset costs little. `pitch` is 1, 2 or 3, of a map of pitch 1.
    pub fn merged(&self, pitch: usize) -> Self {
        let kernel: &[f32] = match pitch {
            2 => &[0.125, 0.375, 0.375, 0.125],
            3 => &[1.0 / 9.0, 2.0 / 9.0, 3.0 / 9.0, 2.0 / 9.0, 1.0 / 9.0],
            _ => return self.clone(),
        };
        let mut blocks: Vec<[i64; 2]> = self.blocks.iter().flat_map(|b| covering(*b, pitch as i64)).collect();
        blocks.sort_by_key(|&[column, row]| [row, column]);
        blocks.dedup();
        let values = blocks.iter().flat_map(|&block| self.merged_block(block, pitch, kernel)).collect();
        Self::from_blocks(pitch, blocks, values)
    }

    fn merged_block(&self, block: [i64; 2], pitch: usize, kernel: &[f32]) -> Vec<[i8; 4]> {
        let reach = (kernel.len() - pitch) / 2;
        let side = CELLS * pitch + 2 * reach;
        let mut fine = vec![[0f32; 5]; side * side];
        let corner = block.map(|b| b * (CELLS * pitch) as i64 - reach as i64);
        self.for_each_in(corner[0], corner[1], side, side, |x, y, v| {
            fine[y * side + x] = [f32::from(v[0]), f32::from(v[1]), f32::from(v[2]), f32::from(v[3]), 1.0];
        });
        let weigh = |cells: &mut dyn Iterator<Item = [f32; 5]>| {
            cells.zip(kernel).fold([0f32; 5], |sum, (v, w)| std::array::from_fn(|i| sum[i] + w * v[i]))
        };
        let across: Vec<[f32; 5]> = (0..side * CELLS)
            .map(|i| {
                let (x, y) = (i % CELLS * pitch, i / CELLS);
                weigh(&mut fine[y * side + x..][..kernel.len()].iter().copied())
            })
            .collect();
        let down = |x: usize, y: usize| weigh(&mut (0..kernel.len()).map(|k| across[(y * pitch + k) * CELLS + x]));
        (0..BLOCK)
            .map(|i| {
                let [a, b, c, d, weight] = down(i % CELLS, i / CELLS);
                if weight < LEAST_VALID { [MISSING; 4] } else { [a, b, c, d].map(|v| (v / weight).round() as i8) }
            })
            .collect()
    }
}

/// How much a cell says: the sum of its values' squares, in 64ths, at most 255.
pub fn cell_energy(values: [i8; 4]) -> u8 {
    let sum: u32 = values.iter().map(|&v| i32::from(v).pow(2).unsigned_abs()).sum();
    (sum / 64).min(255) as u8
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
    fn merges_across_tiles_and_forgets_nothing() {
        let map = CellMap::of_tiles(vec![([6, 9], tile(10)), ([5, 9], tile(10)), ([40, 2], tile(-7))]);
        for pitch in [2, 3] {
            let merged = map.merged(pitch);
            let mut seen = 0;
            let scale = pitch as i64;
            let left = 5 * 32 / scale + 1;
            merged.for_each_in(left, 9 * 32 / scale + 1, 60 / pitch, 28 / pitch, |_, _, v| {
                seen += 1;
                assert_eq!(v, [10; 4]);
            });
            assert_eq!(seen, (60 / pitch) * (28 / pitch));
            merged.for_each_in(41 * 32 / scale + 2, 2 * 32 / scale, 9, 9, |_, _, _| panic!("there is nothing"));
        }
    }

    #[test]
    fn does_not_depend_on_the_order_of_tiles() {
        let (a, b) = (([3, 4], tile(1)), ([4, 4], tile(2)));
        assert_eq!(CellMap::of_tiles(vec![a.clone(), b.clone()]), CellMap::of_tiles(vec![b, a]));
    }
}
