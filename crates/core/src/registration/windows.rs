//! Window matching: finds small pieces of a view on the map, each on its own, to a fraction of a pixel.

use super::products::{BoxCorner, CHANNELS_SCALE, EnergyIntegral, channels_in_box};
use crate::feature::{ENERGY_ONE, Structure};
use nalgebra::{Matrix2, Vector2};

/// Layout and search of the windows.
#[derive(Debug, Clone, Copy)]
pub struct WindowOptions {
    /// Edge of a window, pixels.
    pub size_px: usize,
    /// Distance from one window's corner to the next, pixels; at least `size_px` keeps them independent.
    pub stride_px: usize,
    /// Search radius, pixels.
    pub radius_px: usize,
    /// Displacements are tried at multiples of this, pixels, then the neighbours of the best: 2 where the place is known to
    /// half a pixel, so that a right window lies near one of them; else 1.
    pub step_px: usize,
}

/// One window of the view and the place where it was found.
#[derive(Debug, Clone, Copy)]
pub struct WindowMatch {
    /// The window's middle in the view, pixels from its corner.
    pub centre_px: [f64; 2],
    /// Place found minus place expected, pixels.
    pub displacement_px: Vector2<f64>,
    /// Normalised correlation at the peak, in [-1, 1].
    pub peak: f64,
    /// Minus the Hessian of the correlation at the peak, per px^2: the information on each direction. Positive definite.
    pub information: Matrix2<f64>,
    /// Whether the peak lies on the rim of the search square; the true peak may then lie outside.
    pub on_rim: bool,
}

impl WindowMatch {
    fn new(centre_px: [f64; 2], peak: &SubpixelPeak, radius_px: usize) -> Self {
        Self {
            centre_px,
            displacement_px: peak.position - Vector2::repeat(radius_px as f64),
            peak: peak.value,
            information: peak.information,
            on_rim: peak.on_rim,
        }
    }
}

/// Windows with less mean energy than this are left out.
const LEAST_ENERGY: f64 = 0.06;
/// Least information of any direction, as a share of the largest.
const LEAST_INFORMATION: f64 = 0.02;

/// Matches every window of `view` that has structure. View pixel p is expected at map pixel p + `offset_px`. A window is
/// left out where the map does not reach `radius_px` beyond it.
pub fn match_windows(
    view: &Structure,
    map: &Structure,
    offset_px: [isize; 2],
    options: &WindowOptions,
) -> Vec<WindowMatch> {
    let search = WindowSearch::new(view, map, offset_px);
    let mut scores = Vec::new();
    corners(view, options).filter_map(|corner| search.window(options, corner, &mut scores)).collect()
}

/// The correlation of one window of the view over its search square.
#[derive(Debug, Clone)]
pub struct WindowSurface {
    /// The window's middle in the view, pixels from its corner.
    pub centre_px: [f64; 2],
    /// Normalised correlation at each displacement, in their order.
    pub scores: Vec<f32>,
}

impl WindowSurface {
    /// The match of a window whose surface covers its whole search square, row by row; `None` where nothing correlates.
    pub fn matched(&self, radius_px: usize) -> Option<WindowMatch> {
        let peak = subpixel_peak(&self.scores, 2 * radius_px + 1)?;
        Some(WindowMatch::new(self.centre_px, &peak, radius_px))
    }
}

/// The surfaces of the windows that [`match_windows`] matches, over their whole search squares, row by row.
pub fn square_surfaces(
    view: &Structure,
    map: &Structure,
    offset_px: [isize; 2],
    options: &WindowOptions,
) -> Vec<WindowSurface> {
    let radius = options.radius_px as isize;
    let square: Vec<_> = (-radius..=radius).flat_map(|y| (-radius..=radius).map(move |x| [x, y])).collect();
    window_surfaces(view, map, offset_px, options, &square)
}

