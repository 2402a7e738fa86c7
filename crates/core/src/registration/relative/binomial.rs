//! Binomial smoothing, which reduces noise and aliasing before brightness is compared between pixels.

use crate::pixels::Gray;
use crate::simd::dispatch;

dispatch! {
    /// The image smoothed by 1 4 6 4 1 / 16 in both directions; the rim, two pixels wide, is not smoothed.
    pub fn smoothed(gray: &Gray) -> Gray {
        smoothed_plain(gray)
    }
}

#[inline(always)]
fn smoothed_plain(gray: &Gray) -> Gray {
    let (width, height) = (gray.width_px(), gray.height_px());
    let mut out = gray.clone();
    if width < 5 || height < 5 {
        return out;
    }
    // Slot y % 5 holds row y, smoothed along x.
    let mut slots: [Vec<f32>; 5] = std::array::from_fn(|_| vec![0f32; width]);
    for y in 0..height {
        let along = &mut slots[y % 5][2..width - 2];
        for (out, w) in along.iter_mut().zip(gray.row(y).windows(5)) {
            *out = binomial(w[0], w[1], w[2], w[3], w[4]);
        }
        if y >= 4 {
            let [a, b, c, d, e] = std::array::from_fn(|j| &slots[(y - 4 + j) % 5][..width]);
            let target = &mut out.values_mut()[(y - 2) * width..(y - 1) * width];
            for x in 2..width - 2 {
                target[x] = binomial(a[x], b[x], c[x], d[x], e[x]);
            }
        }
    }
    out
}

/// The weighted mean of five neighbours.
#[inline(always)]
fn binomial(a: f32, b: f32, c: f32, d: f32, e: f32) -> f32 {
    ((a + e) + 4.0 * (b + d) + 6.0 * c) * (1.0 / 16.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_twins_agree_bit_for_bit_and_ramps_stay() {
        let gray = Gray::from_values(37, 23, (0..37 * 23).map(|i| (i % 37) as f32 + (i * i % 7) as f32).collect());
        let gray = gray.unwrap();
        assert_eq!(smoothed(&gray), smoothed_plain(&gray));
        let ramp = Gray::from_values(30, 30, (0..900).map(|i| (i % 30 + 2 * (i / 30)) as f32).collect()).unwrap();
        assert_eq!(smoothed(&ramp), ramp);
        assert_eq!(smoothed(&Gray::filled(4, 9, 3.0)), Gray::filled(4, 9, 3.0));
    }
}
