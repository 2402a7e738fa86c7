//! `SurfaceMaximum`: the maximum of the correlation surfaces of one block over all hypotheses.

use super::area::SearchArea;
use super::coarse_peaks::{CoarsePeak, MAX_PEAKS, SurfaceSums, strongest_first};
use super::hypotheses::Hypothesis;
use super::pixel_window::PixelWindow;
use overfly_core::registration::coarse::Surface;
use overfly_core::tile::WorldPixel;

/// The largest T at every place of a block over all hypotheses, and which hypothesis gave it.
pub struct SurfaceMaximum<'a> {
    block: &'a PixelWindow,
    /// Whether each place belongs to the area.
    is_inside: Vec<bool>,
    values: Vec<f32>,
    indices: Vec<u32>,
}

impl<'a> SurfaceMaximum<'a> {
    /// Returns the maximum over no hypothesis yet, for the places of a block that belong to an area.
    pub fn new(block: &'a PixelWindow, area: &SearchArea) -> Self {
        let places = (0..block.height_px as i64).flat_map(|y| (0..block.width_px as i64).map(move |x| (x, y)));
        let is_inside: Vec<bool> = places.map(|(x, y)| area.contains_pixel(block.left + x, block.top + y)).collect();
        let count = is_inside.len();
        Self { block, is_inside, values: vec![f32::NEG_INFINITY; count], indices: vec![0; count] }
    }

    /// Takes the surface of the hypothesis `index` into the maximum and into the sums.
    pub fn add(&mut self, surface: &Surface, index: usize, sums: &mut SurfaceSums) {
        let width = self.block.width_px;
        for (row, surface) in surface.values.chunks_exact(width).enumerate().take(self.block.height_px) {
            let span = row * width..(row + 1) * width;
            let (is_inside, best) = (&self.is_inside[span.clone()], &mut self.values[span.clone()]);
            let indices = &mut self.indices[span];
            let (mut sum, mut squares, mut count) = (0f32, 0f32, 0u32);
            for x in 0..width {
                let counts = is_inside[x] && surface[x] != 0.0;
                let value = if counts { surface[x] } else { 0.0 };
                sum += value;
                squares += value * value;
                count += u32::from(counts);
                let is_better = counts && value > best[x];
                best[x] = if is_better { value } else { best[x] };
                indices[x] = if is_better { index as u32 } else { indices[x] };
            }
            sums.sum += f64::from(sum);
            sums.sum_squares += f64::from(squares);
            sums.count += f64::from(count);
        }
    }

    /// The strongest local maxima, at whole pixels: refinement measures the fraction.
    pub fn peaks(&self, hypotheses: &[Hypothesis]) -> Vec<CoarsePeak> {
        let (width, height) = (self.block.width_px, self.block.height_px);
        let is_peak = |x: usize, y: usize| {
            let value = self.values[y * width + x];
            let neighbours = (y.saturating_sub(1)..(y + 2).min(height))
                .flat_map(|j| (x.saturating_sub(1)..(x + 2).min(width)).map(move |i| (i, j)));
            value > 0.0 && neighbours.into_iter().all(|(i, j)| self.values[j * width + i] <= value)
        };
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let mut peaks: Vec<CoarsePeak> =
            places.filter(|&(x, y)| is_peak(x, y)).map(|at| self.peak(at, hypotheses)).collect();
        strongest_first(&mut peaks);
        peaks.truncate(MAX_PEAKS * 4);
        peaks
    }

    fn peak(&self, (x, y): (usize, usize), hypotheses: &[Hypothesis]) -> CoarsePeak {
        let i = y * self.block.width_px + x;
        let nadir = WorldPixel { x_px: (self.block.left + x as i64) as f64, y_px: (self.block.top + y as i64) as f64 };
        let pose = hypotheses[self.indices[i] as usize].pose(nadir, self.block.zoom);
        CoarsePeak { pose, statistic: f64::from(self.values[i]) }
    }
}