/// The surfaces of the windows that [`match_windows`] matches, over displacements of at most the radius on each axis.
pub fn window_surfaces(
    view: &Structure,
    map: &Structure,
    offset_px: [isize; 2],
    options: &WindowOptions,
    displacements_px: &[[isize; 2]],
) -> Vec<WindowSurface> {
    let search = WindowSearch::new(view, map, offset_px);
    let in_square = |displacement: &[isize; 2]| displacement.map(|d| (d + options.radius_px as isize) as usize);
    let surface = |corner: BoxCorner| {
        let score = search.scorer(options, corner)?;
        let scores = displacements_px.iter().map(in_square).map(score).collect();
        Some(WindowSurface { centre_px: middle_px(corner, options.size_px), scores })
    };
    corners(view, options).filter_map(surface).collect()
}

/// The upper left corners of the windows of a view.
fn corners(view: &Structure, options: &WindowOptions) -> impl Iterator<Item = BoxCorner> {
    let WindowOptions { size_px, stride_px, .. } = *options;
    let width_px = view.width_px;
    // The grid is centred so that what is cut off is the same on both sides.
    let starts = move |extent: usize| {
        let count = if extent < size_px { 0 } else { (extent - size_px) / stride_px + 1 };
        let first = if count == 0 { 0 } else { (extent - size_px - (count - 1) * stride_px) / 2 };
        (0..count).map(move |i| first + i * stride_px)
    };
    starts(view.height_px).flat_map(move |y_px| starts(width_px).map(move |x_px| BoxCorner { x_px, y_px }))
}

fn middle_px(corner: BoxCorner, size_px: usize) -> [f64; 2] {
    [corner.x_px, corner.y_px].map(|corner_px| corner_px as f64 + size_px as f64 / 2.0)
}

/// The inputs that all windows of one view share.
struct WindowSearch<'a> {
    view: &'a Structure,
    map: &'a Structure,
    view_energy: EnergyIntegral,
    map_energy: EnergyIntegral,
    offset_px: [isize; 2],
}

impl<'a> WindowSearch<'a> {
    fn new(view: &'a Structure, map: &'a Structure, offset_px: [isize; 2]) -> Self {
        let (view_energy, map_energy) = (EnergyIntegral::new(view), EnergyIntegral::new(map));
        Self { view, map, view_energy, map_energy, offset_px }
    }

    /// Matches one window; `None` where there is no [`WindowSearch::scorer`]. `scores` is scratch.
    fn window(&self, options: &WindowOptions, corner: BoxCorner, scores: &mut Vec<f32>) -> Option<WindowMatch> {
        let radius = options.radius_px;
        score_places(scores, radius, options.step_px, &mut self.scorer(options, corner)?);
        let peak = subpixel_peak(scores, 2 * radius + 1)?;
        Some(WindowMatch::new(middle_px(corner, options.size_px), &peak, radius))
    }

    /// The normalised correlation of a window as a function of its place in the search square, from the square's corner. `None` where
    /// the window has no structure or the map does not reach far enough.
    fn scorer(&self, options: &WindowOptions, corner: BoxCorner) -> Option<impl FnMut([usize; 2]) -> f32> {
        let (size, radius) = (options.size_px, options.radius_px);
        let least = LEAST_ENERGY * (size * size) as f64 * f64::from(ENERGY_ONE);
        let view_energy = f64::from(self.view_energy.in_box(corner, [size; 2]));
        if view_energy < least {
            return None;
        }
        let left = corner.x_px as isize + self.offset_px[0] - radius as isize;
        let top = corner.y_px as isize + self.offset_px[1] - radius as isize;
        let reach = (size + 2 * radius) as isize;
        let (map_w, map_h) = (self.map.width_px as isize, self.map.height_px as isize);
        if left < 0 || top < 0 || left + reach > map_w || top + reach > map_h {
            return None;
        }
        Some(move |[x, y]: [usize; 2]| {
            let at = BoxCorner { x_px: left as usize + x, y_px: top as usize + y };
            let map_energy = f64::from(self.map_energy.in_box(at, [size; 2]));
            if map_energy < 0.5 * least {
                return 0.0;
            }
            let sum = f64::from(channels_in_box(self.view, corner, self.map, at, [size; 2])) / CHANNELS_SCALE;
            // Both channels together have twice the mean energy.
            (sum * f64::from(ENERGY_ONE) / (2.0 * (view_energy * map_energy).sqrt())) as f32
        })
    }
}

