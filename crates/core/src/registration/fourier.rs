//! Two-dimensional complex FFTs on planes of one size, plans and scratch reused.

use rustfft::{Fft, FftPlanner, num_complex::Complex32};
use std::ops::Range;
use std::sync::Arc;

/// Plans for the FFTs of planes of one size; cheap to clone.
#[derive(Clone)]
pub struct Plans {
    width: usize,
    height: usize,
    along_x: [Arc<dyn Fft<f32>>; 2],
    along_y: [Arc<dyn Fft<f32>>; 2],
}

/// FFTs of planes of `width` x `height`, with scratch. A spectrum is kept transposed: shape (width, height), row by row.
pub struct Fourier {
    plans: Plans,
    transposed: Vec<Complex32>,
    scratch: Vec<Complex32>,
    spare: Vec<Vec<Complex32>>,
}

/// The smallest number of the form 2^a 3^b 5^c that is at least `n`: such lengths transform quickly.
pub fn quick_length(n: usize) -> usize {
    let is_smooth = |mut m: usize| {
        for p in [2, 3, 5] {
            while m.is_multiple_of(p) {
                m /= p;
            }
        }
        m == 1
    };
    (n.max(1)..).find(|&m| is_smooth(m)).expect("powers of two never end")
}

impl Plans {
    /// Makes the plans for one size.
    pub fn new(width: usize, height: usize) -> Self {
        let mut planner = FftPlanner::new();
        let along_x = [planner.plan_fft_forward(width), planner.plan_fft_inverse(width)];
        let along_y = [planner.plan_fft_forward(height), planner.plan_fft_inverse(height)];
        Self { width, height, along_x, along_y }
    }
}

impl Fourier {
    /// Makes the scratch for one thread.
    pub fn new(plans: &Plans) -> Self {
        let each = plans.along_x.iter().chain(&plans.along_y);
        let scratch_len = each.map(|p| p.get_inplace_scratch_len()).max().unwrap_or(0);
        let zero = Complex32::new(0.0, 0.0);
        Self {
            plans: plans.clone(),
            transposed: vec![zero; plans.width * plans.height],
            scratch: vec![zero; scratch_len],
            spare: Vec::new(),
        }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.plans.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.plans.height
    }

    /// A plane to work in, with arbitrary content.
    pub fn plane(&mut self) -> Vec<Complex32> {
        self.spare.pop().unwrap_or_else(|| vec![Complex32::new(0.0, 0.0); self.width() * self.height()])
    }

    /// Takes a plane back for the next [`Fourier::plane`].
    pub fn give_back(&mut self, plane: Vec<Complex32>) {
        self.spare.push(plane);
    }

    /// Transforms a plane, shape (height, width), to a spectrum, shape (width, height), not normalised. Rows outside `rows`
    /// count as zero, whatever their content.
    pub fn forward(&mut self, plane: &mut Vec<Complex32>, rows: Range<usize>) {
        let (width, height) = (self.width(), self.height());
        let filled = &mut plane[rows.start * width..rows.end * width];
        self.plans.along_x[0].process_with_scratch(filled, &mut self.scratch);
        for column in self.transposed.chunks_exact_mut(height) {
            column[..rows.start].fill(Complex32::new(0.0, 0.0));
            column[rows.end..].fill(Complex32::new(0.0, 0.0));
        }
        transpose(filled, width, [width, rows.len()], &mut self.transposed[rows.start..], height);
        std::mem::swap(plane, &mut self.transposed);
        self.plans.along_y[0].process_with_scratch(plane, &mut self.scratch);
    }

    /// Transforms a spectrum, shape (width, height), to the first `rows` rows of a plane, shape (height, width), multiplied
    /// by width x height. The other rows have arbitrary content.
    pub fn inverse(&mut self, spectrum: &mut Vec<Complex32>, rows: usize) {
        let (width, height) = (self.width(), self.height());
        self.plans.along_y[1].process_with_scratch(spectrum, &mut self.scratch);
        transpose(spectrum, height, [rows, width], &mut self.transposed, width);
        std::mem::swap(spectrum, &mut self.transposed);
        self.plans.along_x[1].process_with_scratch(&mut spectrum[..rows * width], &mut self.scratch);
    }
}

/// Writes the first `columns` columns of `rows` rows, each `width` long, as rows that lie `stride` apart; in blocks that
/// stay in cache.
fn transpose(source: &[Complex32], width: usize, [columns, rows]: [usize; 2], target: &mut [Complex32], stride: usize) {
    const BLOCK: usize = 16;
    for y0 in (0..rows).step_by(BLOCK) {
        for x0 in (0..columns).step_by(BLOCK) {
            for y in y0..(y0 + BLOCK).min(rows) {
                for x in x0..(x0 + BLOCK).min(columns) {
                    target[x * stride + y] = source[y * width + x];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_gives_the_plane_times_the_size() {
        let (w, h) = (12, 10);
        let plane: Vec<_> = (0..w * h).map(|i| Complex32::new((i * 7 % 13) as f32, (i * 5 % 11) as f32)).collect();
        let mut data = plane.clone();
        let mut fourier = Fourier::new(&Plans::new(w, h));
        fourier.forward(&mut data, 0..h);
        fourier.inverse(&mut data, h);
        let n = (w * h) as f32;
        assert!(plane.iter().zip(&data).all(|(a, b)| (a * n - b).norm() < 1e-2));
    }

    #[test]
    fn quick_lengths_have_small_factors() {
        assert_eq!([quick_length(0), quick_length(7), quick_length(97), quick_length(128)], [1, 8, 100, 128]);
    }

    #[test]
    fn empty_rows_and_rows_not_asked_for_are_left_out() {
        let (w, h) = (9, 8);
        let mut full = vec![Complex32::new(0.0, 0.0); w * h];
        (2 * w..5 * w).for_each(|i| full[i] = Complex32::new((i * 7 % 13) as f32, (i * 5 % 11) as f32));
        let mut part: Vec<_> =
            full.iter().map(|c| if c.norm() == 0.0 { Complex32::new(9.0, 9.0) } else { *c }).collect();
        (2 * w..5 * w).for_each(|i| part[i] = full[i]);
        let mut fourier = Fourier::new(&Plans::new(w, h));
        fourier.forward(&mut full, 0..h);
        fourier.forward(&mut part, 2..5);
        assert!(full.iter().zip(&part).all(|(a, b)| (a - b).norm() < 1e-3));
        fourier.inverse(&mut full, h);
        fourier.inverse(&mut part, 4);
        assert!(full[..4 * w].iter().zip(&part[..4 * w]).all(|(a, b)| (a - b).norm() < 1e-2));
    }
}
