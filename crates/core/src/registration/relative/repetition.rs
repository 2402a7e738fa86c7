//! The test of a motion against its rivals: ground that repeats itself, an overlay, and other things that fit two ways.
//!
//! Where another motion explains the pair nearly as well as the one found, none is measured. On real ground a second motion
//! explains nothing, so most pairs pass the first, cheap test: few matches agree on anything else.
//!
//! # References
//! The paired comparison with its jackknife over blocks: Efron, *The Jackknife, the Bootstrap and Other Resampling Plans*
//! (1982).

use super::alignment::align;
use super::keypoint_match::KeypointMatch;
use crate::pixels::Gray;
use crate::registration::fourier::{Fourier, Plans, quick_length};
use crate::registration::similarity::Similarity;
use crate::registration::stationary::StillBlocks;
use nalgebra::Vector2;
use rustfft::num_complex::Complex32;

/// Matches against the motion agree with each other within this distance, pixels of a,
const CLUSTER_PX: f64 = 3.0;
/// and a motion that at least this many of them support may be a rival,
const LEAST_CLUSTER: usize = 4;
/// or where fewer than this share of the matches in the overlap are inliers.
const CLEAR_SHARE: f64 = 0.5;
/// Rivals are found on frames of at most this edge, px.
const COARSE_EDGE_PX: f64 = 128.0;
/// A place of the coarse correlation is a rival where it has at least this share of the highest,
const RIVAL_SHARE: f64 = 0.4;
/// lies at least this far from the motion found, coarse pixels,
const RIVAL_APART_PX: f64 = 2.5;
/// and at least this share of b lies in a.
const LEAST_OVERLAP: f64 = 0.08;
/// A surface above the ground moves farther, one below it less far, along the motion: by these shares of it,
const PARALLAX_BOUNDS: (f64, f64) = (-0.2, 0.5);
/// with this share of itself across.
const PARALLAX_SLACK: f64 = 0.15;
/// Relief shifts by less than this in any direction, pixels of a.
const RELIEF_PX: f64 = 10.0;
/// Such a shift is a rival only where its blocks correlate by this: ground that repeats itself does, roofs do not.
const REPEATED_CORRELATION: f64 = 0.65;
/// A rival explains something where its blocks correlate by at least this in the mean,
const LEAST_CORRELATION: f64 = 0.45;
/// or where at least this share as many matches support it as support the motion. Trees from two sides correlate little under any
/// motion, and then a rival by brightness says nothing.
const LEAST_SUPPORT: f64 = 0.25;
/// Where the corners move by less than this, pixels of a, nothing does,
const STILL_PX: f64 = 1.0;
/// and at least this share of the blocks that show something stands still.
const STILL_SHARE: f64 = 0.6;
/// Rivals that are compared.
const MOST_RIVALS: usize = 12;
/// Edge of a block in the comparison, pixels of b, and the step of its samples.
const BLOCK_PX: usize = 24;
const SAMPLE_PX: usize = 3;
/// Fewest blocks that decide.
const LEAST_BLOCKS: usize = 6;
/// The motion must be better than each rival by this many standard errors.
const LEAST_T: f64 = 4.0;
/// A block with a smaller standard deviation in b shows nothing, gray levels.
const LEAST_DEVIATION: f64 = 2.0;

/// How much better a motion explains the pair than the nearest rival, in standard errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RivalComparison {
    /// The rival's displacement from the motion, pixels of a.
    pub apart_px: [f64; 2],
    /// Difference of the mean correlations over its standard error.
    pub t: f64,
}

impl RivalComparison {
    /// Whether the rival explains the pair so well that no motion is measured.
    pub fn is_ambiguous(self) -> bool {
        self.t < LEAST_T
    }
}

