//! Coarse search: a whole view against a whole region, by FFT.
//!
//! For a placement s of the view on the map the statistic is
//!
//! ```text
//! T(s) = sum_p Re(conj(f_p) m_{p+s}) / sqrt(sum_p |f_p|^2 |m_{p+s}|^2)
//! ```
//!
//! over both channels. Where map and frame show different ground the angles between f and m are uniform. Then T has mean
//! zero and a spread that depends neither on the amount of structure under the view nor on the part of the view that lies
//! beyond the map: with half an overlap the peak is at best 1 / sqrt 2 as high. So one threshold holds for full fields,
//! masked edges and water. The spread itself (neighbouring pixels are not independent) is measured on the surface.
//!
//! The denominator is a smooth function of heading and scale, so views that hardly differ share one ([`Normalisation`]).
//! Two views share one inverse transform, one as the real part and one as the imaginary part. Rows that a view leaves empty
//! and rows that no place needs are not transformed.

pub use super::fourier::Fourier;
use super::fourier::{Plans, quick_length};
use crate::feature::{CHANNEL_ONE, ENERGY_ONE, Structure};
use crate::simd::dispatch;
use rustfft::num_complex::Complex32;

/// A view to place on the map: its structure and its nadir.
#[derive(Debug, Clone)]
pub struct PlacedView {
    /// Structure of the view.
    pub structure: Structure,
    /// The nadir, whole pixels from the view's corner; it may lie outside.
    pub nadir_px: [i64; 2],
}

/// Largest extent of views from their nadirs to each side, pixels; negative where all views end before their nadirs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reach {
    /// Towards smaller columns.
    pub left: i64,
    /// Towards smaller rows.
    pub top: i64,
    /// Towards larger columns, the nadir's own included.
    pub right: i64,
    /// Towards larger rows, the nadir's own included.
    pub bottom: i64,
}

impl Reach {
    /// The reach that covers all of `views`.
    pub fn from_views(views: &[PlacedView]) -> Self {
        let most = |pick: fn(&PlacedView) -> i64| views.iter().map(pick).max().unwrap_or(0);
        Self {
            left: most(|v| v.nadir_px[0]),
            top: most(|v| v.nadir_px[1]),
            right: most(|v| v.structure.width_px as i64 - v.nadir_px[0]),
            bottom: most(|v| v.structure.height_px as i64 - v.nadir_px[1]),
        }
    }

    /// Columns between the smallest and the largest.
    pub fn width_px(&self) -> usize {
        (self.left + self.right).max(1) as usize
    }

    /// Rows between the smallest and the largest.
    pub fn height_px(&self) -> usize {
        (self.top + self.bottom).max(1) as usize
    }
}

/// A map region's structure, transformed once for many views.
pub struct CoarseMap {
    plans: Plans,
    transform_size: [usize; 2],
    channels: [Vec<Complex32>; 2],
    energy: Vec<Complex32>,
    mean_energy: f64,
    reach: Reach,
    places: [usize; 2],
}

/// One over the denominator of T at every place; 0 where too little is compared for a decision.
pub struct Normalisation {
    inverse: Vec<f32>,
}

/// T for a nadir at every place, shape (rows of places, columns), row by row; 0 where too little is compared.
pub struct Surface {
    /// T.
    pub values: Vec<f32>,
}

/// T is 0 at a placement whose products of energies sum to less than this share of that of a typical placement.
const LEAST_SHARE: f64 = 0.04;

