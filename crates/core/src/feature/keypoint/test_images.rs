//! Drawn images for the tests of keypoints.

use crate::pixels::Gray;

/// Rectangles of many sizes and brightnesses, by a small linear congruential generator.
pub fn blocks(width: usize, height: usize) -> Gray {
    let mut gray = Gray::filled(width, height, 100.0);
    let mut state = 12345u32;
    let mut next = |n: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize % n
    };
    for _ in 0..width * height / 60 {
        let (x, y, w, h, v) = (next(width), next(height), 3 + next(12), 3 + next(12), next(256));
        for j in y..(y + h).min(height) {
            for i in x..(x + w).min(width) {
                gray.values_mut()[j * width + i] = v as f32;
            }
        }
    }
    gray
}
