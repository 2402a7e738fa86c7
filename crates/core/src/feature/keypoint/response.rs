//! The corner response: the smaller eigenvalue of the structure tensor, summed over 5 x 5 pixels.
//!
//! One pass from top to bottom, with five rows of the tensor in memory.

use crate::pixels::Gray;
use crate::simd::dispatch;

/// Radius of the window over which the tensor is summed.
const WINDOW_RADIUS_PX: usize = 2;
const WINDOW_PX: usize = 2 * WINDOW_RADIUS_PX + 1;

dispatch! {
    /// The response of every pixel, (gray levels per pixel)^2, row by row; zero within two pixels of the edge.
    pub fn responses(gray: &Gray) -> Vec<f32> {
        responses_plain(gray)
    }
}

#[inline(always)]
fn responses_plain(gray: &Gray) -> Vec<f32> {
    let (width, height) = (gray.width_px(), gray.height_px());
    let mut out = vec![0f32; width * height];
    if width < WINDOW_PX || height < WINDOW_PX {
        return out;
    }
    // Slot y % 5 holds row y of the tensor, summed along x; the first and last row of the image have no tensor.
    let mut slots: [[Vec<f32>; 3]; WINDOW_PX] = std::array::from_fn(|_| std::array::from_fn(|_| vec![0f32; width]));
    let mut tensor: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0f32; width]);
    for y in 1..height {
        let slot = &mut slots[y % WINDOW_PX];
        if y + 1 < height {
            tensor_row(gray, y, &mut tensor);
            for (sums, plane) in slot.iter_mut().zip(&tensor) {
                window_sums(plane, sums);
            }
        } else {
            slot.iter_mut().for_each(|sums| sums.fill(0.0));
        }
        if y >= WINDOW_PX - 1 {
            let first = y - (WINDOW_PX - 1);
            let rows = std::array::from_fn(|j| &slots[(first + j) % WINDOW_PX]);
            let middle = first + WINDOW_RADIUS_PX;
            eigenvalues(rows, &mut out[middle * width..(middle + 1) * width]);
        }
    }
    out
}

/// Products of the Sobel gradient along row y.
#[inline(always)]
fn tensor_row(gray: &Gray, y: usize, tensor: &mut [Vec<f32>; 3]) {
    let width = gray.width_px();
    let [a, b, c] = [gray.row(y - 1), gray.row(y), gray.row(y + 1)].map(|row| &row[..width]);
    let [xx, xy, yy] = tensor;
    let (xx, xy, yy) = (&mut xx[..width], &mut xy[..width], &mut yy[..width]);
    for x in 1..width - 1 {
        let gx = (a[x + 1] - a[x - 1] + 2.0 * (b[x + 1] - b[x - 1]) + c[x + 1] - c[x - 1]) * 0.125;
        let gy = (c[x - 1] - a[x - 1] + 2.0 * (c[x] - a[x]) + c[x + 1] - a[x + 1]) * 0.125;
        (xx[x], xy[x], yy[x]) = (gx * gx, gx * gy, gy * gy);
    }
}

/// Sums of five neighbours, divided by the window's pixels; the two outermost stay zero.
#[inline(always)]
fn window_sums(plane: &[f32], sums: &mut [f32]) {
    const NORM: f32 = 1.0 / (WINDOW_PX * WINDOW_PX) as f32;
    let inner = &mut sums[WINDOW_RADIUS_PX..plane.len() - WINDOW_RADIUS_PX];
    for (out, w) in inner.iter_mut().zip(plane.windows(WINDOW_PX)) {
        *out = (w[0] + w[1] + w[2] + w[3] + w[4]) * NORM;
    }
}

/// The smaller eigenvalue of the tensor summed over five rows.
#[inline(always)]
fn eigenvalues(rows: [&[Vec<f32>; 3]; WINDOW_PX], out: &mut [f32]) {
    let width = out.len();
    let planes: [[&[f32]; WINDOW_PX]; 3] = std::array::from_fn(|p| rows.map(|row| &row[p][..width]));
    let sum = |p: usize, x: usize| {
        let [a, b, c, d, e] = planes[p];
        a[x] + b[x] + c[x] + d[x] + e[x]
    };
    for (x, out) in out.iter_mut().enumerate() {
        let (xx, xy, yy) = (sum(0, x), sum(1, x), sum(2, x));
        let half_trace = 0.5 * (xx + yy);
        let half_gap = 0.5 * (xx - yy);
        *out = half_trace - (half_gap * half_gap + xy * xy).sqrt();
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_images::blocks;
    use super::*;

    #[test]
    fn a_corner_has_a_response_and_an_edge_has_none() {
        let at = |f: fn(usize, usize) -> bool| {
            let values = (0..400).map(|i| if f(i % 20, i / 20) { 200.0 } else { 50.0 }).collect();
            responses(&Gray::from_values(20, 20, values).unwrap())[10 * 20 + 10]
        };
        assert!(at(|x, y| x >= 10 && y >= 10) > 100.0);
        assert!(at(|x, _| x >= 10).abs() < 1e-2);
    }

    #[test]
    fn both_twins_agree_bit_for_bit() {
        for (width, height) in [(3, 9), (5, 5), (61, 40), (64, 64)] {
            let gray = blocks(width, height);
            let bits = |v: Vec<f32>| v.into_iter().map(f32::to_bits).collect::<Vec<_>>();
            assert_eq!(bits(responses(&gray)), bits(responses_plain(&gray)));
        }
    }
}
