//! The inverse discrete cosine transform of a block, to all of its pixels or to fewer.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// The inverse transform to blocks of 8, 4, 2 or 1 pixels along each axis.
pub(super) enum InverseTransform {
    /// To all pixels: by place, what coefficients are multiplied by before the butterflies.
    Whole(Box<[f32; 64]>),
    /// To `size` pixels, each the mean of those it stands for: by frequency and pixel.
    Reduced { size: usize, basis: [[f32; 4]; 8] },
}

impl InverseTransform {
    /// The transform to `size` pixels: 8, 4, 2 or 1.
    pub fn new(size: usize) -> Self {
        if size == 8 {
            let scales = |i: usize| butterfly_scale(i / 8) * butterfly_scale(i % 8);
            return Self::Whole(Box::new(std::array::from_fn(|i| scales(i) as f32)));
        }
        // T.81, A.3.3: C(k) / 2 cos((2 n + 1) k pi / 16), averaged over the `cell` pixels from n = cell * i on.
        let cell = 8 / size;
        let wave = |k: usize, n: usize| ((2 * n + 1) as f64 * k as f64 * PI / 16.0).cos();
        let weight = |k: usize| 0.5 * if k == 0 { FRAC_1_SQRT_2 } else { 1.0 } / cell as f64;
        let mean = |k: usize, i: usize| weight(k) * (cell * i..cell * (i + 1)).map(|n| wave(k, n)).sum::<f64>();
        let entry = |k: usize, i: usize| if i < size { mean(k, i) as f32 } else { 0.0 };
        Self::Reduced { size, basis: std::array::from_fn(|k| std::array::from_fn(|i| entry(k, i))) }
    }

    /// Pixels along each axis.
    pub fn size(&self) -> usize {
        match self {
            Self::Whole(_) => 8,
            Self::Reduced { size, .. } => *size,
        }
    }

    /// The levels of a block, 128 added, row by row; only the first `size` of each axis are valid. `values` are by place (column * 8
    /// + row of the frequencies); `is_flat` says that only the first differs from 0.
    #[inline(always)]
    pub fn pixels(&self, values: &[i32; 64], is_flat: bool) -> [[f32; 8]; 8] {
        if is_flat {
            return [[128.0 + values[0] as f32 / 8.0; 8]; 8];
        }
        match self {
            Self::Whole(scales) => whole(values, scales),
            Self::Reduced { basis, .. } => reduced(values, basis),
        }
    }
}

/// What the butterflies expect of frequency k: C(k) / 2 cos(k pi / 16), times sqrt(2) for all but k = 0, over sqrt(2).
fn butterfly_scale(k: usize) -> f64 {
    let cosine = if k == 0 { FRAC_1_SQRT_2 } else { (k as f64 * PI / 16.0).cos() };
    0.5 * cosine
}

/// Eight numbers that are treated alike.
type Lanes = [f32; 8];

#[inline(always)]
fn add(a: Lanes, b: Lanes) -> Lanes {
    std::array::from_fn(|i| a[i] + b[i])
}

#[inline(always)]
fn sub(a: Lanes, b: Lanes) -> Lanes {
    std::array::from_fn(|i| a[i] - b[i])
}

#[inline(always)]
fn mul(a: Lanes, factor: f32) -> Lanes {
    std::array::from_fn(|i| a[i] * factor)
}

/// The transform of every row, then of every column.
fn whole(values: &[i32; 64], scales: &[f32; 64]) -> [Lanes; 8] {
    let mut block: [Lanes; 8] =
        std::array::from_fn(|u| std::array::from_fn(|v| values[u * 8 + v] as f32 * scales[u * 8 + v]));
    block = butterflies(block);
    block = std::array::from_fn(|v| std::array::from_fn(|x| block[x][v]));
    block[0] = block[0].map(|level| level + 128.0);
    butterflies(block)
}