/// Compares a motion with its rivals, and returns the comparison with the strongest one. `None`: no rival, or the matches leave
/// no room for one. `above`: the matches of a surface above the ground, which explains itself by parallax.
pub fn strongest_rival(
    a: &Gray,
    b: &Gray,
    found: &Similarity,
    centre_of_b: Vector2<f64>,
    matches: &[KeypointMatch],
    above: &[usize],
) -> Option<RivalComparison> {
    let size = Vector2::new(a.width_px() as f64, a.height_px() as f64);
    let residual = |m: &KeypointMatch| m.a - found.apply(m.b);
    let is_shared = |i: &usize| is_within(found.apply(matches[*i].b), size) && above.binary_search(i).is_err();
    let off: Vec<Vector2<f64>> = (0..matches.len()).filter(is_shared).map(|i| residual(&matches[i])).collect();
    let others: Vec<Vector2<f64>> = off.iter().copied().filter(|r| r.norm() > 2.0 * CLUSTER_PX).collect();
    let clusters = clusters(&others);
    let inliers = off.iter().filter(|r| r.norm() <= CLUSTER_PX).count();
    if clusters.is_empty() && inliers as f64 >= CLEAR_SHARE * off.len() as f64 {
        return None;
    }
    let least_support = LEAST_SUPPORT * inliers as f64;
    let mut shifts: Vec<(Vector2<f64>, bool)> =
        clusters.into_iter().map(|(shift, support)| (shift, support as f64 >= least_support)).collect();
    shifts.extend(correlated_shifts(a, b, found).into_iter().map(|shift| (shift, false)));
    shifts.truncate(MOST_RIVALS);
    let own = block_correlations(a, b, found);
    let displacement = found.apply(centre_of_b) - size / 2.0;
    let compared = shifts.iter().filter_map(|(shift, is_supported)| {
        let start = Similarity { t: found.t + shift, ..*found };
        let rival = align(a, b, &start, centre_of_b, false).map_or(start, |aligned| aligned.a_from_b);
        let apart = rival.apply(centre_of_b) - found.apply(centre_of_b);
        (apart.norm() > CLUSTER_PX).then_some(())?;
        let blocks = block_correlations(a, b, &rival);
        let mean = mean_correlation(&own, &blocks)?;
        let is_relief = apart.norm() < RELIEF_PX || is_parallax(apart, displacement);
        let needed = if is_relief { REPEATED_CORRELATION } else { LEAST_CORRELATION };
        (mean >= needed || *is_supported && needed < REPEATED_CORRELATION).then_some(())?;
        Some(RivalComparison { apart_px: apart.into(), t: paired_t(&own, &blocks)? })
    });
    compared.min_by(|p, q| p.t.total_cmp(&q.t))
}

/// Whether a surface above or below the ground can move so much more or less than the ground, which moves by `displacement`.
fn is_parallax(shift: Vector2<f64>, displacement: Vector2<f64>) -> bool {
    let length = displacement.norm().max(1e-9);
    let along = shift.dot(&displacement) / length;
    let across = (shift - displacement * (along / length)).norm();
    (PARALLAX_BOUNDS.0 * length..=PARALLAX_BOUNDS.1 * length).contains(&along)
        && across <= CLUSTER_PX + PARALLAX_SLACK * along.abs()
}

fn is_within(p: Vector2<f64>, size: Vector2<f64>) -> bool {
    p.x > 0.0 && p.y > 0.0 && p.x < size.x && p.y < size.y
}

/// Whether a motion of nothing is that of a part that stands still, an overlay or a wing, while the rest moves.
pub fn is_of_a_still_part(a: &Gray, b: &Gray, found: &Similarity) -> bool {
    let (width, height) = (b.width_px() as f64, b.height_px() as f64);
    let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]].map(Vector2::from);
    corners.iter().all(|corner| (found.apply(*corner) - corner).norm() < STILL_PX)
        && StillBlocks::compare(a, b).is_some_and(|blocks| blocks.still_share(&[]) < STILL_SHARE)
}

/// The means of the clusters of residuals and their sizes, the largest first.
fn clusters(residuals: &[Vector2<f64>]) -> Vec<(Vector2<f64>, usize)> {
    let mut left: Vec<Vector2<f64>> = residuals.to_vec();
    let mut found = Vec::new();
    while found.len() < MOST_RIVALS / 2 {
        let near = |p: &Vector2<f64>| left.iter().filter(|q| (*q - p).norm() <= CLUSTER_PX).count();
        // The first of the largest: the same matches give the same clusters.
        let Some((count, centre)) = left.iter().map(|p| (near(p), *p)).rev().max_by_key(|(count, _)| *count) else {
            break;
        };
        if count < LEAST_CLUSTER {
            break;
        }
        let members = || left.iter().filter(|q| (*q - centre).norm() <= CLUSTER_PX);
        found.push((members().sum::<Vector2<f64>>() / count as f64, count));
        left.retain(|q| (q - centre).norm() > 2.0 * CLUSTER_PX);
    }
    found
}

