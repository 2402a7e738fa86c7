//! The correction of a pose that most windows agree on, and its covariance.
//!
//! The model is a similarity between the view and the map, both in pixels from the pivot (x right, y down). Corrections are
//! small, so the fit works on displacements: the displacement at p is `t + g p + r (-p_y, p_x)`, with a shift t, a growth g
//! of the scale and a rotation r, positive clockwise as seen.

use super::robust::{
    Ending, EstimatorOptions, HypothesisMethod, Observations, Prior, RobustFit, Score, SearchReport, design, estimate,
    refine,
};
use super::similarity::Similarity;
use super::windows::WindowMatch;
use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

/// A correction, and the windows that it was fitted to.
#[derive(Debug, Clone)]
pub struct WindowFit {
    /// Takes a point of the view, px from the pivot, to the map, px from where the pivot was expected. The rotation is
    /// linearised: `s` is the angle in radians, `c` the scale.
    pub map_from_view: Similarity,
    /// Covariance of (t_x, t_y, c, s), from the residuals of the inliers; infinite variances where there are too few.
    pub covariance: Matrix4<f64>,
    /// Windows that agree, by index.
    pub inliers: Vec<usize>,
    /// Root mean square residual per axis of the inliers, px.
    pub rms_px: f64,
    /// How the correction was found.
    pub search: SearchReport,
}

impl WindowFit {
    fn new(fit: RobustFit, search: SearchReport) -> Self {
        let covariance = if fit.unit_variance.is_finite() {
            fit.cofactor * fit.unit_variance
        } else {
            Matrix4::identity() * f64::INFINITY
        };
        let map_from_view = Similarity { c: 1.0 + fit.model.c, ..fit.model };
        Self { map_from_view, covariance, inliers: fit.inliers, rms_px: fit.rms_px, search }
    }

    /// Covariance of the place on the map of a point of the view, px^2: what shift, growth and turn add up to `offset_px` from the
    /// pivot.
    pub fn covariance_at(&self, offset_px: Vector2<f64>) -> Matrix2<f64> {
        let of_place = design(offset_px);
        of_place * self.covariance * of_place.transpose()
    }
}

/// How far a correction may go and which windows agree with it.
#[derive(Debug, Clone, Copy)]
pub struct WindowFitOptions {
    /// A window is an inlier where its residual is at most this, px.
    pub tolerance_px: f64,
    /// Largest change of scale, |c - 1|.
    pub max_growth: f64,
    /// Largest rotation, |s|, radians.
    pub max_turn_rad: f64,
}

/// Most rounds of least squares.
const ROUNDS: usize = 5;
/// A round that leaves fewer inliers than a consensus needs is rejected.
const MIN_KEPT: usize = 3;
/// The prior's standard deviations of growth and rotation, as a share of their bounds: two neighbouring windows alone
/// cannot turn the frame.
const PRIOR_SHARE: f64 = 0.5;

/// Fits the correction with the largest consensus over all pairs of windows, then by least squares over the inliers, each
/// window weighted by its information. `pivot_px` is the point where the shift is stated (the nadir), in the view's pixels.
/// `None` with fewer than two windows.
pub fn fit_windows(matches: &[WindowMatch], pivot_px: [f64; 2], options: &WindowFitOptions) -> Option<WindowFit> {
    let observations = Displacements { matches, pivot_px: Vector2::from(pivot_px), options };
    // Nothing is drawn: the seed has no effect.
    let (fit, search) = estimate(&observations, &estimator_options(options), 1)?;
    Some(WindowFit::new(fit, search))
}

/// As [`fit_windows`], about a given correction instead of the largest consensus.
pub fn fit_windows_about(
    start: &Similarity,
    matches: &[WindowMatch],
    pivot_px: [f64; 2],
    options: &WindowFitOptions,
) -> Option<WindowFit> {
    let observations = Displacements { matches, pivot_px: Vector2::from(pivot_px), options };
    let start = Similarity { c: start.c - 1.0, ..*start };
    let fit = refine(&observations, &start, &estimator_options(options))?;
    let search = SearchReport { method: HypothesisMethod::AllPairs, trials: 0, inliers: fit.inliers.len(), seed: 1 };
    Some(WindowFit::new(fit, search))
}