/// Eight one-dimensional transforms beside each other (Arai, Agui and Nakajima 1988, as in Pennebaker and Mitchell, *JPEG*, 4.3.2,
/// read backwards).
#[inline(always)]
fn butterflies([a0, a1, a2, a3, a4, a5, a6, a7]: [Lanes; 8]) -> [Lanes; 8] {
    // Even frequencies.
    let (sum, difference) = (add(a0, a4), sub(a0, a4));
    let outer = add(a2, a6);
    let inner = sub(mul(sub(a2, a6), std::f32::consts::SQRT_2), outer);
    let even = [add(sum, outer), add(difference, inner), sub(difference, inner), sub(sum, outer)];
    // Odd frequencies.
    let (z13, z10) = (add(a5, a3), sub(a5, a3));
    let (z11, z12) = (add(a1, a7), sub(a1, a7));
    let z5 = mul(add(z10, z12), 1.847_759_1);
    let odd_0 = add(z11, z13);
    let odd_1 = sub(sub(z5, mul(z10, 2.613_126)), odd_0);
    let odd_2 = sub(mul(sub(z11, z13), std::f32::consts::SQRT_2), odd_1);
    let odd_3 = sub(sub(z5, mul(z12, 1.082_392_2)), odd_2);
    [
        add(even[0], odd_0),
        add(even[1], odd_1),
        add(even[2], odd_2),
        add(even[3], odd_3),
        sub(even[3], odd_3),
        sub(even[2], odd_2),
        sub(even[1], odd_1),
        sub(even[0], odd_0),
    ]
}

/// The means of all frequencies; entries of the basis beyond its size are 0.
fn reduced(values: &[i32; 64], basis: &[[f32; 4]; 8]) -> [Lanes; 8] {
    let mut rows = [[0f32; 4]; 8];
    for (u, wave) in basis.iter().enumerate() {
        for (v, row) in rows.iter_mut().enumerate() {
            let value = values[u * 8 + v] as f32;
            *row = std::array::from_fn(|x| row[x] + value * wave[x]);
        }
    }
    let mut out = [[0f32; 8]; 8];
    for (y, line) in out.iter_mut().enumerate().take(4) {
        let mut sum = [128f32; 4];
        for (v, row) in rows.iter().enumerate() {
            sum = std::array::from_fn(|x| sum[x] + basis[v][y] * row[x]);
        }
        line[..4].copy_from_slice(&sum);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The forward transform of T.81, A.3.3, rounded to whole numbers, by place.
    fn forward(pixel: impl Fn(usize, usize) -> f64) -> [i32; 64] {
        let c = |k: usize| if k == 0 { FRAC_1_SQRT_2 } else { 1.0 };
        let wave = |n: usize, k: usize| ((2 * n + 1) as f64 * k as f64 * PI / 16.0).cos();
        std::array::from_fn(|place| {
            let (u, v) = (place / 8, place % 8);
            let each = (0..64).map(|i| (pixel(i % 8, i / 8) - 128.0) * wave(i % 8, u) * wave(i / 8, v));
            (0.25 * c(u) * c(v) * each.sum::<f64>()).round() as i32
        })
    }

    #[test]
    fn inverts_the_transform_that_t81_defines() {
        let pixel = |x: usize, y: usize| ((x * 37 + y * 91 + x * y * 13) % 200) as f64 + 20.0;
        let found = InverseTransform::new(8).pixels(&forward(pixel), false);
        for (x, y) in (0..64).map(|i| (i % 8, i / 8)) {
            // Rounding 64 coefficients moves a pixel by 0.3 (one sigma).
            assert!((f64::from(found[y][x]) - pixel(x, y)).abs() < 1.2, "{x} {y}: {} {}", found[y][x], pixel(x, y));
        }
    }

    #[test]
    fn fewer_pixels_are_the_means_of_a_block() {
        let pixel = |x: usize, y: usize| ((x * 37 + y * 91 + x * y * 13) % 200) as f64 + 20.0;
        let values = forward(pixel);
        for size in [4, 2, 1] {
            let found = InverseTransform::new(size).pixels(&values, false);
            let r = 8 / size;
            for (x, y) in (0..size * size).map(|i| (i % size, i / size)) {
                let all = (0..r * r).map(|i| pixel(x * r + i % r, y * r + i / r));
                let mean = all.sum::<f64>() / (r * r) as f64;
                assert!((f64::from(found[y][x]) - mean).abs() < 0.7, "{size} {x} {y}: {} {mean}", found[y][x]);
            }
        }
    }
}