/// The displacements from the motion at which b, turned and scaled as found, correlates with a nearly as well: the maxima of the
/// normalised correlation of coarse frames, the highest first.
fn correlated_shifts(a: &Gray, b: &Gray, found: &Similarity) -> Vec<Vector2<f64>> {
    let edge_px = ((a.width_px() * a.height_px()) as f64).sqrt();
    let factor = (edge_px / COARSE_EDGE_PX).ceil().max(1.0) as usize;
    let coarse_a = a.binned(factor);
    let coarse_b = b.binned(factor);
    let similarity = found.in_pixels(factor as f64, factor as f64);
    let (width, height) = (coarse_a.width_px(), coarse_a.height_px());
    // b as it lies on a by the motion, a's size on each side around it.
    let (wide, high) = (quick_length(3 * width), quick_length(3 * height));
    let (c, s) = (similarity.c, similarity.s);
    let determinant = c * c + s * s;
    let place = |i: usize| -> Option<f32> {
        let p = Vector2::new((i % wide) as f64 + 0.5 - width as f64, (i / wide) as f64 + 0.5 - height as f64);
        let q = p - similarity.t;
        let (x, y) = ((c * q.x + s * q.y) / determinant, (c * q.y - s * q.x) / determinant);
        let is_in = x > 0.5 && y > 0.5 && x < coarse_b.width_px() as f64 - 0.5 && y < coarse_b.height_px() as f64 - 0.5;
        is_in.then(|| coarse_b.sample(x, y))
    };
    let placed: Vec<Option<f32>> = (0..wide * high).map(place).collect();
    peaks(&correlation_surface(&coarse_a, &placed, [wide, high]), [wide, high], [width, height], factor as f64)
}

/// Normalised correlation of a with the placed b at every displacement (cyclic), 0 where too little of a is covered.
fn correlation_surface(a: &Gray, placed: &[Option<f32>], [wide, high]: [usize; 2]) -> Vec<f32> {
    let mean = a.values().iter().sum::<f32>() / a.values().len().max(1) as f32;
    let count = placed.iter().flatten().count().max(1);
    let mean_b = placed.iter().flatten().sum::<f32>() / count as f32;
    let of_a = |i: usize| {
        let (x, y) = (i % wide, i / wide);
        (x < a.width_px() && y < a.height_px()).then(|| a.at(x, y) - mean)
    };
    let mut fourier = Fourier::new(&Plans::new(wide, high));
    // Two real planes in one complex one: values, and where there are values.
    let mut spectrum = |value: &dyn Fn(usize) -> Option<f32>, power: i32| {
        let mut plane: Vec<Complex32> = (0..wide * high)
            .map(|i| value(i).map_or(Complex32::new(0.0, 0.0), |v| Complex32::new(v.powi(power), 0.0)))
            .collect();
        fourier.forward(&mut plane, 0..high);
        plane
    };
    let of_b = |i: usize| placed[i].map(|v| v - mean_b);
    let [a0, a1, a2] = [0, 1, 2].map(|power| spectrum(&of_a, power));
    let [b0, b1, b2] = [0, 1, 2].map(|power| spectrum(&of_b, power));
    let mut correlate = |p: &[Complex32], q: &[Complex32]| {
        let mut product: Vec<Complex32> = p.iter().zip(q).map(|(p, q)| p.conj() * q).collect();
        fourier.inverse(&mut product, high);
        let norm = 1.0 / (wide * high) as f32;
        product.into_iter().map(|v| v.re * norm).collect::<Vec<f32>>()
    };
    let (n, ab) = (correlate(&a0, &b0), correlate(&a1, &b1));
    let (sum_a, sum_b) = (correlate(&a1, &b0), correlate(&a0, &b1));
    let (aa, bb) = (correlate(&a2, &b0), correlate(&a0, &b2));
    let least = (LEAST_OVERLAP * (a.width_px() * a.height_px()) as f64) as f32;
    let value = |i: usize| {
        if n[i] < least {
            return 0.0;
        }
        let (var_a, var_b) = (aa[i] - sum_a[i] * sum_a[i] / n[i], bb[i] - sum_b[i] * sum_b[i] / n[i]);
        let product = var_a * var_b;
        if product > (n[i] * n[i]).max(1.0) { (ab[i] - sum_a[i] * sum_b[i] / n[i]) / product.sqrt() } else { 0.0 }
    };
    (0..wide * high).map(value).collect()
}

/// The displacements of the maxima from the motion, pixels of a.
fn peaks(surface: &[f32], [wide, high]: [usize; 2], own: [usize; 2], factor: f64) -> Vec<Vector2<f64>> {
    let at = |x: usize, y: usize| surface[(y % high) * wide + x % wide];
    let own_value = at(own[0], own[1]);
    let least = RIVAL_SHARE as f32 * own_value.max(0.1);
    let mut found: Vec<(f32, Vector2<f64>)> = Vec::new();
    for y in 0..high {
        for x in 0..wide {
            let value = at(x, y);
            let is_peak = value >= least && (0..9).all(|k| at(x + wide + k % 3 - 1, y + high + k / 3 - 1) <= value);
            // b's plane is read at the displacement plus a's size: moving b back by as much lays it on a.
            let signed = |v: usize, own: usize, n: usize| {
                let d = own as f64 - v as f64;
                if d < -(n as f64) / 2.0 { d + n as f64 } else { d }
            };
            let shift = Vector2::new(signed(x, own[0], wide), signed(y, own[1], high));
            if is_peak && shift.norm() >= RIVAL_APART_PX {
                found.push((value, shift * factor));
            }
        }
    }
    found.sort_by(|p, q| q.0.total_cmp(&p.0));
    found.into_iter().map(|(_, shift)| shift).take(MOST_RIVALS).collect()
}

