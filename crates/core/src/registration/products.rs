//! Sums of products of two structures: the kernels of every comparison of a view with the map.
//!
//! Sums are exact integers, so the SIMD kernels give the same as the plain ones.

#![allow(unsafe_code)]

use crate::feature::{CHANNEL_ONE, ENERGY_ONE, Structure};
use crate::simd::dispatch;

/// The first pixel of a box of pixels.
#[derive(Debug, Clone, Copy)]
pub struct BoxCorner {
    /// First column.
    pub x_px: usize,
    /// First row.
    pub y_px: usize,
}

/// A sum of products of channels, divided by this, is in units of 1.
pub const CHANNELS_SCALE: f64 = CHANNEL_ONE as f64 * CHANNEL_ONE as f64;
/// A sum of products of energies, divided by this, is in units of 1.
pub const ENERGIES_SCALE: f64 = ENERGY_ONE as f64 * ENERGY_ONE as f64;

/// Sum over `width_px` columns of `height_px` rows of Re(conj(f) m) over both channels, in parts of [`CHANNELS_SCALE`].
/// Exact up to 2^15 pixels.
pub fn channels_in_box(view: &Structure, at: BoxCorner, map: &Structure, on: BoxCorner, size_px: [usize; 2]) -> i32 {
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has AVX2.
        return unsafe { avx2::channels_in_box(view, at, map, on, size_px) };
    }
    rows(view, at, map, on, size_px).map(|(f, m)| channels_plain(f, m)).sum()
}

/// Sum over one row of Re(conj(f) m) over both channels, in parts of [`CHANNELS_SCALE`]. Rows must be shorter than 2^15.
pub fn channels_in_row(f: &[[i8; 4]], m: &[[i8; 4]]) -> i32 {
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has AVX2.
        return unsafe { avx2::channels(f, m) };
    }
    channels_plain(f, m)
}

dispatch! {
    /// Sum over one row of products of energies, in parts of [`ENERGIES_SCALE`]. Rows must be shorter than 2^15.
    pub fn energies_in_row(f: &[u8], m: &[u8]) -> u32 {
        f.iter().zip(m).map(|(&f, &m)| u32::from(u16::from(f) * u16::from(m))).sum()
    }
}

fn channels_plain(f: &[[i8; 4]], m: &[[i8; 4]]) -> i32 {
    f.iter().zip(m).map(|(f, m)| (0..4).map(|k| i32::from(f[k]) * i32::from(m[k])).sum::<i32>()).sum()
}

