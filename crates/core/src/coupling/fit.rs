//! Fits of laws to measurements: lines and powers by least squares of relative errors, because the errors of times and drifts
//! grow with the value, and the coefficient of determination.

/// Constant and slope of the line through `points` (x, y) with the least sum of squared relative errors
/// ((y - line) / y)^2. Neither is negative: where one would be, the fit leaves that part out. `None` without a point with a
/// positive y and a finite x; one point gives a constant.
///
/// # Example
/// ```
/// let [constant, slope] = overfly_core::coupling::fit_line(&[(1.0, 5.0), (2.0, 7.0), (10.0, 23.0)]).unwrap();
/// assert!((constant - 3.0).abs() < 1e-9 && (slope - 2.0).abs() < 1e-9);
/// ```
pub fn fit_line(points: &[(f64, f64)]) -> Option<[f64; 2]> {
    let usable = || points.iter().filter(|(x, y)| x.is_finite() && *y > 0.0 && y.is_finite());
    let sum = |of: fn(f64, f64) -> f64| usable().map(|&(x, y)| of(x, y)).sum::<f64>();
    let count = usable().count();
    if count == 0 {
        return None;
    }
    // Normal equations of the rows (1 / y, x / y) against 1.
    let (s11, s1x, sxx) = (sum(|_, y| 1.0 / (y * y)), sum(|x, y| x / (y * y)), sum(|x, y| x * x / (y * y)));
    let (s1, sx) = (sum(|_, y| 1.0 / y), sum(|x, y| x / y));
    let determinant = s11 * sxx - s1x * s1x;
    let constant_alone = [s1 / s11, 0.0];
    if determinant <= 1e-12 * s11 * sxx {
        return Some(constant_alone);
    }
    let line = [(s1 * sxx - sx * s1x) / determinant, (s11 * sx - s1x * s1) / determinant];
    Some(if line[1] < 0.0 {
        constant_alone
    } else if line[0] < 0.0 {
        [0.0, (sx / sxx).max(0.0)]
    } else {
        line
    })
}

/// The slope of the line through the origin with the least sum of squared relative errors; `None` without a point with
/// positive x and y.
///
/// # Example
/// ```
/// assert_eq!(overfly_core::coupling::fit_slope(&[(2.0, 6.0), (5.0, 15.0)]), Some(3.0));
/// ```
pub fn fit_slope(points: &[(f64, f64)]) -> Option<f64> {
    let shares: Vec<f64> = points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| x / y).collect();
    let squares: f64 = shares.iter().map(|s| s * s).sum();
    (squares > 0.0 && squares.is_finite()).then(|| shares.iter().sum::<f64>() / squares)
}

/// The coefficient of determination R^2 of a law, 1 - sum((y - law)^2) / sum((y - mean)^2): at most 1, and negative where the
/// mean fits better than the law. `None` with fewer than three points or without variance.
///
/// # Example
/// ```
/// let points = [(1.0, 2.0), (2.0, 4.0), (3.0, 6.0)];
/// assert_eq!(overfly_core::coupling::r_squared(&points, |x| 2.0 * x), Some(1.0));
/// ```
pub fn r_squared(points: &[(f64, f64)], law: impl Fn(f64) -> f64) -> Option<f64> {
    let mean = points.iter().map(|p| p.1).sum::<f64>() / points.len() as f64;
    let spread: f64 = points.iter().map(|p| (p.1 - mean).powi(2)).sum();
    let left: f64 = points.iter().map(|p| (p.1 - law(p.0)).powi(2)).sum();
    let share = 1.0 - left / spread;
    (points.len() >= 3 && spread > 0.0 && share.is_finite()).then_some(share)
}

/// The power p of y = c x^p: the slope of log y over log x. `None` with fewer than three points of positive x and y, or where
/// all have the same x.
///
/// # Example
/// ```
/// let p = overfly_core::coupling::fit_power(&[(1.0, 3.0), (10.0, 300.0), (100.0, 3e4)]).unwrap();
/// assert!((p - 2.0).abs() < 1e-12);
/// ```
pub fn fit_power(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<_> = points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / logs.len() as f64;
    let (x, y) = (mean(|l| l.0), mean(|l| l.1));
    let (together, alone) =
        logs.iter().fold((0.0, 0.0), |(t, a), l| (t + (l.0 - x) * (l.1 - y), a + (l.0 - x).powi(2)));
    let power = together / alone;
    (logs.len() >= 3 && alone > 1e-12 && power.is_finite()).then_some(power)
}