fn estimator_options(options: &WindowFitOptions) -> EstimatorOptions {
    EstimatorOptions {
        method: HypothesisMethod::AllPairs,
        tolerance_px: options.tolerance_px,
        min_base_px: 0.0,
        rounds: ROUNDS,
        min_kept: MIN_KEPT,
        ending: Ending::Selection,
        pivot_px: Some(Vector2::zeros()),
        prior: Some(Prior { sigma_c: options.max_growth * PRIOR_SHARE, sigma_s: options.max_turn_rad * PRIOR_SHARE }),
    }
}

/// The windows' displacements as a function of their place: points in px from the pivot, models that differ from
/// `map_from_view` by the identity.
struct Displacements<'a> {
    matches: &'a [WindowMatch],
    pivot_px: Vector2<f64>,
    options: &'a WindowFitOptions,
}

impl Observations for Displacements<'_> {
    fn count(&self) -> usize {
        self.matches.len()
    }

    fn point(&self, index: usize) -> Vector2<f64> {
        Vector2::from(self.matches[index].centre_px) - self.pivot_px
    }

    fn observed(&self, index: usize) -> Vector2<f64> {
        self.matches[index].displacement_px
    }

    fn information(&self, index: usize) -> Matrix2<f64> {
        self.matches[index].information
    }

    fn residual(&self, index: usize, model: &Similarity) -> Vector2<f64> {
        self.observed(index) - design(self.point(index)) * Vector4::new(model.t.x, model.t.y, model.c, model.s)
    }

    /// Solves the 4 x 4 system of both windows. [`Similarity::through`] differs from this in rounding, and rounding decides
    /// between consensuses of two windows, whose residuals are 0.
    fn hypothesis(&self, [i, j]: [usize; 2]) -> Option<Similarity> {
        let mut system = Matrix4::zeros();
        system.fixed_view_mut::<2, 4>(0, 0).copy_from(&design(self.point(i)));
        system.fixed_view_mut::<2, 4>(2, 0).copy_from(&design(self.point(j)));
        let (p, q) = (self.observed(i), self.observed(j));
        let [x, y, c, s] = (system.try_inverse()? * Vector4::new(p.x, p.y, q.x, q.y)).into();
        Some(Similarity { c, s, t: Vector2::new(x, y) })
    }

    fn is_admissible(&self, index: usize, _model: &Similarity) -> bool {
        !self.matches[index].on_rim
    }

    fn is_plausible(&self, model: &Similarity) -> bool {
        model.c.abs() <= self.options.max_growth && model.s.abs() <= self.options.max_turn_rad
    }

    fn score(&self, model: &Similarity, tolerance_px: f64) -> Score {
        let mut score = Score { inliers: 0, cost: 0.0 };
        for index in (0..self.count()).filter(|&i| self.is_admissible(i, model)) {
            let residual_px = self.residual(index, model).norm();
            if residual_px <= tolerance_px {
                score.inliers += 1;
                score.cost += residual_px;
            }
        }
        score
    }
}

#[cfg(test)]
mod tests {
    use super::super::robust::Xorshift;
    use super::*;

    fn window(x: f64, y: f64, dx: f64, dy: f64) -> WindowMatch {
        WindowMatch {
            centre_px: [x, y],
            displacement_px: Vector2::new(dx, dy),
            peak: 0.8,
            information: Matrix2::identity() * 0.1,
            on_rim: false,
        }
    }

    #[test]
    fn finds_the_similarity_under_outliers() {
        let (t, a, b) = ([1.5, -0.7], 0.02, -0.03);
        let mut matches = Vec::new();
        for i in 0..5 {
            for j in 0..4 {
                let (x, y) = (f64::from(i) * 40.0, f64::from(j) * 40.0);
                let (px, py) = (x - 80.0, y - 60.0);
                matches.push(window(x, y, t[0] + a * px - b * py, t[1] + a * py + b * px));
            }
        }
        for k in [0, 7, 9, 13, 16] {
            matches[k].displacement_px += Vector2::new(6.0 - k as f64, 4.0);
        }
        let options = WindowFitOptions { tolerance_px: 1.0, max_growth: 0.1, max_turn_rad: 0.1 };
        let fit = fit_windows(&matches, [80.0, 60.0], &options).unwrap();
        let Similarity { c, s, t: shift } = fit.map_from_view;
        let off = Vector4::new(shift.x, shift.y, c, s) - Vector4::new(t[0], t[1], 1.0 + a, b);
        assert!(off.norm() < 0.02, "{off}");
        assert!(fit.inliers.len() >= 15);
    }

