//! How much a view looks like itself displaced: the autocorrelation of its structure.
//!
//! A view of an orchard or of a housing estate fits the map one period beside its place as well as at its place. Whether the map
//! shows those other places is another question: they may lie beyond the searched region, or the map may be out of date there.

use super::fourier::{Fourier, Plans, quick_length};
use crate::feature::Structure;
use rustfft::num_complex::Complex32;

/// A view displaced by more than this share of its edge shares too little with itself.
const MOST_DISPLACED: f64 = 0.6;
/// Both parts of the view that lie on each other must hold at least this share of its energy (geometric mean).
const LEAST_ENERGY: f64 = 0.25;

/// The highest normalised autocorrelation of a view's structure (0 to 1) at displacements of at least `apart_px` pixels that leave a
/// quarter of the view, by energy, on itself. 0 where the view holds no structure.
pub fn self_similarity(view: &Structure, apart_px: f64) -> f64 {
    let most = |extent: usize| (MOST_DISPLACED * extent as f64) as isize;
    let (most_x, most_y) = (most(view.width_px), most(view.height_px));
    let correlation = Autocorrelation::new(view, [most_x as usize, most_y as usize]);
    let energies = BoxSums::new(view);
    let least = (LEAST_ENERGY * energies.total()).max(1.0);
    // The autocorrelation is even: half of the plane tells all.
    let displacements = (0..=most_y).flat_map(|dy| (-most_x..=most_x).map(move |dx| [dx, dy]));
    let values =
        displacements.filter(|[dx, dy]| (*dx as f64).hypot(*dy as f64) >= apart_px).filter_map(|displacement| {
            let norm = energies.norm(displacement);
            (norm >= least).then(|| correlation.at(displacement) / norm)
        });
    values.fold(0.0, f64::max)
}

/// Sums of a view's products with itself at every displacement.
struct Autocorrelation {
    plane: Vec<Complex32>,
    size: [usize; 2],
}

impl Autocorrelation {
    /// For displacements of at most `most` pixels (columns, rows).
    fn new(view: &Structure, most: [usize; 2]) -> Self {
        let (wide, high) = (quick_length(view.width_px + most[0]), quick_length(view.height_px + most[1]));
        let mut fourier = Fourier::new(&Plans::new(wide, high));
        // The real part of conj(f) f, over both channels: the spectra of their products add up.
        let mut spectrum = |first: usize| {
            let mut plane = fourier.plane();
            plane.fill(Complex32::new(0.0, 0.0));
            for (row, channels) in plane.chunks_exact_mut(wide).zip(view.channels.chunks_exact(view.width_px)) {
                for (value, c) in row.iter_mut().zip(channels) {
                    *value = Complex32::new(f32::from(c[first]), f32::from(c[first + 1]));
                }
            }
            fourier.forward(&mut plane, 0..view.height_px);
            plane
        };
        let (doubled, quadrupled) = (spectrum(0), spectrum(2));
        let power = |(a, b): (&Complex32, &Complex32)| Complex32::new(a.norm_sqr() + b.norm_sqr(), 0.0);
        let mut plane: Vec<Complex32> = doubled.iter().zip(&quadrupled).map(power).collect();
        fourier.inverse(&mut plane, most[1] + 1);
        Self { plane, size: [wide, high] }
    }

    fn at(&self, [dx, dy]: [isize; 2]) -> f64 {
        let [wide, high] = self.size;
        let column = dx.rem_euclid(wide as isize) as usize;
        f64::from(self.plane[dy as usize * wide + column].re) / (wide * high) as f64
    }
}

/// Sums of squared moduli over boxes from a corner of a view.
struct BoxSums {
    sums: Vec<u64>,
    width: usize,
    height: usize,
}

impl BoxSums {
    fn new(view: &Structure) -> Self {
        let (width, height) = (view.width_px, view.height_px);
        let mut sums = vec![0u64; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = 0;
            for x in 0..width {
                row += view.channels[y * width + x].iter().map(|&v| i64::from(v).pow(2) as u64).sum::<u64>();
                sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
            }
        }
        Self { sums, width, height }
    }

