//! The similarity that most window displacements agree on, and how well it is known.
//!
//! Small corrections only: a displacement at p (pixels from the pivot, x right, y down) is modelled as
//! `t + a p + b (-p_y, p_x)`: a shift t, a growth a, and a turn b, positive clockwise as seen.

use super::windows::WindowMatch;
use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2, Vector4};

/// A correction, and which windows made it.
#[derive(Debug, Clone)]
pub struct Fit {
    /// t_x, t_y (px at the pivot), a (ratio), b (radians clockwise).
    pub parameters: Vector4<f64>,
    /// Of `parameters`, from the residuals of the agreeing windows; infinite variances where there are too few.
    pub covariance: Matrix4<f64>,
    /// Windows that agree, by index.
    pub inliers: Vec<usize>,
    /// Root mean square residual per axis of the agreeing windows, px.
    pub rms_px: f64,
}

/// How far a correction may go and what counts as agreement.
#[derive(Debug, Clone, Copy)]
pub struct FitOptions {
    /// A window agrees where its residual is at most this, px.
    pub tolerance_px: f64,
    /// Largest |a|.
    pub max_growth: f64,
    /// Largest |b|, radians.
    pub max_turn_rad: f64,
}

/// Refinements of the consensus by least squares.
const ROUNDS: usize = 5;
/// One sigma of what is believed of a and b before any window speaks, so that two neighbouring windows do not turn
/// the frame: as wide as the search itself allows.
const PRIOR_SHARE: f64 = 0.5;

/// The correction with the largest consensus over all pairs of windows (two determine a similarity, equations 34 to
/// 36), then least squares over those that agree, each weighed by its sharpness per direction. `pivot_px`: where the
/// shift is stated (the nadir), in the windows' pixels. `None` with fewer than two windows.
pub fn fit(matches: &[WindowMatch], pivot_px: [f64; 2], options: &FitOptions) -> Option<Fit> {
    let rows: Vec<Row> = matches.iter().map(|m| Row::new(m, pivot_px)).collect();
    let start = best_pair(&rows, options)?;
    let mut parameters = start;
    let mut inliers = agreeing(&rows, &parameters, options.tolerance_px);
    for _ in 0..ROUNDS {
        let next = least_squares(&rows, &inliers, options)?.0;
        let still = agreeing(&rows, &next, options.tolerance_px);
        if still.len() < inliers.len().min(3) {
            break;
        }
        parameters = next;
        if still == inliers {
            break;
        }
        inliers = still;
    }
    let (_, normal) = least_squares(&rows, &inliers, options)?;
    Some(assess(&rows, inliers, parameters, normal))
}

struct Row {
    design: Matrix2x4<f64>,
    displacement: Vector2<f64>,
    information: Matrix2<f64>,
    usable: bool,
}

impl Row {
    fn new(m: &WindowMatch, pivot_px: [f64; 2]) -> Self {
        let (x, y) = (m.centre_px[0] - pivot_px[0], m.centre_px[1] - pivot_px[1]);
        Self {
            design: Matrix2x4::new(1.0, 0.0, x, -y, 0.0, 1.0, y, x),
            displacement: m.displacement_px,
            information: m.information,
            usable: !m.on_rim,
        }
    }

    fn residual(&self, parameters: &Vector4<f64>) -> Vector2<f64> {
        self.displacement - self.design * parameters
    }
}

fn agreeing(rows: &[Row], parameters: &Vector4<f64>, tolerance_px: f64) -> Vec<usize> {
    (0..rows.len()).filter(|&i| rows[i].usable && rows[i].residual(parameters).norm() <= tolerance_px).collect()
}

