//! Corners: local maxima of the structure tensor's smaller eigenvalue, spread over the image.
//!
//! No fixed threshold on contrast: smooth ground has corners too, only weaker ones (a floor far below sensor noise
//! keeps blank images empty). Each cell of a grid may give only its share, so that one village does not take all.

use crate::pixels::{Gray, Mask};

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

/// Half the window over which the tensor is summed.
const WINDOW_RADIUS_PX: usize = 2;
/// A corner is the strongest within this distance.
const SUPPRESSION_PX: usize = 3;
const CELL_PX: usize = 48;
/// A cell may give this multiple of its fair share.
const CELL_EXCESS: usize = 3;
/// Responses below are numerical dust: (0.05 gray levels per pixel)^2.
const FLOOR: f32 = 0.0025;

/// At most `limit` corners where `mask` is valid, strongest first.
pub fn corners(gray: &Gray, mask: &Mask, limit: usize) -> Vec<Corner> {
    let (width, height) = (gray.width_px(), gray.height_px());
    if width < 16 || height < 16 {
        return Vec::new();
    }
    let response = responses(gray);
    let cells = (width.div_ceil(CELL_PX), height.div_ceil(CELL_PX));
    let quota = (limit * CELL_EXCESS).div_ceil(cells.0 * cells.1).max(1);
    let mut by_cell: Vec<Vec<Corner>> = vec![Vec::new(); cells.0 * cells.1];
    let margin = SUPPRESSION_PX + 1;
    for y in margin..height - margin {
        for x in margin..width - margin {
            let i = y * width + x;
            let value = response[i];
            // Most pixels have a higher neighbour right beside them.
            let nearest = response[i - 1].max(response[i + 1]).max(response[i - width]).max(response[i + width]);
            if value > FLOOR && value >= nearest && mask.at(x, y) && is_peak(&response, width, x, y) {
                by_cell[y / CELL_PX * cells.0 + x / CELL_PX].push(refined(&response, width, x, y));
            }
        }
    }
    let strongest_first = |a: &Corner, b: &Corner| b.response.total_cmp(&a.response);
    let mut kept = Vec::new();
    for cell in &mut by_cell {
        cell.sort_by(strongest_first);
        kept.extend(cell.iter().take(quota));
    }
    kept.sort_by(strongest_first);
    kept.truncate(limit);
    kept
}

fn is_peak(response: &[f32], width: usize, x: usize, y: usize) -> bool {
    let value = response[y * width + x];
    for j in y - SUPPRESSION_PX..=y + SUPPRESSION_PX {
        for i in x - SUPPRESSION_PX..=x + SUPPRESSION_PX {
            let other = response[j * width + i];
            // Of equals the first in reading order wins.
            if other > value || (other == value && (j, i) < (y, x)) {
                return false;
            }
        }
    }
    true
}

/// The peak of the parabolas through the response along both axes.
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

fn responses(gray: &Gray) -> Vec<f32> {
    let (width, height) = (gray.width_px(), gray.height_px());
    let mut tensor: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0f32; width * height]);
    for y in 1..height - 1 {
        let (a, b, c) = (gray.row(y - 1), gray.row(y), gray.row(y + 1));
        for x in 1..width - 1 {
            let gx = (a[x + 1] - a[x - 1] + 2.0 * (b[x + 1] - b[x - 1]) + c[x + 1] - c[x - 1]) * 0.125;
            let gy = (c[x - 1] - a[x - 1] + 2.0 * (c[x] - a[x]) + c[x + 1] - a[x + 1]) * 0.125;
            let i = y * width + x;
            (tensor[0][i], tensor[1][i], tensor[2][i]) = (gx * gx, gx * gy, gy * gy);
        }
    }
    for plane in &mut tensor {
        box_mean(plane, width, height, WINDOW_RADIUS_PX);
    }
    let [xx, xy, yy] = &tensor;
    (0..width * height)
        .map(|i| {
            let half_trace = 0.5 * (xx[i] + yy[i]);
            let half_gap = 0.5 * (xx[i] - yy[i]);
            half_trace - (half_gap * half_gap + xy[i] * xy[i]).sqrt()
        })
        .collect()
}

/// Mean over a square window, in place; zero within `radius` of the edge.
fn box_mean(plane: &mut [f32], width: usize, height: usize, radius: usize) {
    let size = 2 * radius + 1;
    let mut rows = vec![0f32; width * height];
    for y in 0..height {
        let line = &plane[y * width..(y + 1) * width];
        for (out, window) in rows[y * width + radius..].iter_mut().zip(line.windows(size)) {
            *out = window.iter().sum();
        }
    }
    let norm = 1.0 / (size * size) as f32;
    plane.fill(0.0);
    for y in radius..height - radius {
        for j in y - radius..=y + radius {
            let source = &rows[j * width..(j + 1) * width];
            for (out, value) in plane[y * width..(y + 1) * width].iter_mut().zip(source) {
                *out += value * norm;
            }
        }
    }
}
