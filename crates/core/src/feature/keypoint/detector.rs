//! Corners: local maxima of the structure tensor's smaller eigenvalue, spread over the image.
//!
//! There is no fixed threshold on contrast: smooth ground has corners too, only weaker ones (a floor far below sensor noise
//! keeps blank images empty). Each cell of a grid gives only its quota, so that one village does not take all keypoints.

use super::response::responses;
use crate::pixels::Gray;
use crate::simd::dispatch;

/// A corner of one octave.
#[derive(Debug, Clone, Copy)]
pub struct Corner {
    /// Pixels from the left edge.
    pub x_px: f32,
    /// Pixels from the upper edge.
    pub y_px: f32,
    /// Smaller eigenvalue.
    pub response: f32,
}

/// Radius of the non-maximum suppression.
const SUPPRESSION_PX: usize = 3;
/// Edge of the grid's cells.
const CELL_PX: usize = 48;
/// Smaller responses are rounding: (0.05 gray levels per pixel)^2.
const FLOOR: f32 = 0.0025;

/// The number of corners to find, and how evenly they are spread.
#[derive(Debug, Clone, Copy)]
pub struct CornerQuota {
    /// Most corners.
    pub limit: usize,
    /// Most corners of one cell of the grid, as a multiple of an even share.
    pub excess: usize,
}

/// Corners where `is_allowed(x, y)`, strongest first.
pub fn corners(gray: &Gray, quota: CornerQuota, is_allowed: impl Fn(usize, usize) -> bool) -> Vec<Corner> {
    let (width, height) = (gray.width_px(), gray.height_px());
    if width < 16 || height < 16 {
        return Vec::new();
    }
    let response = responses(gray);
    let cells = (width.div_ceil(CELL_PX), height.div_ceil(CELL_PX));
    let per_cell = (quota.limit * quota.excess).div_ceil(cells.0 * cells.1).max(1);
    let mut by_cell: Vec<Vec<(f32, u32)>> = vec![Vec::new(); cells.0 * cells.1];
    let margin = SUPPRESSION_PX + 1;
    let mut is_maximum = vec![0u8; width];
    for y in margin..height - margin {
        local_maxima(&response, width, y, &mut is_maximum);
        for x in margin..width - margin {
            if is_maximum[x] != 0 && is_allowed(x, y) && is_peak(&response, width, x, y) {
                by_cell[y / CELL_PX * cells.0 + x / CELL_PX].push((response[y * width + x], (y * width + x) as u32));
            }
        }
    }
    // Sorting is stable: of equals the first in reading order comes first.
    let strongest_first = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0);
    let mut kept = Vec::new();
    for cell in &mut by_cell {
        cell.sort_by(strongest_first);
        kept.extend(cell.iter().take(per_cell));
    }
    kept.sort_by(strongest_first);
    kept.truncate(quota.limit);
    kept.iter().map(|&(_, i)| refined(&response, width, i as usize % width, i as usize / width)).collect()
}

dispatch! {
    /// Marks the pixels of row y that are above the floor and no lower than their eight neighbours: most are not.
    fn local_maxima(response: &[f32], width: usize, y: usize, is_maximum: &mut [u8]) {
        let row = |y: usize| &response[y * width..(y + 1) * width];
        let (above, here, below) = (row(y - 1), row(y), row(y + 1));
        let greater = |a: f32, b: f32| if a > b { a } else { b };
        let is_maximum = &mut is_maximum[..width];
        for x in 1..width - 1 {
            let column = |x: usize| greater(above[x], below[x]);
            let beside = greater(greater(here[x - 1], here[x + 1]), greater(column(x - 1), column(x + 1)));
            let highest = greater(beside, column(x));
            is_maximum[x] = u8::from(here[x] > FLOOR) & u8::from(here[x] >= highest);
        }
    }
}

/// Whether a pixel is the strongest within the suppression radius.
fn is_peak(response: &[f32], width: usize, x: usize, y: usize) -> bool {
    let value = response[y * width + x];
    for j in y - SUPPRESSION_PX..=y + SUPPRESSION_PX {
        for i in x - SUPPRESSION_PX..=x + SUPPRESSION_PX {
            let other = response[j * width + i];
            // Of equals only the first in reading order is a peak.
            if other > value || (other == value && (j, i) < (y, x)) {
                return false;
            }
        }
    }
    true
}

/// The corner at the vertices of the parabolas through the response along both axes.
fn refined(response: &[f32], width: usize, x: usize, y: usize) -> Corner {
    let at = |i: usize, j: usize| response[j * width + i];
    let vertex = |before: f32, here: f32, after: f32| {
        let bend = before - 2.0 * here + after;
        if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
    };
    let here = at(x, y);
    Corner {
        x_px: x as f32 + 0.5 + vertex(at(x - 1, y), here, at(x + 1, y)),
        y_px: y as f32 + 0.5 + vertex(at(x, y - 1), here, at(x, y + 1)),
        response: here,
    }
}
