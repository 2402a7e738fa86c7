//! `Cells`: a world as square cells, each with a colour, the height of its top and what it belongs to.

use super::objects::SceneObject;
use super::sample::Sample;
use rayon::prelude::*;

/// Cells on a side of a block, for which the highest top is kept.
pub const BLOCK: usize = 16;
/// Rows that are painted at a time.
const BAND_ROWS: usize = 64;

/// A world as cells, row by row from the north: 10 bytes a cell.
pub struct Cells {
    /// Columns.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Side of a cell, metres.
    pub cell_m: f64,
    /// Heights of the tops, metres.
    pub tops_m: Vec<f32>,
    /// Colours; after [`super::Sun::light`] with light and shadow.
    pub colours: Vec<[u8; 3]>,
    /// What a cell belongs to.
    pub kinds: Vec<u16>,
    /// How far above its top a cell's shadow reaches, quarters of a metre; 0 in the sun.
    pub shades: Vec<u8>,
    /// Highest top of each block of [`BLOCK`] x [`BLOCK`] cells.
    pub block_tops_m: Vec<f32>,
    /// The highest top of all.
    pub highest_m: f32,
}

impl Cells {
    /// Paints what `ground` says of the middle of each cell, and the objects where they rise above it.
    pub fn paint(
        size_m: [f64; 2],
        cell_m: f64,
        ground: impl Fn(f64, f64) -> Sample + Sync,
        objects: &[SceneObject],
    ) -> Self {
        let [columns, rows] = size_m.map(|size| (size / cell_m).round() as usize);
        let mut tops_m = vec![0f32; columns * rows];
        let mut colours = vec![[0u8; 3]; columns * rows];
        let mut kinds = vec![0u16; columns * rows];
        let mut bands = vec![Vec::new(); rows.div_ceil(BAND_ROWS)];
        for (i, object) in objects.iter().enumerate() {
            let ([_, y], reach_m) = object.reach();
            let band = |y: f64| ((y / cell_m).max(0.0) as usize / BAND_ROWS).min(bands.len() - 1);
            (band(y - reach_m)..=band(y + reach_m)).for_each(|b| bands[b].push(i));
        }
        let chunk = BAND_ROWS * columns;
        let planes = tops_m.par_chunks_mut(chunk).zip(colours.par_chunks_mut(chunk)).zip(kinds.par_chunks_mut(chunk));
        planes.zip(&bands).enumerate().for_each(|(number, (((tops_m, colours), kinds), drawn))| {
            let mut band = Band { first_row: number * BAND_ROWS, columns, cell_m, tops_m, colours, kinds };
            band.fill(&ground);
            drawn.iter().for_each(|&i| band.draw(&objects[i]));
        });
        let shades = vec![0; columns * rows];
        let mut cells =
            Self { columns, rows, cell_m, tops_m, colours, kinds, shades, block_tops_m: Vec::new(), highest_m: 0.0 };
        cells.measure_blocks();
        cells
    }

    fn measure_blocks(&mut self) {
        let across = self.columns.div_ceil(BLOCK);
        self.block_tops_m = vec![f32::MIN; across * self.rows.div_ceil(BLOCK)];
        for (row, line) in self.tops_m.chunks_exact(self.columns).enumerate() {
            for (column, &top_m) in line.iter().enumerate() {
                let block = &mut self.block_tops_m[row / BLOCK * across + column / BLOCK];
                *block = block.max(top_m);
            }
        }
        self.highest_m = self.block_tops_m.iter().copied().fold(f32::MIN, f32::max);
    }

    /// The cell with a column and row; beyond the edge that of the edge.
    pub fn index(&self, column: i64, row: i64) -> usize {
        let clamp = |v: i64, n: usize| v.clamp(0, n as i64 - 1) as usize;
        clamp(row, self.rows) * self.columns + clamp(column, self.columns)
    }
}

/// Consecutive rows while they are painted.
struct Band<'a> {
    first_row: usize,
    columns: usize,
    cell_m: f64,
    tops_m: &'a mut [f32],
    colours: &'a mut [[u8; 3]],
    kinds: &'a mut [u16],
}

impl Band<'_> {
    fn fill(&mut self, ground: &(impl Fn(f64, f64) -> Sample + Sync)) {
        for i in 0..self.tops_m.len() {
            let (column, row) = (i % self.columns, i / self.columns + self.first_row);
            self.put(i, ground((column as f64 + 0.5) * self.cell_m, (row as f64 + 0.5) * self.cell_m));
        }
    }

    fn draw(&mut self, object: &SceneObject) {
        let (centre, reach_m) = object.reach();
        let last_row = self.first_row + self.tops_m.len() / self.columns;
        let cell_m = self.cell_m;
        let range = |c: f64, from: usize, to: usize| {
            let cell = |v: f64| ((v / cell_m).max(0.0) as usize).clamp(from, to);
            cell(c - reach_m)..cell(c + reach_m + cell_m)
        };
        for row in range(centre[1], self.first_row, last_row) {
            for column in range(centre[0], 0, self.columns) {
                let drawn = object.at((column as f64 + 0.5) * self.cell_m, (row as f64 + 0.5) * self.cell_m);
                let i = (row - self.first_row) * self.columns + column;
                if let Some(sample) = drawn.filter(|s| s.top_m > self.tops_m[i]) {
                    self.put(i, sample);
                }
            }
        }
    }

    fn put(&mut self, i: usize, sample: Sample) {
        self.tops_m[i] = sample.top_m;
        self.colours[i] = sample.colour.map(|v| v.clamp(0.0, 255.0) as u8);
        self.kinds[i] = sample.kind;
    }
}
