//! Coarse search: a whole view against a whole region, by FFT.
//!
//! For a placement s of the view on the map the statistic is
//!
//! ```text
//! T(s) = sum_p Re(conj(f_p) m_{p+s}) / sqrt(sum_p |f_p|^2 |m_{p+s}|^2)
//! ```
//!
//! over both channels. Where map and frame have nothing to do with each other the angles between f and m are uniform
//! and T has mean zero and a spread that does not depend on how much structure lies under the view, nor on how much of
//! the view reaches beyond the map: half an overlap can at best give a peak 1 / sqrt 2 as high. So one threshold holds
//! for full fields, masked edges and water. The spread itself (neighbouring pixels are not independent) is measured on
//! the surface.

pub use super::fourier::Fourier;
use super::fourier::quick_length;
use crate::feature::Structure;
use rustfft::num_complex::Complex32;

/// A map region's structure, transformed once for many views.
pub struct CoarseMap {
    transform_size: [usize; 2],
    channels: [Vec<Complex32>; 2],
    energy: Vec<Complex32>,
    mean_energy: f64,
    map_size_px: [usize; 2],
}

/// T at every placement of one view: element (x, y) is the view's upper-left corner at map pixel (x, y).
pub struct Surface {
    /// Placements along x.
    pub width: usize,
    /// Placements along y.
    pub height: usize,
    /// T, row by row; 0 where too little is compared to say anything.
    pub values: Vec<f32>,
}

/// A placement whose products of energies sum to less than this share of what a typical placement has says nothing.
const LEAST_SHARE: f64 = 0.04;

impl CoarseMap {
    /// Transforms a region. Views must not be larger than the region.
    pub fn new(map: &Structure) -> Self {
        let transform_size = [quick_length(map.width_px), quick_length(map.height_px)];
        let mut fourier = Fourier::new(transform_size[0], transform_size[1]);
        let mut plane = |re: &[f32], im: Option<&[f32]>| {
            let mut plane = padded(&fourier, map.width_px, re, im);
            fourier.forward(&mut plane);
            plane
        };
        let channels = [plane(&map.planes[0], Some(&map.planes[1])), plane(&map.planes[2], Some(&map.planes[3]))];
        let energy = plane(&map.energy, None);
        let valid_px = (map.valid_fraction * (map.width_px * map.height_px) as f64).max(1.0);
        Self {
            mean_energy: map.total_energy() / valid_px,
            transform_size,
            channels,
            energy,
            map_size_px: [map.width_px, map.height_px],
        }
    }

    /// Plans and scratch for [`CoarseMap::correlate`]; each thread needs its own.
    pub fn fourier(&self) -> Fourier {
        Fourier::new(self.transform_size[0], self.transform_size[1])
    }

    /// T at every placement that keeps the view inside the region; `None` where the view does not fit or is blank.
    /// `fourier` is this map's own.
    pub fn correlate(&self, fourier: &mut Fourier, view: &Structure) -> Option<Surface> {
        let [map_w, map_h] = self.map_size_px;
        let view_energy = view.total_energy();
        if view.width_px > map_w || view.height_px > map_h || view_energy <= 0.0 || self.mean_energy <= 0.0 {
            return None;
        }
        let mut plane = self.cross_spectrum(fourier, view);
        fourier.inverse(&mut plane);
        let (width, height) = (map_w - view.width_px + 1, map_h - view.height_px + 1);
        let norm = 1.0 / (fourier.width() * fourier.height()) as f32;
        let least = (LEAST_SHARE * view_energy * self.mean_energy) as f32;
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height {
            let row = &plane[y * fourier.width()..y * fourier.width() + width];
            values.extend(row.iter().map(|c| {
                let (sum, variance) = (c.re * norm, c.im * norm);
                if variance > least { sum / variance.sqrt() } else { 0.0 }
            }));
        }
        Some(Surface { width, height, values })
    }

