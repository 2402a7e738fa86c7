//! Products of a template's cells with a window's cells at many places at once.
//!
//! A place is a 32-bit lane, whose four bytes are multiplied by the template's four bytes in one instruction. Sums are exact
//! integers, so the SIMD kernels give the same as the plain one.

#![allow(unsafe_code)]

/// One cell of a template.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TemplateCell {
    /// Index of the window's cell under this cell, from the place, in a window laid out row by row.
    pub offset: usize,
    /// Values from -63 to 63: two products with a window's byte then fit 16 bits.
    pub values: [i8; 4],
}

/// Largest modulus of a template's value.
pub const MOST_VALUE: i8 = 63;
/// The number of columns of places is a multiple of this,
pub const COLUMNS_STEP: usize = 16;
/// and the number of rows a multiple of this.
pub const ROWS_STEP: usize = 4;

/// Writes for each place (x, y) of `columns` x (`sums.len()` / `columns`) the sum over `cells` of products with the window's
/// cell at `y * stride + x + offset`. The shape is a multiple of [`COLUMNS_STEP`] and [`ROWS_STEP`].
///
/// # Panics
/// Where a place reaches beyond the window, or the shape is no such multiple.
pub fn cell_dots(window: &[[u8; 4]], stride: usize, cells: &[TemplateCell], columns: usize, sums: &mut [i32]) {
    let rows = sums.len() / columns.max(1);
    assert!(columns.is_multiple_of(COLUMNS_STEP) && rows.is_multiple_of(ROWS_STEP) && rows * columns == sums.len());
    let farthest = cells.iter().map(|c| c.offset).max().unwrap_or(0);
    assert!(rows == 0 || (rows - 1) * stride + columns + farthest <= window.len(), "a place reaches beyond the window");
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    {
        if is_x86_feature_detected!("avx512vnni") && is_x86_feature_detected!("avx512f") {
            // SAFETY: the machine has AVX-512 F and VNNI, and every place lies in the window.
            return unsafe { x86::dots_vnni(window, stride, cells, columns, sums) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { x86::dots_avx2(window, stride, cells, columns, sums) };
        }
    }
    plain(window, stride, cells, columns, sums);
}

fn plain(window: &[[u8; 4]], stride: usize, cells: &[TemplateCell], columns: usize, sums: &mut [i32]) {
    sums.fill(0);
    for cell in cells {
        for (y, row) in sums.chunks_exact_mut(columns).enumerate() {
            for (sum, m) in row.iter_mut().zip(&window[y * stride + cell.offset..]) {
                *sum += (0..4).map(|i| i32::from(m[i]) * i32::from(cell.values[i])).sum::<i32>();
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod x86 {
    use super::{COLUMNS_STEP, ROWS_STEP, TemplateCell};
    use std::arch::x86_64::*;

    /// # Safety
    /// The machine has AVX-512 F and VNNI; every place lies in the window.
    #[target_feature(enable = "avx512f,avx512vnni")]
    pub unsafe fn dots_vnni(
        window: &[[u8; 4]],
        stride: usize,
        cells: &[TemplateCell],
        columns: usize,
        sums: &mut [i32],
    ) {
        for (strip, out) in sums.chunks_exact_mut(ROWS_STEP * columns).enumerate() {
            for x in (0..columns).step_by(COLUMNS_STEP) {
                let corner = strip * ROWS_STEP * stride + x;
                let mut total = [_mm512_setzero_si512(); ROWS_STEP];
                for cell in cells {
                    let t = _mm512_set1_epi32(i32::from_le_bytes(cell.values.map(|v| v as u8)));
                    for (row, total) in total.iter_mut().enumerate() {
                        // SAFETY: the caller vouches for 16 cells from here.
                        let m = unsafe {
                            _mm512_loadu_si512(window.as_ptr().add(corner + row * stride + cell.offset).cast())
                        };
                        *total = _mm512_dpbusd_epi32(*total, m, t);
                    }
                }
                for (row, total) in total.into_iter().enumerate() {
                    let place = &mut out[row * columns + x..][..COLUMNS_STEP];
                    // SAFETY: 16 sums are 64 bytes.
                    unsafe { _mm512_storeu_si512(place.as_mut_ptr().cast(), total) };
                }
            }
        }
    }

    /// # Safety
    /// The machine has AVX2; every place lies in the window.
    #[target_feature(enable = "avx2")]
    pub unsafe fn dots_avx2(
        window: &[[u8; 4]],
        stride: usize,
        cells: &[TemplateCell],
        columns: usize,
        sums: &mut [i32],
    ) {
        const LANES: usize = 8;
        let ones = _mm256_set1_epi16(1);
        for (strip, out) in sums.chunks_exact_mut(ROWS_STEP * columns).enumerate() {
            for x in (0..columns).step_by(LANES) {
                let corner = strip * ROWS_STEP * stride + x;
                let mut total = [_mm256_setzero_si256(); ROWS_STEP];
                for cell in cells {
                    let t = _mm256_set1_epi32(i32::from_le_bytes(cell.values.map(|v| v as u8)));
                    for (row, total) in total.iter_mut().enumerate() {
                        // SAFETY: the caller vouches for 8 cells from here.
                        let m = unsafe {
                            _mm256_loadu_si256(window.as_ptr().add(corner + row * stride + cell.offset).cast())
                        };
                        // At most 2 * 255 * 63: no saturation.
                        let pairs = _mm256_maddubs_epi16(m, t);
                        *total = _mm256_add_epi32(*total, _mm256_madd_epi16(pairs, ones));
                    }
                }
                for (row, total) in total.into_iter().enumerate() {
                    let place = &mut out[row * columns + x..][..LANES];
                    // SAFETY: 8 sums are 32 bytes.
                    unsafe { _mm256_storeu_si256(place.as_mut_ptr().cast(), total) };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        #[allow(unsafe_code)]
        fn all_kernels_give_the_same(seed in 0u32..1000, strips in 1usize..4, wide in 1usize..4, extreme in any::<bool>()) {
            let (columns, rows, reach) = (wide * COLUMNS_STEP, strips * ROWS_STEP, 5);
            let stride = columns + reach;
            let mut state = seed;
            let mut next = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            };
            let mut byte = |most: u8| if extreme { most } else { (u16::from(next()) * u16::from(most) / 255) as u8 };
            let window: Vec<[u8; 4]> = (0..stride * (rows + reach)).map(|_| std::array::from_fn(|_| byte(255))).collect();
            let offsets = (0..reach).flat_map(|y| (0..=reach).map(move |x| y * stride + x));
            let cells: Vec<TemplateCell> = offsets
                .map(|offset| {
                    let sign = if offset % 3 == 0 && !extreme { -1 } else { 1 };
                    TemplateCell { offset, values: std::array::from_fn(|_| sign * byte(63) as i8) }
                })
                .collect();
            let mut expected = vec![7; columns * rows];
            plain(&window, stride, &cells, columns, &mut expected);
            let mut sums = vec![-1; columns * rows];
            cell_dots(&window, stride, &cells, columns, &mut sums);
            prop_assert_eq!(&sums, &expected);
            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the machine has AVX2; the shapes are right.
                unsafe { x86::dots_avx2(&window, stride, &cells, columns, &mut sums) };
                prop_assert_eq!(&sums, &expected);
            }
        }
    }
}
