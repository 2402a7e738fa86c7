//! `Quantiles`: median, 95th percentile and maximum of a set of numbers.

use serde::Serialize;

/// The distribution of a set of measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// Median; for an even count the mean of the middle two.
    pub median: f64,
    /// 95th percentile, linear between neighbours.
    pub p95: f64,
    /// Maximum.
    pub max: f64,
}

impl Quantiles {
    /// The quantiles of finite numbers in any order; `None` without numbers.
    pub fn from_values(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let max = *values.last()?;
        Some(Self { median: quantile(&values, 0.5), p95: quantile(&values, 0.95), max })
    }
}

/// The quantile of sorted numbers, linear between neighbours.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share * (sorted.len() - 1) as f64;
    let (low, part) = (at.floor() as usize, at.fract());
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + (sorted[high] - sorted[low]) * part
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_numpys_default() {
        // numpy.quantile([4, 1, 3, 2], [0.5, 0.95, 1]) = [2.5, 3.85, 4]
        let s = Quantiles::from_values(vec![4.0, 1.0, 3.0, 2.0]).unwrap();
        assert!((s.median - 2.5).abs() < 1e-12 && (s.p95 - 3.85).abs() < 1e-12 && s.max == 4.0);
        assert_eq!(Quantiles::from_values(vec![7.0]).unwrap().p95, 7.0);
        assert_eq!(Quantiles::from_values(vec![]), None);
    }
}