fn rows<'a>(
    view: &'a Structure,
    at: BoxCorner,
    map: &'a Structure,
    on: BoxCorner,
    [width, height]: [usize; 2],
) -> impl Iterator<Item = (&'a [[i8; 4]], &'a [[i8; 4]])> {
    (0..height).map(move |y| {
        let f = &view.channels[(at.y_px + y) * view.width_px + at.x_px..][..width];
        let m = &map.channels[(on.y_px + y) * map.width_px + on.x_px..][..width];
        (f, m)
    })
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2 {
    use super::{BoxCorner, Structure, rows};
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx2")]
    pub fn channels_in_box(
        view: &Structure,
        at: BoxCorner,
        map: &Structure,
        on: BoxCorner,
        size_px: [usize; 2],
    ) -> i32 {
        let mut sums = _mm256_setzero_si256();
        for (f, m) in rows(view, at, map, on, size_px) {
            sums = _mm256_add_epi32(sums, row(f, m));
        }
        total(sums)
    }

    #[target_feature(enable = "avx2")]
    pub fn channels(f: &[[i8; 4]], m: &[[i8; 4]]) -> i32 {
        total(row(f, m))
    }

    /// Eight partial sums.
    #[target_feature(enable = "avx2")]
    fn row(f: &[[i8; 4]], m: &[[i8; 4]]) -> __m256i {
        let mut sums = _mm256_setzero_si256();
        let (f8, m8) = (f.chunks_exact(8), m.chunks_exact(8));
        let (f_rest, m_rest) = (f8.remainder(), m8.remainder());
        for (f, m) in f8.zip(m8) {
            // SAFETY: eight pixels are 32 bytes; unaligned loads.
            let (f, m) = unsafe { (_mm256_loadu_si256(f.as_ptr().cast()), _mm256_loadu_si256(m.as_ptr().cast())) };
            sums = _mm256_add_epi32(sums, products(f, m));
        }
        let rest = f_rest.len().min(m_rest.len());
        if rest > 0 {
            let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            let mask = _mm256_cmpgt_epi32(_mm256_set1_epi32(rest as i32), lanes);
            // SAFETY: a pixel is a lane of 32 bits, and only the lanes of the `rest` pixels that both slices have are read.
            let (f, m) = unsafe {
                (
                    _mm256_maskload_epi32(f_rest.as_ptr().cast(), mask),
                    _mm256_maskload_epi32(m_rest.as_ptr().cast(), mask),
                )
            };
            sums = _mm256_add_epi32(sums, products(f, m));
        }
        sums
    }

    /// The sum of products of each of eight pixels.
    #[target_feature(enable = "avx2")]
    fn products(f: __m256i, m: __m256i) -> __m256i {
        // |f| times m with f's sign: no byte is -128, so two products of at most 127^2 fit 16 bits.
        let pairs = _mm256_maddubs_epi16(_mm256_abs_epi8(f), _mm256_sign_epi8(m, f));
        _mm256_madd_epi16(pairs, _mm256_set1_epi16(1))
    }

    #[target_feature(enable = "avx2")]
    fn total(sums: __m256i) -> i32 {
        let half = _mm_add_epi32(_mm256_castsi256_si128(sums), _mm256_extracti128_si256(sums, 1));
        let quarter = _mm_add_epi32(half, _mm_shuffle_epi32(half, 0b00_00_11_10));
        _mm_cvtsi128_si32(_mm_add_epi32(quarter, _mm_shuffle_epi32(quarter, 0b00_00_00_01)))
    }
}

/// The integral image of a structure's energy: the sum over any box takes four additions.
pub struct EnergyIntegral {
    width: usize,
    sums: Vec<u32>,
}

impl EnergyIntegral {
    /// Makes the integral image. Sums are exact modulo 2^32, so a box must hold less.
    pub fn new(structure: &Structure) -> Self {
        let width = structure.width_px + 1;
        let mut sums = vec![0u32; width * (structure.height_px + 1)];
        for (y, row) in structure.energy.chunks_exact(structure.width_px.max(1)).enumerate() {
            let (above, below) = sums.split_at_mut((y + 1) * width);
            let above = &above[y * width..];
            let mut along = 0u32;
            for ((out, &up), &e) in below[1..width].iter_mut().zip(&above[1..]).zip(row) {
                along = along.wrapping_add(u32::from(e));
                *out = up.wrapping_add(along);
            }
        }
        Self { width, sums }
    }

    /// Sum over a box that lies inside, in parts of [`ENERGY_ONE`].
    pub fn in_box(&self, at: BoxCorner, [width_px, height_px]: [usize; 2]) -> u32 {
        let s = |x: usize, y: usize| self.sums[y * self.width + x];
        let (x0, y0, x1, y1) = (at.x_px, at.y_px, at.x_px + width_px, at.y_px + height_px);
        s(x1, y1).wrapping_sub(s(x0, y1)).wrapping_sub(s(x1, y0)).wrapping_add(s(x0, y0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn anything(width: usize, height: usize, seed: u32) -> Structure {
        let mut state = seed | 1;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state
        };
        let mut s = Structure::unknown(width, height);
        s.channels
            .iter_mut()
            .for_each(|c| *c = std::array::from_fn(|_| (next() % 255) as u8 as i8).map(|v: i8| v.max(-127)));
        s.energy.iter_mut().for_each(|e| *e = next() as u8);
        s
    }

    proptest! {
        #[test]
        fn simd_and_plain_kernels_agree(x in 0usize..20, y in 0usize..9, width in 1usize..40, height in 1usize..8, seed in 0u32..1000) {
            let (f, m) = (anything(40, 8, seed), anything(60, 17, seed + 7));
            let (at, on) = (BoxCorner { x_px: 40 - width, y_px: 8 - height }, BoxCorner { x_px: x, y_px: y });
            let plain: i32 = rows(&f, at, &m, on, [width, height]).map(|(f, m)| channels_plain(f, m)).sum();
            prop_assert_eq!(channels_in_box(&f, at, &m, on, [width, height]), plain);
            let (p, q) = (&f.channels[..width], &m.channels[..width]);
            prop_assert_eq!(channels_in_row(p, q), channels_plain(p, q));
            let energy: u32 = (y..y + height).map(|j| m.energy[j * 60 + x..][..width].iter().map(|&e| u32::from(e)).sum::<u32>()).sum();
            prop_assert_eq!(EnergyIntegral::new(&m).in_box(on, [width, height]), energy);
        }
    }

    #[test]
    fn the_largest_bytes_do_not_overflow() {
        let mut s = Structure::unknown(48, 48);
        s.channels.fill([127, -127, 127, -127]);
        let corner = BoxCorner { x_px: 0, y_px: 0 };
        assert_eq!(channels_in_box(&s, corner, &s, corner, [48, 48]), 48 * 48 * 4 * 127 * 127);
    }
}