    #[test]
    fn the_covariance_grows_away_from_the_windows() {
        let options = WindowFitOptions { tolerance_px: 1.25, max_growth: 0.12, max_turn_rad: 0.14 };
        let fit = fit_windows(&noisy_windows(12_345), [180.0, 140.0], &options).unwrap();
        let at_pivot = fit.covariance_at(Vector2::zeros());
        assert!((at_pivot - fit.covariance.fixed_view::<2, 2>(0, 0)).norm() < 1e-12);
        // Far away growth and turn dominate: their variances times the square of the distance.
        let far = fit.covariance_at(Vector2::new(1e6, 0.0)) / 1e12;
        let (growth, turn) = (fit.covariance[(2, 2)], fit.covariance[(3, 3)]);
        assert!((far[(0, 0)] / growth - 1.0).abs() < 1e-3 && (far[(1, 1)] / turn - 1.0).abs() < 1e-3);
    }

    #[test]
    fn one_window_gives_no_fit() {
        let options = WindowFitOptions { tolerance_px: 1.0, max_growth: 0.1, max_turn_rad: 0.1 };
        assert!(fit_windows(&[window(0.0, 0.0, 1.0, 1.0)], [0.0, 0.0], &options).is_none());
    }

    /// Windows of one correction, some of them wrong, with noise and unequal information.
    fn noisy_windows(seed: u32) -> Vec<WindowMatch> {
        let mut draw = Xorshift::new(seed);
        let mut unit = || draw.below(2_000_001) as f64 / 1e6 - 1.0;
        let (t, a, b) = ([3.0 * unit(), 3.0 * unit()], 0.1 * unit(), 0.1 * unit());
        let count = (14.0 + 13.0 * unit()) as usize;
        let share = unit();
        let noise = 1.2 * unit().abs();
        let one = |_| {
            let (x, y) = (200.0 + 190.0 * unit(), 150.0 + 140.0 * unit());
            let (px, py) = (x - 180.0, y - 140.0);
            let (dx, dy) = if unit() < share {
                (t[0] + a * px - b * py + noise * unit(), t[1] + a * py + b * px + noise * unit())
            } else {
                (8.0 * unit(), 8.0 * unit())
            };
            let (p, q, r) = (0.05 + 0.04 * unit(), 0.05 + 0.04 * unit(), 0.005 * unit());
            let on_rim = unit() > 0.9;
            WindowMatch { information: Matrix2::new(p, r, r, q), on_rim, ..window(x, y, dx, dy) }
        };
        (0..count).map(one).collect()
    }

    #[test]
    fn the_digits_stay() {
        let options = WindowFitOptions { tolerance_px: 1.25, max_growth: 0.12, max_turn_rad: 0.14 };
        let fit = fit_windows(&noisy_windows(12_345), [180.0, 140.0], &options).unwrap();
        let t = Vector2::new(-0.27435254074902554, 0.6383204411698373);
        assert_eq!(fit.map_from_view, Similarity { c: 1.0 - 0.04819424618602542, s: 0.049628798604605, t });
        assert_eq!(fit.inliers, [0, 3, 4, 5, 6, 7, 8, 9, 10]);
        assert_eq!(fit.rms_px, 0.46625339929701803);
        assert_eq!(
            fit.covariance.diagonal(),
            Vector4::new(0.030935879012280787, 0.034449105479370225, 1.5143083069277314e-6, 1.3139161192164944e-6)
        );
        assert_eq!((fit.search.method, fit.search.trials), (HypothesisMethod::AllPairs, 55));
    }
}
