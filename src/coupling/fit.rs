//! Straight lines through measurements whose error is a share of their value, as that of times and drifts is.

/// Constant and slope, neither negative, of the line through `points` (x, y) with the least sum of squared relative
/// errors ((y - line) / y)^2. Where the best line would have a negative part, the best one without it. `None` without a
/// point whose y is positive and whose x is finite; one point gives a constant.
///
/// # Example
/// ```
/// let [constant, slope] = overfly::coupling::fit_line(&[(1.0, 5.0), (2.0, 7.0), (10.0, 23.0)]).unwrap();
/// assert!((constant - 3.0).abs() < 1e-9 && (slope - 2.0).abs() < 1e-9);
/// ```
pub fn fit_line(points: &[(f64, f64)]) -> Option<[f64; 2]> {
    let usable = || points.iter().filter(|(x, y)| x.is_finite() && *y > 0.0 && y.is_finite());
    let sum = |of: fn(f64, f64) -> f64| usable().map(|&(x, y)| of(x, y)).sum::<f64>();
    let count = usable().count();
    if count == 0 {
        return None;
    }
    // Of the rows (1 / y, x / y) against 1.
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

/// The slope of the line through the origin with the least sum of squared relative errors; `None` without a point whose x
/// and y are positive.
///
/// # Example
/// ```
/// assert_eq!(overfly::coupling::fit_slope(&[(2.0, 6.0), (5.0, 15.0)]), Some(3.0));
/// ```
pub fn fit_slope(points: &[(f64, f64)]) -> Option<f64> {
    let shares: Vec<f64> = points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| x / y).collect();
    let squares: f64 = shares.iter().map(|s| s * s).sum();
    (squares > 0.0 && squares.is_finite()).then(|| shares.iter().sum::<f64>() / squares)
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
    }
}
