//! The protection level: the radius around a position that its error exceeds without warning at most at a stated integrity risk.
//!
//! Errors have heavier tails than a normal distribution: a seam, a lake, a wrong date of the map. So an error over its stated covariance
//! is taken as Student's t with few degrees of freedom, and what is not covered by any covariance, a false fix, has its own probability.
//!
//! # References
//! RTCA DO-229, protection and alert limits; Kotz and Nadarajah, *Multivariate t Distributions and Their Applications* (2004), 1.1.

use crate::geodesy::EnuCovariance;

/// The integrity risk where none is stated.
pub const DEFAULT_INTEGRITY_RISK: f64 = 1e-3;
/// The range of integrity risks.
pub const INTEGRITY_RISKS: std::ops::RangeInclusive<f64> = 1e-9..=0.5;
/// Degrees of freedom of an error over its stated covariance. At a risk of 10^-3 they put the bound at a squared Mahalanobis distance of
/// 19.9; of 5,137 fixes over four kinds of ground (`docs/integrity.md`) 3 lie beyond, and 5 are expected.
const DEGREES_OF_FREEDOM: f64 = 20.0;
/// Directions over which the tail is averaged.
const DIRECTIONS: usize = 32;
/// Protection levels are computed to this share of themselves.
const PRECISION: f64 = 1e-4;
/// No protection level is larger, metres: half the circumference of the earth.
const MOST_M: f64 = 2e7;

/// One way in which a position may err.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorBelief {
    /// Its probability.
    pub probability: f64,
    /// Covariance of the true position about the believed one.
    pub covariance: EnuCovariance,
    /// Distance of the believed position from the stated one, metres.
    pub offset_m: f64,
}

/// All ways in which a position may err; by default it may be anywhere. What their probabilities leave of 1 is the probability that the position may be anywhere.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ErrorMixture(Vec<ErrorBelief>);

impl ErrorMixture {
    /// The mixture of some beliefs.
    pub fn new(beliefs: Vec<ErrorBelief>) -> Self {
        Self(beliefs)
    }

    /// A position with one covariance that is wrong, and then anywhere, with a probability.
    pub fn of_fix(covariance: EnuCovariance, wrong_probability: f64) -> Self {
        Self(vec![ErrorBelief { probability: 1.0 - wrong_probability, covariance, offset_m: 0.0 }])
    }

    /// The mixture with another source of error, one standard deviation per axis, metres.
    pub fn widened(mut self, by_m: f64) -> Self {
        for belief in &mut self.0 {
            belief.covariance.ee_m2 += by_m.powi(2);
            belief.covariance.nn_m2 += by_m.powi(2);
        }
        self
    }

    /// The probability that the error exceeds a radius, metres.
    pub fn exceedance(&self, radius_m: f64) -> f64 {
        let known: f64 = self.0.iter().map(|belief| belief.probability).sum();
        let beyond =
            |belief: &ErrorBelief| belief.probability * tail(belief.covariance, (radius_m - belief.offset_m).max(0.0));
        (1.0 - known).max(0.0) + self.0.iter().map(beyond).sum::<f64>()
    }

    /// The protection level for an integrity risk, metres; `None` where no radius is exceeded so rarely.
    ///
    /// # Example
    /// ```
    /// use overfly_core::geodesy::EnuCovariance;
    /// use overfly_core::integrity::ErrorMixture;
    ///
    /// let fix = ErrorMixture::of_fix(EnuCovariance::from_sigma_m(5.0), 1.5e-4);
    /// let level_m = fix.protection_level_m(1e-3).unwrap();
    /// assert!((fix.exceedance(level_m) - 1e-3).abs() < 1e-5);
    /// assert_eq!(fix.protection_level_m(1e-4), None);
    /// ```
    pub fn protection_level_m(&self, integrity_risk: f64) -> Option<f64> {
        if self.exceedance(MOST_M).is_nan() || self.exceedance(MOST_M) > integrity_risk {
            return None;
        }
        let (mut least, mut most) = (0.0, MOST_M);
        while most - least > PRECISION * most && most > PRECISION {
            // Geometric where the bounds are far apart.
            let middle = if most > 4.0 * f64::max(least, PRECISION) {
                (most * f64::max(least, PRECISION)).sqrt()
            } else {
                (least + most) / 2.0
            };
            if self.exceedance(middle) > integrity_risk { least = middle } else { most = middle }
        }
        Some(most)
    }
}