impl CoarseMap {
    /// Transforms a region that holds `places` (columns, rows) of nadirs and `reach` around them.
    pub fn new(map: &Structure, reach: Reach) -> Self {
        let transform_size = [quick_length(map.width_px), quick_length(map.height_px)];
        let plans = Plans::new(transform_size[0], transform_size[1]);
        let mut fourier = Fourier::new(&plans);
        let channels = [0, 1].map(|k| {
            let mut plane = fourier.plane();
            write_rows(&mut plane, transform_size[0], [0, 0], map, |s, i| channel(s, i, k));
            fourier.forward(&mut plane, 0..map.height_px);
            plane
        });
        let mut energy = fourier.plane();
        write_rows(&mut energy, transform_size[0], [0, 0], map, energy_at);
        fourier.forward(&mut energy, 0..map.height_px);
        let places = [
            (map.width_px + 1).saturating_sub(reach.width_px()),
            (map.height_px + 1).saturating_sub(reach.height_px()),
        ];
        Self { plans, mean_energy: map.mean_energy(), transform_size, channels, energy, reach, places }
    }

    /// Makes plans and scratch for the transforms; each thread needs its own.
    pub fn fourier(&self) -> Fourier {
        Fourier::new(&self.plans)
    }

    /// Number of columns and rows of places.
    pub fn places(&self) -> [usize; 2] {
        self.places
    }

    /// The normalisation of T for a view and similar ones; `None` where view or map are blank.
    pub fn normalisation(&self, fourier: &mut Fourier, view: &PlacedView) -> Option<Normalisation> {
        let view_energy = view.structure.total_energy();
        if view_energy <= 0.0 || self.mean_energy <= 0.0 {
            return None;
        }
        let mut plane = fourier.plane();
        self.place(fourier, view, &mut plane, energy_at);
        plane.iter_mut().zip(&self.energy).for_each(|(v, m)| *v = m * v.conj());
        fourier.inverse(&mut plane, self.places[1]);
        let norm = 1.0 / (fourier.width() * fourier.height()) as f32;
        let least = (LEAST_SHARE * view_energy * self.mean_energy) as f32;
        let inverse = self.places_of(fourier, &plane).map(|c| {
            let variance = c.re * norm;
            if variance > least { 1.0 / variance.sqrt() } else { 0.0 }
        });
        let inverse = inverse.collect();
        fourier.give_back(plane);
        Some(Normalisation { inverse })
    }

    /// T of two views at every place; both views may be the same.
    pub fn correlate(
        &self,
        fourier: &mut Fourier,
        views: [&PlacedView; 2],
        normalisation: &Normalisation,
    ) -> [Surface; 2] {
        // u and v are the spectra of z_a + i z_b and of z_a - i z_b, where z = sum conj(f) m is complex: then the
        // transform of (u(k) + conj v(-k)) / 2 is Re z_a + i Re z_b.
        let [mut u, mut v] = [0; 2].map(|_| fourier.plane());
        u.fill(Complex32::ZERO);
        v.fill(Complex32::ZERO);
        for (k, map) in self.channels.iter().enumerate() {
            let mut spectrum = |view: &PlacedView| {
                let mut plane = fourier.plane();
                self.place(fourier, view, &mut plane, |s, i| channel(s, i, k));
                plane
            };
            let (a, b) = (spectrum(views[0]), spectrum(views[1]));
            multiply(map, &a, &b, &mut u, &mut v);
            fourier.give_back(a);
            fourier.give_back(b);
        }
        let mut plane = fourier.plane();
        self.join(&u, &v, &mut plane);
        fourier.give_back(u);
        fourier.give_back(v);
        fourier.inverse(&mut plane, self.places[1]);
        let norm = 1.0 / (fourier.width() * fourier.height()) as f32;
        let mut surfaces = [0; 2].map(|_| Surface { values: Vec::with_capacity(normalisation.inverse.len()) });
        for (c, &inverse) in self.places_of(fourier, &plane).zip(&normalisation.inverse) {
            surfaces[0].values.push(c.re * norm * inverse);
            surfaces[1].values.push(c.im * norm * inverse);
        }
        fourier.give_back(plane);
        surfaces
    }

