//! `Relief`: the greatest height near a point, which limits where rays and shadows must look.

use crate::canvas::{PIXELS_PER_M, SceneCanvas};

const BLOCK_PX: usize = 32;

/// The greatest height within a distance of every block of the canvas.
pub struct Relief {
    columns: usize,
    tallest_m: Vec<f32>,
}

impl Relief {
    /// Computes the relief of a canvas, for distances up to `reach_m`.
    pub fn new(canvas: &SceneCanvas, reach_m: f64) -> Self {
        let (columns, rows) = (canvas.width.div_ceil(BLOCK_PX), canvas.height.div_ceil(BLOCK_PX));
        let mut own = vec![0f32; columns * rows];
        for (row, line) in canvas.heights_m.chunks_exact(canvas.width).enumerate() {
            for (column, &height) in line.iter().enumerate() {
                let block = &mut own[row / BLOCK_PX * columns + column / BLOCK_PX];
                *block = block.max(height);
            }
        }
        let reach = (reach_m * PIXELS_PER_M / BLOCK_PX as f64).ceil() as usize;
        let around = |i: usize| {
            let (x, y) = (i % columns, i / columns);
            let rows = y.saturating_sub(reach)..(y + reach + 1).min(rows);
            rows.flat_map(|j| &own[j * columns + x.saturating_sub(reach)..j * columns + (x + reach + 1).min(columns)])
                .fold(0f32, |a, b| a.max(*b))
        };
        Self { columns, tallest_m: (0..columns * rows).map(around).collect() }
    }

    /// The greatest height around a pixel, which may lie outside the canvas.
    pub fn tallest_m(&self, column: isize, row: isize) -> f32 {
        let block = |v: isize, n: usize| (v / BLOCK_PX as isize).clamp(0, n as isize - 1) as usize;
        self.tallest_m[block(row, self.tallest_m.len() / self.columns) * self.columns + block(column, self.columns)]
    }
}