/// Correlation of each block of b with a under a motion; `None` where the block leaves a or shows nothing.
fn block_correlations(a: &Gray, b: &Gray, a_from_b: &Similarity) -> Vec<Option<f64>> {
    let (columns, rows) = (b.width_px() / BLOCK_PX, b.height_px() / BLOCK_PX);
    let one = |i: usize| {
        let corner = [i % columns * BLOCK_PX, i / columns * BLOCK_PX];
        block_correlation(a, b, a_from_b, corner)
    };
    (0..columns * rows).map(one).collect()
}

fn block_correlation(a: &Gray, b: &Gray, a_from_b: &Similarity, [left, top]: [usize; 2]) -> Option<f64> {
    let size = Vector2::new(a.width_px() as f64, a.height_px() as f64);
    let (mut n, mut sum_a, mut sum_b, mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for y in (top + 1..top + BLOCK_PX).step_by(SAMPLE_PX) {
        for x in (left + 1..left + BLOCK_PX).step_by(SAMPLE_PX) {
            let p = a_from_b.apply(Vector2::new(x as f64 + 0.5, y as f64 + 0.5));
            if !is_within(p, size) {
                return None;
            }
            let (u, v) = (f64::from(a.sample(p.x, p.y)), f64::from(b.at(x, y)));
            n += 1.0;
            sum_a += u;
            sum_b += v;
            aa += u * u;
            bb += v * v;
            ab += u * v;
        }
    }
    let (var_a, var_b) = (aa - sum_a * sum_a / n, bb - sum_b * sum_b / n);
    if var_b < n * LEAST_DEVIATION.powi(2) {
        return None;
    }
    Some(if var_a > 0.0 { (ab - sum_a * sum_b / n) / (var_a * var_b).sqrt() } else { 0.0 })
}

/// The rival's mean correlation over the blocks that both have; `None` with too few of them.
fn mean_correlation(own: &[Option<f64>], rival: &[Option<f64>]) -> Option<f64> {
    let common: Vec<f64> = own.iter().zip(rival).filter_map(|(p, q)| p.and(*q)).collect();
    (common.len() >= LEAST_BLOCKS).then(|| common.iter().sum::<f64>() / common.len() as f64)
}

/// The mean difference of the blocks that both have, over its standard error; `None` with too few blocks in common.
fn paired_t(own: &[Option<f64>], rival: &[Option<f64>]) -> Option<f64> {
    let differences: Vec<f64> = own.iter().zip(rival).filter_map(|(p, q)| Some((*p)? - (*q)?)).collect();
    let n = differences.len() as f64;
    if differences.len() < LEAST_BLOCKS {
        return None;
    }
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    // Without scatter equal motions are no better than each other.
    Some(if mean.abs() < 1e-9 { 0.0 } else { mean / (variance / n).sqrt().max(1e-9) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_are_found_in_order_of_size() {
        let mut residuals = vec![Vector2::new(40.0, 0.0); 9];
        residuals.extend(vec![Vector2::new(0.0, 40.5); 5]);
        residuals.extend([Vector2::new(100.0, 3.0), Vector2::new(-50.0, 9.0)]);
        let found = clusters(&residuals);
        assert_eq!(found, [(Vector2::new(40.0, 0.0), 9), (Vector2::new(0.0, 40.5), 5)]);
    }

    #[test]
    fn a_shift_along_the_motion_may_be_a_roof() {
        let motion = Vector2::new(0.0, -128.0);
        for shift in [[-2.0, -45.0], [1.0, 9.0], [2.0, -4.0]] {
            assert!(is_parallax(shift.into(), motion), "{shift:?}");
        }
        for shift in [[30.0, -45.0], [0.0, -90.0], [0.0, 60.0], [40.0, 0.0]] {
            assert!(!is_parallax(shift.into(), motion), "{shift:?}");
        }
    }

    #[test]
    fn the_better_motion_stands_out_by_its_blocks() {
        let own: Vec<_> = (0..30).map(|i| Some(0.9 + 0.001 * f64::from(i % 5))).collect();
        let other: Vec<_> = (0..30).map(|i| Some(0.1 * f64::from(i % 7) - 0.3)).collect();
        assert!(paired_t(&own, &other).unwrap() > 10.0 && paired_t(&own, &own) == Some(0.0));
        assert!(paired_t(&other, &own).unwrap() < -10.0 && paired_t(&own[..4], &other[..4]).is_none());
    }
}