    /// Transforms `value` of every pixel of a view, with the view's nadir on the map's first place.
    fn place(
        &self,
        fourier: &mut Fourier,
        view: &PlacedView,
        plane: &mut Vec<Complex32>,
        value: impl Fn(&Structure, usize) -> Complex32,
    ) {
        let x = (self.reach.left - view.nadir_px[0]) as usize;
        let y = (self.reach.top - view.nadir_px[1]) as usize;
        write_rows(plane, self.transform_size[0], [x, y], &view.structure, value);
        fourier.forward(plane, y..y + view.structure.height_px);
    }

    /// Joins the spectra of two real surfaces to that of a complex one.
    fn join(&self, u: &[Complex32], v: &[Complex32], out: &mut [Complex32]) {
        let [w, h] = self.transform_size;
        for x in 0..w {
            let (own, mirrored) = (x * h, (w - x) % w * h);
            let (u, v, out) = (&u[own..own + h], &v[mirrored..mirrored + h], &mut out[own..own + h]);
            out[0] = (u[0] + v[0].conj()) * 0.5;
            join_column(&u[1..], &v[1..], &mut out[1..]);
        }
    }

    /// The values of a transformed plane at the places.
    fn places_of<'a>(
        &self,
        fourier: &Fourier,
        plane: &'a [Complex32],
    ) -> impl Iterator<Item = &'a Complex32> + use<'a> {
        let [columns, rows] = self.places;
        plane.chunks_exact(fourier.width()).take(rows).flat_map(move |row| &row[..columns])
    }
}

dispatch! {
    /// u += m conj(a) + i m conj(b), v += m conj(a) - i m conj(b).
    fn multiply(map: &[Complex32], a: &[Complex32], b: &[Complex32], u: &mut [Complex32], v: &mut [Complex32]) {
        let count = map.len();
        let (a, b, u, v) = (&a[..count], &b[..count], &mut u[..count], &mut v[..count]);
        for i in 0..count {
            let (za, zb) = (map[i] * a[i].conj(), map[i] * b[i].conj());
            let turned = Complex32::new(-zb.im, zb.re);
            u[i] += za + turned;
            v[i] += za - turned;
        }
    }
}

dispatch! {
    /// (u(k) + conj v(-k)) / 2 of a column but for k = 0.
    fn join_column(u: &[Complex32], v: &[Complex32], out: &mut [Complex32]) {
        for ((out, u), v) in out.iter_mut().zip(u).zip(v.iter().rev()) {
            *out = (u + v.conj()) * 0.5;
        }
    }
}

/// Channel `k` (0: doubled, 1: quadrupled angle) of a pixel.
fn channel(structure: &Structure, i: usize, k: usize) -> Complex32 {
    let c = structure.channels[i];
    Complex32::new(f32::from(c[2 * k]), f32::from(c[2 * k + 1])) * (1.0 / CHANNEL_ONE)
}

/// The energy of a pixel, as a real number.
fn energy_at(structure: &Structure, i: usize) -> Complex32 {
    Complex32::new(f32::from(structure.energy[i]) * (1.0 / ENERGY_ONE), 0.0)
}