/// The score of a displacement that was not tried.
const UNSEEN: f32 = f32::NEG_INFINITY;

/// Fills `scores` of a square of displacements: first at multiples of `step` from the middle, then around the best until no
/// neighbour is better.
fn score_places(scores: &mut Vec<f32>, radius: usize, step: usize, score: &mut impl FnMut([usize; 2]) -> f32) {
    let side = 2 * radius + 1;
    scores.clear();
    scores.resize(side * side, UNSEEN);
    let first = radius % step.max(1);
    for y in (first..side).step_by(step.max(1)) {
        for x in (first..side).step_by(step.max(1)) {
            scores[y * side + x] = score([x, y]);
        }
    }
    loop {
        let Some(best) = highest(scores) else { return };
        let (x, y) = (best % side, best / side);
        for j in y.saturating_sub(1)..(y + 2).min(side) {
            for i in x.saturating_sub(1)..(x + 2).min(side) {
                if scores[j * side + i] == UNSEEN {
                    scores[j * side + i] = score([i, j]);
                }
            }
        }
        if highest(scores) == Some(best) {
            return;
        }
    }
}

fn highest(scores: &[f32]) -> Option<usize> {
    (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]))
}

/// A maximum of the correlation, to a fraction of a pixel.
struct SubpixelPeak {
    position: Vector2<f64>,
    value: f64,
    information: Matrix2<f64>,
    on_rim: bool,
}

/// The highest score and the vertex of the quadratic through its 3 x 3 neighbourhood (least squares).
fn subpixel_peak(scores: &[f32], side: usize) -> Option<SubpixelPeak> {
    let best = highest(scores)?;
    let (x, y) = (best % side, best / side);
    if scores[best] <= 0.0 {
        return None;
    }
    let position = Vector2::new(x as f64, y as f64);
    let value = f64::from(scores[best]);
    if x == 0 || y == 0 || x + 1 == side || y + 1 == side {
        return Some(SubpixelPeak { position, value, information: Matrix2::identity() * 1e-3, on_rim: true });
    }
    let at = |dx: isize, dy: isize| f64::from(scores[(y as isize + dy) as usize * side + (x as isize + dx) as usize]);
    let (mut gx, mut gy, mut hxx, mut hyy) = (0.0, 0.0, 0.0, 0.0);
    for k in -1..=1 {
        gx += (at(1, k) - at(-1, k)) / 6.0;
        gy += (at(k, 1) - at(k, -1)) / 6.0;
        hxx += (at(-1, k) - 2.0 * at(0, k) + at(1, k)) / 3.0;
        hyy += (at(k, -1) - 2.0 * at(k, 0) + at(k, 1)) / 3.0;
    }
    let hxy = (at(1, 1) + at(-1, -1) - at(1, -1) - at(-1, 1)) / 4.0;
    let information = made_definite(Matrix2::new(-hxx, -hxy, -hxy, -hyy));
    let step = information.try_inverse()? * Vector2::new(gx, gy);
    let step = step.map(|v| v.clamp(-1.0, 1.0));
    Some(SubpixelPeak { position: position + step, value, information, on_rim: false })
}

/// The nearest matrix whose eigenvalues are positive and at least [`LEAST_INFORMATION`] of the largest.
fn made_definite(m: Matrix2<f64>) -> Matrix2<f64> {
    let eigen = m.symmetric_eigen();
    let largest = eigen.eigenvalues.max().max(1e-6);
    let values = eigen.eigenvalues.map(|v| v.max(LEAST_INFORMATION * largest));
    eigen.eigenvectors * Matrix2::from_diagonal(&values) * eigen.eigenvectors.transpose()
}
