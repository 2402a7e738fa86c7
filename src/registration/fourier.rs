//! Two-dimensional complex FFTs on planes of one size, plans and scratch reused.

use rustfft::{Fft, FftPlanner, num_complex::Complex32};
use std::sync::Arc;

/// FFTs of planes of `width` x `height`. A spectrum is kept transposed: shape (width, height), row by row.
pub struct Fourier {
    width: usize,
    height: usize,
    along_x: [Arc<dyn Fft<f32>>; 2],
    along_y: [Arc<dyn Fft<f32>>; 2],
    transposed: Vec<Complex32>,
    scratch: Vec<Complex32>,
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

impl Fourier {
    /// Plans for one size.
    pub fn new(width: usize, height: usize) -> Self {
        let mut planner = FftPlanner::new();
        let along_x = [planner.plan_fft_forward(width), planner.plan_fft_inverse(width)];
        let along_y = [planner.plan_fft_forward(height), planner.plan_fft_inverse(height)];
        let scratch_len = along_x.iter().chain(&along_y).map(|p| p.get_inplace_scratch_len()).max().unwrap_or(0);
        let zero = Complex32::new(0.0, 0.0);
        Self {
            width,
            height,
            along_x,
            along_y,
            transposed: vec![zero; width * height],
            scratch: vec![zero; scratch_len],
        }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Plane, shape (height, width), to spectrum, shape (width, height); not normalised.
    pub fn forward(&mut self, plane: &mut Vec<Complex32>) {
        self.along_x[0].process_with_scratch(plane, &mut self.scratch);
        transpose(plane, &mut self.transposed, self.width, self.height);
        std::mem::swap(plane, &mut self.transposed);
        self.along_y[0].process_with_scratch(plane, &mut self.scratch);
    }

    /// Spectrum, shape (width, height), to plane, shape (height, width); multiplied by width x height.
    pub fn inverse(&mut self, spectrum: &mut Vec<Complex32>) {
        self.along_y[1].process_with_scratch(spectrum, &mut self.scratch);
        transpose(spectrum, &mut self.transposed, self.height, self.width);
        std::mem::swap(spectrum, &mut self.transposed);
        self.along_x[1].process_with_scratch(spectrum, &mut self.scratch);
    }
}

/// Shape (height, width) to shape (width, height), in blocks that stay in cache.
fn transpose(source: &[Complex32], target: &mut [Complex32], width: usize, height: usize) {
    const BLOCK: usize = 16;
    for y0 in (0..height).step_by(BLOCK) {
        for x0 in (0..width).step_by(BLOCK) {
            for y in y0..(y0 + BLOCK).min(height) {
                for x in x0..(x0 + BLOCK).min(width) {
                    target[x * height + y] = source[y * width + x];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comes_back_times_the_size() {
        let (w, h) = (12, 10);
        let plane: Vec<_> = (0..w * h).map(|i| Complex32::new((i * 7 % 13) as f32, (i * 5 % 11) as f32)).collect();
        let mut data = plane.clone();
        let mut fourier = Fourier::new(w, h);
        fourier.forward(&mut data);
        fourier.inverse(&mut data);
        let n = (w * h) as f32;
        assert!(plane.iter().zip(&data).all(|(a, b)| (a * n - b).norm() < 1e-2));
    }

    #[test]
    fn quick_lengths_have_small_factors() {
        assert_eq!([quick_length(0), quick_length(7), quick_length(97), quick_length(128)], [1, 8, 100, 128]);
    }
}