/// The power p, from 0.25 to 4 in steps of 0.01, of y = constant + slope x^p with the least sum of squared relative errors.
/// `None` with fewer than four points of positive x and y.
pub fn fit_power_above(points: &[(f64, f64)]) -> Option<f64> {
    let usable: Vec<_> = points.iter().copied().filter(|(x, y)| *x > 0.0 && *y > 0.0).collect();
    if usable.len() < 4 {
        return None;
    }
    let cost = |p: f64| {
        let raised: Vec<_> = usable.iter().map(|&(x, y)| (x.powf(p), y)).collect();
        let [constant, slope] = fit_line(&raised)?;
        Some(raised.iter().map(|(x, y)| ((constant + slope * x) / y - 1.0).powi(2)).sum::<f64>())
    };
    let tried = (25..=400).filter_map(|k| Some((f64::from(k) / 100.0, cost(f64::from(k) / 100.0)?)));
    tried.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(p, _)| p)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of squared relative errors.
    fn cost(points: &[(f64, f64)], [c, k]: [f64; 2]) -> f64 {
        points.iter().map(|(x, y)| ((c + k * x) / y - 1.0).powi(2)).sum()
    }

    #[test]
    fn no_line_without_negative_parts_fits_better() {
        let sets: [&[(f64, f64)]; 4] = [
            &[(1.0, 2.0), (2.0, 3.5), (3.0, 3.9), (8.0, 9.0)],
            &[(1.0, 4.0), (2.0, 3.0), (3.0, 2.0)],
            &[(1.0, 0.1), (2.0, 3.0), (3.0, 7.0)],
            &[(5.0, 2.0), (5.0, 3.0)],
        ];
        for points in sets {
            let found = fit_line(points).unwrap();
            assert!(found[0] >= 0.0 && found[1] >= 0.0, "{found:?}");
            for i in 0..=200 {
                for k in 0..=200 {
                    let other = [f64::from(i) * 0.05, f64::from(k) * 0.02];
                    assert!(cost(points, found) <= cost(points, other) + 1e-12, "{points:?} {found:?} {other:?}");
                }
            }
        }
    }

    #[test]
    fn nothing_comes_of_nothing() {
        assert_eq!(fit_line(&[]), None);
        assert_eq!(fit_line(&[(1.0, 0.0), (f64::NAN, 2.0)]), None);
        assert_eq!(fit_line(&[(4.0, 2.0)]), Some([2.0, 0.0]));
        assert_eq!(fit_slope(&[(0.0, 1.0)]), None);
        assert_eq!(r_squared(&[(1.0, 2.0), (2.0, 2.0), (3.0, 2.0)], |_| 2.0), None);
        assert_eq!(fit_power(&[(1.0, 2.0), (1.0, 3.0), (1.0, 4.0)]), None);
        assert_eq!(fit_power_above(&[(1.0, 2.0), (2.0, 3.0), (3.0, 4.0)]), None);
    }

    #[test]
    fn a_law_that_does_not_hold_explains_little_and_has_another_power() {
        let squares: Vec<_> = (1..=6).map(|i| (f64::from(i), 5.0 + f64::from(i * i))).collect();
        assert!((fit_power_above(&squares).unwrap() - 2.0).abs() < 0.011);
        let line: Vec<_> = (1..=6).map(|i| (f64::from(i), 5.0 + f64::from(i))).collect();
        assert!((fit_power_above(&line).unwrap() - 1.0).abs() < 0.011);
        assert!(r_squared(&squares, |x| 5.0 + x * x).unwrap() > 0.999_999);
        assert!(r_squared(&squares, |x| 60.0 - 9.0 * x).unwrap() < 0.0);
        // About their mean 1, 2, 3 have squares of 2 in all; about the law 1, of 0 + 1 + 4.
        assert!((r_squared(&[(0.0, 1.0), (0.0, 2.0), (0.0, 3.0)], |_| 1.0).unwrap() + 1.5).abs() < 1e-12);
        assert!((fit_power(&[(1.0, 8.0), (4.0, 4.0), (16.0, 2.0)]).unwrap() + 0.5).abs() < 1e-12);
    }
}