    /// The spectrum of (numerator of T) + i (square of its denominator).
    fn cross_spectrum(&self, fourier: &mut Fourier, view: &Structure) -> Vec<Complex32> {
        let mut spectrum = |re: &[f32], im: Option<&[f32]>| {
            let mut plane = padded(fourier, view.width_px, re, im);
            fourier.forward(&mut plane);
            plane
        };
        let first = spectrum(&view.planes[0], Some(&view.planes[1]));
        let second = spectrum(&view.planes[2], Some(&view.planes[3]));
        let energy = spectrum(&view.energy, None);
        let [w, h] = self.transform_size;
        let cross = |i: usize| self.channels[0][i] * first[i].conj() + self.channels[1][i] * second[i].conj();
        let mut out = vec![Complex32::new(0.0, 0.0); w * h];
        for x in 0..w {
            let mirrored_x = (w - x) % w;
            for y in 0..h {
                let (i, j) = (x * h + y, mirrored_x * h + (h - y) % h);
                // The Hermitian part of a spectrum is the spectrum of the real part.
                let real_part = (cross(i) + cross(j).conj()) * 0.5;
                let variance = self.energy[i] * energy[i].conj();
                out[i] = real_part + Complex32::new(-variance.im, variance.re);
            }
        }
        out
    }
}

/// A plane of the transform's size with `re + i im` in its upper-left corner.
fn padded(fourier: &Fourier, width: usize, re: &[f32], im: Option<&[f32]>) -> Vec<Complex32> {
    let mut plane = vec![Complex32::new(0.0, 0.0); fourier.width() * fourier.height()];
    for (y, row) in re.chunks_exact(width).enumerate() {
        let target = &mut plane[y * fourier.width()..y * fourier.width() + width];
        for (x, (out, &value)) in target.iter_mut().zip(row).enumerate() {
            *out = Complex32::new(value, im.map_or(0.0, |im| im[y * width + x]));
        }
    }
    plane
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixels::{Gray, Mask};

    fn noise(width: usize, height: usize, seed: u32) -> Gray {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as f32
        };
        let fine: Vec<f32> = (0..width * height * 9).map(|_| next()).collect();
        Gray::from_values(width * 3, height * 3, fine).unwrap().shrunk(width, height)
    }

    fn cut(gray: &Gray, x0: usize, y0: usize, w: usize, h: usize) -> Gray {
        Gray::from_values(w, h, (0..w * h).map(|i| gray.at(x0 + i % w, y0 + i / w)).collect()).unwrap()
    }

    /// T straight from its definition.
    fn brute_force(map: &Structure, view: &Structure, x0: usize, y0: usize) -> f32 {
        let (mut sum, mut variance) = (0f64, 0f64);
        for y in 0..view.height_px {
            for x in 0..view.width_px {
                let (i, j) = (y * view.width_px + x, (y + y0) * map.width_px + x + x0);
                sum += (0..4).map(|k| f64::from(view.planes[k][i] * map.planes[k][j])).sum::<f64>();
                variance += f64::from(view.energy[i] * map.energy[j]);
            }
        }
        (sum / variance.sqrt()) as f32
    }

    #[test]
    fn agrees_with_the_definition_and_peaks_where_the_view_was_cut() {
        let ground = noise(90, 70, 5);
        let map = Structure::of(&ground, &Mask::filled(90, 70, true));
        let view = Structure::of(&cut(&ground, 31, 17, 40, 30), &Mask::filled(40, 30, true));
        let coarse = CoarseMap::new(&map);
        let surface = coarse.correlate(&mut coarse.fourier(), &view).unwrap();
        for (x, y) in [(0, 0), (31, 17), (50, 40), (7, 33)] {
            let (fast, slow) = (surface.values[y * surface.width + x], brute_force(&map, &view, x, y));
            assert!((fast - slow).abs() < 1e-2 * slow.abs().max(1.0), "{x} {y}: {fast} {slow}");
        }
        let best = (0..surface.values.len()).max_by(|&a, &b| surface.values[a].total_cmp(&surface.values[b])).unwrap();
        assert_eq!((best % surface.width, best / surface.width), (31, 17));
    }

    #[test]
    fn says_nothing_for_blank_views_and_views_that_do_not_fit() {
        let ground = noise(40, 40, 5);
        let map = CoarseMap::new(&Structure::of(&ground, &Mask::filled(40, 40, true)));
        let mut f = map.fourier();
        assert!(
            map.correlate(&mut f, &Structure::of(&Gray::filled(20, 20, 9.0), &Mask::filled(20, 20, true))).is_none()
        );
        assert!(map.correlate(&mut f, &Structure::of(&noise(50, 20, 1), &Mask::filled(50, 20, true))).is_none());
    }
}