    fn total(&self) -> f64 {
        self.within([0, self.width], [0, self.height])
    }

    fn within(&self, [left, right]: [usize; 2], [top, bottom]: [usize; 2]) -> f64 {
        let at = |x: usize, y: usize| self.sums[y * (self.width + 1) + x];
        (at(right, bottom) + at(left, top) - at(left, bottom) - at(right, top)) as f64
    }

    /// The geometric mean of the energies of the parts that lie on each other when the view is displaced by (dx, dy), dy not negative.
    fn norm(&self, [dx, dy]: [isize; 2]) -> f64 {
        let (before, after, dy) = ((-dx).max(0) as usize, dx.max(0) as usize, dy as usize);
        let own = self.within([before, self.width - after], [0, self.height - dy]);
        let other = self.within([after, self.width - before], [dy, self.height]);
        (own * other).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixels::{Gray, Mask};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A view of 90 x 70 px of discs at random places that repeat after `period` columns, with noise.
    fn view(period: usize) -> Structure {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut draw = |most: f64| rng.random_range(0.0..most);
        let discs: Vec<[f64; 4]> = (0..150).map(|_| [draw(240.0), draw(70.0), 3.0 + draw(6.0), draw(120.0)]).collect();
        let value = |x: usize, y: usize| {
            let (x, y) = ((x % period) as f64, y as f64);
            let covers = |d: &&[f64; 4]| (x - d[0]).hypot(y - d[1]) < d[2];
            discs.iter().filter(covers).map(|d| d[3]).sum::<f64>() as f32
        };
        let noisy = (0..90 * 70).map(|i| value(i % 90, i / 90) + rng.random_range(0.0..20.0)).collect();
        Structure::new(&Gray::from_values(90, 70, noisy).unwrap(), &Mask::filled(90, 70, true))
    }

    #[test]
    fn a_view_that_repeats_itself_is_told_from_one_that_does_not() {
        let (repeating, unique, too_long) = (view(30), view(240), view(66));
        // Without noise it would be 1.
        assert!(self_similarity(&repeating, 4.0) > 0.6, "{}", self_similarity(&repeating, 4.0));
        assert!(self_similarity(&unique, 4.0) < 0.3, "{}", self_similarity(&unique, 4.0));
        // Its period of 66 px leaves 24 of 90 columns on themselves.
        assert!(self_similarity(&too_long, 4.0) < 0.3);
    }

    #[test]
    fn is_what_the_definition_gives() {
        let view = view(40);
        let (width, height) = (view.width_px as isize, view.height_px as isize);
        let f = |x: isize, y: isize| view.channels[(y * width + x) as usize].map(f64::from);
        let dot = |a: [f64; 4], b: [f64; 4]| (0..4).map(|k| a[k] * b[k]).sum::<f64>();
        let correlation = Autocorrelation::new(&view, [54, 42]);
        let energies = BoxSums::new(&view);
        for [dx, dy] in [[0, 0], [7, 0], [-13, 5], [40, 2], [-54, 42], [3, 42]] {
            let inside = |x: isize, y: isize| (0..width).contains(&x) && (0..height).contains(&y);
            let (mut products, mut own, mut other) = (0.0, 0.0, 0.0);
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                if inside(x + dx, y + dy) {
                    let (a, b) = (f(x, y), f(x + dx, y + dy));
                    products += dot(a, b);
                    own += dot(a, a);
                    other += dot(b, b);
                }
            }
            let found = (correlation.at([dx, dy]), energies.norm([dx, dy]));
            assert!((found.0 - products).abs() < 1e-5 * energies.total(), "{found:?} {products}");
            assert!((found.1 - (own * other).sqrt()).abs() < 1e-6 * energies.total());
        }
    }

    #[test]
    fn nothing_is_not_similar() {
        assert_eq!(self_similarity(&Structure::unknown(40, 30), 3.0), 0.0);
        assert_eq!(self_similarity(&Structure::unknown(1, 1), 3.0), 0.0);
    }
}