fn best_pair(rows: &[Row], options: &FitOptions) -> Option<Vector4<f64>> {
    let mut best: Option<(usize, f64, Vector4<f64>)> = None;
    for i in 0..rows.len() {
        for j in i + 1..rows.len() {
            let Some(p) = through(&rows[i], &rows[j]) else { continue };
            if p[2].abs() > options.max_growth || p[3].abs() > options.max_turn_rad {
                continue;
            }
            let (mut count, mut cost) = (0, 0.0);
            for row in rows.iter().filter(|r| r.usable) {
                let r = row.residual(&p).norm();
                if r <= options.tolerance_px {
                    count += 1;
                    cost += r;
                }
            }
            if best.as_ref().is_none_or(|(n, c, _)| count > *n || (count == *n && cost < *c)) {
                best = Some((count, cost, p));
            }
        }
    }
    best.map(|(_, _, p)| p)
}

/// The correction that two windows determine.
fn through(a: &Row, b: &Row) -> Option<Vector4<f64>> {
    if !a.usable || !b.usable {
        return None;
    }
    let mut m = Matrix4::zeros();
    m.fixed_view_mut::<2, 4>(0, 0).copy_from(&a.design);
    m.fixed_view_mut::<2, 4>(2, 0).copy_from(&b.design);
    let d = Vector4::new(a.displacement.x, a.displacement.y, b.displacement.x, b.displacement.y);
    m.try_inverse().map(|inverse| inverse * d)
}

/// Solution and normal matrix (in units of the information, with the prior on growth and turn).
fn least_squares(rows: &[Row], inliers: &[usize], options: &FitOptions) -> Option<(Vector4<f64>, Matrix4<f64>)> {
    if inliers.is_empty() {
        return None;
    }
    let mean_information: f64 =
        inliers.iter().map(|&i| rows[i].information.trace() / 2.0).sum::<f64>() / inliers.len() as f64;
    // The prior weighs as if a and b had been seen once with their own spread where a window is known to a pixel.
    let weight = |bound: f64| mean_information * 0.25 / (bound * PRIOR_SHARE).powi(2);
    let mut normal =
        Matrix4::from_diagonal(&Vector4::new(0.0, 0.0, weight(options.max_growth), weight(options.max_turn_rad)));
    let mut right = Vector4::zeros();
    for &i in inliers {
        let row = &rows[i];
        normal += row.design.transpose() * row.information * row.design;
        right += row.design.transpose() * row.information * row.displacement;
    }
    normal.try_inverse().map(|inverse| (inverse * right, normal))
}

fn assess(rows: &[Row], inliers: Vec<usize>, parameters: Vector4<f64>, normal: Matrix4<f64>) -> Fit {
    let count = inliers.len();
    let (mut weighted, mut plain) = (0.0, 0.0);
    for &i in &inliers {
        let r = rows[i].residual(&parameters);
        weighted += (r.transpose() * rows[i].information * r)[0];
        plain += r.norm_squared();
    }
    let freedom = (2 * count) as f64 - 4.0;
    let covariance = match normal.try_inverse() {
        Some(inverse) if freedom > 0.0 => inverse * (weighted / freedom),
        _ => Matrix4::identity() * f64::INFINITY,
    };
    let rms_px = if count == 0 { f64::INFINITY } else { (plain / (2 * count) as f64).sqrt() };
    Fit { parameters, covariance, inliers, rms_px }
}

#[cfg(test)]
mod tests {
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
        let options = FitOptions { tolerance_px: 1.0, max_growth: 0.1, max_turn_rad: 0.1 };
        let fit = fit(&matches, [80.0, 60.0], &options).unwrap();
        let expected = Vector4::new(t[0], t[1], a, b);
        assert!((fit.parameters - expected).norm() < 0.02, "{}", fit.parameters);
        assert!(fit.inliers.len() >= 15);
    }

    #[test]
    fn says_nothing_from_one_window() {
        let options = FitOptions { tolerance_px: 1.0, max_growth: 0.1, max_turn_rad: 0.1 };
        assert!(fit(&[window(0.0, 0.0, 1.0, 1.0)], [0.0, 0.0], &options).is_none());
    }
}