/// The probability that an error of a covariance is longer than a radius, metres: Student's t, of which all directions of the whitened
/// error are equally likely.
fn tail(covariance: EnuCovariance, radius_m: f64) -> f64 {
    let EnuCovariance { ee_m2, en_m2, nn_m2 } = covariance;
    if ![ee_m2, en_m2, nn_m2].iter().all(|value| value.is_finite()) {
        return 1.0;
    }
    let ellipse = covariance.ellipse();
    let mean: f64 = (0..DIRECTIONS)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::PI * (i as f64 + 0.5) / DIRECTIONS as f64).sin_cos();
            let variance_m2 = (ellipse.semi_major_m * cos).powi(2) + (ellipse.semi_minor_m * sin).powi(2);
            if variance_m2 > 0.0 {
                (1.0 + radius_m.powi(2) / (DEGREES_OF_FREEDOM * variance_m2)).powf(-DEGREES_OF_FREEDOM / 2.0)
            } else {
                f64::from(u8::from(radius_m <= 0.0))
            }
        })
        .sum();
    mean / DIRECTIONS as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws of Student's t by their definition: a normal vector over the root of an independent chi-square over its degrees of freedom.
    fn share_beyond(covariance: EnuCovariance, radius_m: f64) -> f64 {
        let mut state = 88_172_645_463_325_252u64;
        let mut unit = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut normal = || (-2.0 * (1.0 - unit()).ln()).sqrt() * (std::f64::consts::TAU * unit()).cos();
        let l = covariance.to_matrix().cholesky().unwrap().l();
        let draws = 400_000;
        let beyond = (0..draws).filter(|_| {
            let z = nalgebra::Vector2::new(normal(), normal());
            let chi_square: f64 = (0..DEGREES_OF_FREEDOM as usize).map(|_| normal().powi(2)).sum();
            (l * z / (chi_square / DEGREES_OF_FREEDOM).sqrt()).norm() > radius_m
        });
        beyond.count() as f64 / f64::from(draws)
    }

    #[test]
    fn the_tail_is_that_of_draws() {
        for (covariance, radii) in [
            (EnuCovariance::from_sigma_m(5.0), [5.0, 12.0, 25.0]),
            (EnuCovariance { ee_m2: 100.0, en_m2: 27.0, nn_m2: 9.0 }, [4.0, 20.0, 50.0]),
        ] {
            for radius_m in radii {
                let (found, drawn) = (tail(covariance, radius_m), share_beyond(covariance, radius_m));
                let sigma = (drawn.max(1e-5) / 400_000.0).sqrt();
                assert!((found - drawn).abs() < 5.0 * sigma + 0.002 * drawn, "{radius_m}: {found} {drawn}");
            }
        }
    }

    #[test]
    fn a_level_grows_as_the_risk_falls_and_as_the_covariance_grows() {
        let of = |sigma_m, risk| {
            ErrorMixture::of_fix(EnuCovariance::from_sigma_m(sigma_m), 1e-7).protection_level_m(risk).unwrap()
        };
        assert!(of(5.0, 1e-3) < of(5.0, 1e-5) && of(5.0, 1e-5) < of(5.0, 1e-6));
        assert!((of(10.0, 1e-3) / of(5.0, 1e-3) - 2.0).abs() < 1e-3);
    }

    #[test]
    fn where_a_belief_fails_the_one_behind_it_bounds_the_error() {
        let (near, far) = (EnuCovariance::from_sigma_m(4.0), EnuCovariance::from_sigma_m(60.0));
        let belief = |probability, covariance, offset_m| ErrorBelief { probability, covariance, offset_m };
        let alone = ErrorMixture::of_fix(near, 1.5e-4);
        let both = ErrorMixture::new(vec![belief(1.0 - 1.5e-4, near, 0.0), belief(1.5e-4, far, 30.0)]);
        assert_eq!(alone.protection_level_m(1e-5), None);
        let level_m = both.protection_level_m(1e-5).unwrap();
        assert!(level_m > 100.0 && level_m < 300.0, "{level_m}");
        assert!((both.protection_level_m(1e-3).unwrap() / alone.protection_level_m(1e-3).unwrap() - 1.0).abs() < 0.05);
    }

    #[test]
    fn a_broken_covariance_protects_nothing() {
        let nan = EnuCovariance { ee_m2: f64::NAN, en_m2: 0.0, nn_m2: 1.0 };
        assert_eq!(ErrorMixture::of_fix(nan, 0.0).protection_level_m(1e-3), None);
        let huge = EnuCovariance::from_sigma_m(1e9);
        assert_eq!(ErrorMixture::of_fix(huge, 0.0).protection_level_m(1e-3), None);
        assert!(ErrorMixture::of_fix(EnuCovariance::from_sigma_m(0.0), 0.0).protection_level_m(1e-3).unwrap() < 1e-3);
    }
}