/// Writes a structure into a plane of `width` columns with its corner at `corner`, and zeros into the rest of these rows.
fn write_rows(
    plane: &mut [Complex32],
    width: usize,
    corner: [usize; 2],
    structure: &Structure,
    value: impl Fn(&Structure, usize) -> Complex32,
) {
    let columns = structure.width_px;
    for y in 0..structure.height_px {
        let row = &mut plane[(corner[1] + y) * width..(corner[1] + y + 1) * width];
        row.fill(Complex32::new(0.0, 0.0));
        for (x, out) in row[corner[0]..corner[0] + columns].iter_mut().enumerate() {
            *out = value(structure, y * columns + x);
        }
    }
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

    fn cut(gray: &Gray, x0: usize, y0: usize, w: usize, h: usize) -> PlacedView {
        let gray = Gray::from_values(w, h, (0..w * h).map(|i| gray.at(x0 + i % w, y0 + i / w)).collect()).unwrap();
        PlacedView { structure: Structure::new(&gray, &Mask::filled(w, h, true)), nadir_px: [7, 4] }
    }

    /// T straight from its definition.
    fn brute_force(map: &Structure, view: &Structure, x0: usize, y0: usize) -> f32 {
        let (mut sum, mut variance) = (0f64, 0f64);
        for y in 0..view.height_px {
            for x in 0..view.width_px {
                let (i, j) = (y * view.width_px + x, (y + y0) * map.width_px + x + x0);
                let (f, m) = (view.channels[i], map.channels[j]);
                sum += (0..4).map(|k| f64::from(f[k]) * f64::from(m[k])).sum::<f64>() / f64::from(CHANNEL_ONE).powi(2);
                variance += f64::from(view.energy[i]) * f64::from(map.energy[j]) / f64::from(ENERGY_ONE).powi(2);
            }
        }
        (sum / variance.sqrt()) as f32
    }

    #[test]
    fn agrees_with_the_definition_and_peaks_where_the_view_was_cut() {
        let ground = noise(90, 70, 5);
        let map = Structure::new(&ground, &Mask::filled(90, 70, true));
        let views = [cut(&ground, 31, 17, 40, 30), cut(&ground, 12, 33, 38, 31)];
        let coarse = CoarseMap::new(&map, Reach::from_views(&views));
        let [columns, rows] = coarse.places();
        assert_eq!([columns, rows], [90 + 1 - 40, 70 + 1 - 31]);
        let mut fourier = coarse.fourier();
        for (k, corner) in [(0, [31usize, 17usize]), (1, [12, 33])] {
            let normalisation = coarse.normalisation(&mut fourier, &views[k]).unwrap();
            let surface = &coarse.correlate(&mut fourier, [&views[0], &views[1]], &normalisation)[k];
            for (x, y) in [(0, 0), (31, 17), (50, 39), (7, 33), (12, 33)] {
                let (fast, slow) = (surface.values[y * columns + x], brute_force(&map, &views[k].structure, x, y));
                assert!((fast - slow).abs() < 1e-2 * slow.abs().max(1.0), "{k} {x} {y}: {fast} {slow}");
            }
            let best = (0..surface.values.len()).max_by(|&a, &b| surface.values[a].total_cmp(&surface.values[b]));
            assert_eq!(best.map(|b| [b % columns, b / columns]), Some(corner));
        }
    }

    /// A camera that looks aside shows ground far from its nadir.
    #[test]
    fn finds_a_view_whose_nadir_lies_far_outside_it() {
        let ground = noise(90, 70, 8);
        let map = Structure::new(&ground, &Mask::filled(90, 70, true));
        let views = [PlacedView { nadir_px: [-200, 310], ..cut(&ground, 31, 17, 40, 30) }];
        let reach = Reach::from_views(&views);
        assert_eq!((reach.width_px(), reach.height_px()), (40, 30));
        let coarse = CoarseMap::new(&map, reach);
        let mut fourier = coarse.fourier();
        let normalisation = coarse.normalisation(&mut fourier, &views[0]).unwrap();
        let [surface, _] = coarse.correlate(&mut fourier, [&views[0], &views[0]], &normalisation);
        let best = (0..surface.values.len()).max_by(|&a, &b| surface.values[a].total_cmp(&surface.values[b]));
        let columns = coarse.places()[0];
        assert_eq!(best.map(|b| [b % columns, b / columns]), Some([31, 17]));
    }

    #[test]
    fn a_blank_view_has_no_normalisation() {
        let ground = noise(40, 40, 5);
        let blank = PlacedView {
            structure: Structure::new(&Gray::filled(20, 20, 9.0), &Mask::filled(20, 20, true)),
            nadir_px: [10, 10],
        };
        let views = [blank];
        let map = CoarseMap::new(&Structure::new(&ground, &Mask::filled(40, 40, true)), Reach::from_views(&views));
        assert!(map.normalisation(&mut map.fourier(), &views[0]).is_none());
    }
}
