//! `EnuCovariance`: the covariance of a horizontal position, its ellipse and its Mahalanobis distance.

use super::Enu;
use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};

/// The 95 % quantile of chi-square with two degrees of freedom: -2 ln(0.05).
pub const CHI_SQUARE_95: f64 = 5.991_464_547_107_98;
/// The 99.9 % quantile of chi-square with two degrees of freedom.
pub const CHI_SQUARE_999: f64 = 13.815_510_557_964_274;
/// The 99.99 % quantile of chi-square with two degrees of freedom.
pub const CHI_SQUARE_9999: f64 = 18.420_680_743_952_367;

/// The covariance of a horizontal position in east and north, m^2. JSON spells it [[ee, en], [en, nn]].
///
/// Nothing is checked at construction: a filter's rounding can leave a matrix that is not positive definite.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "[[f64; 2]; 2]", into = "[[f64; 2]; 2]")]
pub struct EnuCovariance {
    /// Variance towards east, m^2.
    pub ee_m2: f64,
    /// Covariance of east and north, m^2.
    pub en_m2: f64,
    /// Variance towards north, m^2.
    pub nn_m2: f64,
}

/// The ellipse of a covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorEllipse {
    /// Long half axis, metres.
    pub semi_major_m: f64,
    /// Short half axis, metres.
    pub semi_minor_m: f64,
    /// Direction of the long axis, radians counterclockwise from east, in [-pi / 2, pi / 2].
    pub semi_major_from_east_rad: f64,
}

impl EnuCovariance {
    /// Makes the covariance of independent errors with the same standard deviation in all directions, metres.
    pub fn from_sigma_m(sigma_m: f64) -> Self {
        let variance_m2 = sigma_m.powi(2);
        Self { ee_m2: variance_m2, en_m2: 0.0, nn_m2: variance_m2 }
    }

    /// Makes the covariance of a symmetric matrix with rows and columns east, north. Its upper triangle is taken.
    pub fn from_matrix(matrix: Matrix2<f64>) -> Self {
        Self { ee_m2: matrix[(0, 0)], en_m2: matrix[(0, 1)], nn_m2: matrix[(1, 1)] }
    }

    /// The matrix with rows and columns east, north.
    pub fn to_matrix(self) -> Matrix2<f64> {
        Matrix2::new(self.ee_m2, self.en_m2, self.en_m2, self.nn_m2)
    }

    /// The ellipse of one standard deviation, which holds 39 % of a normal distribution.
    ///
    /// # Example
    /// The eigenvalues of [[5, 2], [2, 2]] are 6 and 1.
    /// ```
    /// use overfly_core::geodesy::EnuCovariance;
    /// let ellipse = EnuCovariance { ee_m2: 5.0, en_m2: 2.0, nn_m2: 2.0 }.ellipse();
    /// assert!((ellipse.semi_major_m - 6f64.sqrt()).abs() < 1e-12 && (ellipse.semi_minor_m - 1.0).abs() < 1e-12);
    /// assert!((ellipse.semi_major_from_east_rad - 0.5f64.atan()).abs() < 1e-12);
    /// ```
    pub fn ellipse(self) -> ErrorEllipse {
        self.ellipse_at(1.0)
    }

    /// The ellipse that holds 95 % of a normal distribution.
    pub fn ellipse_95(self) -> ErrorEllipse {
        self.ellipse_at(CHI_SQUARE_95)
    }

    /// The ellipse at a squared Mahalanobis distance. A negative eigenvalue gives a half axis of zero.
    fn ellipse_at(self, square: f64) -> ErrorEllipse {
        let Self { ee_m2: ee, en_m2: en, nn_m2: nn } = self;
        let (middle, spread) = ((ee + nn) / 2.0, ((ee - nn) / 2.0).hypot(en));
        let half_axis_m = |eigenvalue: f64| (square * eigenvalue.max(0.0)).sqrt();
        ErrorEllipse {
            semi_major_m: half_axis_m(middle + spread),
            semi_minor_m: half_axis_m(middle - spread),
            semi_major_from_east_rad: 0.5 * (2.0 * en).atan2(ee - nn),
        }
    }

    /// Squared Mahalanobis distance e^T C^-1 e of an offset. The distance of an estimation error is its NEES: 2 on average
    /// where covariances are true. Infinite where the covariance is not positive definite.
    pub fn squared_mahalanobis(self, offset: Enu) -> f64 {
        let (Self { ee_m2: ee, en_m2: en, nn_m2: nn }, Enu { east_m: e, north_m: n }) = (self, offset);
        let determinant = ee * nn - en * en;
        let is_definite = ee > 0.0 && determinant > 0.0;
        if is_definite { (nn * e * e - 2.0 * en * e * n + ee * n * n) / determinant } else { f64::INFINITY }
    }

    /// Whether an offset lies in the 95 % ellipse. A covariance that is not positive definite contains nothing.
    pub fn contains_95(self, offset: Enu) -> bool {
        self.squared_mahalanobis(offset) <= CHI_SQUARE_95
    }
}

/// Takes the upper triangle of the rows.
impl From<[[f64; 2]; 2]> for EnuCovariance {
    fn from([[ee_m2, en_m2], [_, nn_m2]]: [[f64; 2]; 2]) -> Self {
        Self { ee_m2, en_m2, nn_m2 }
    }
}

impl From<EnuCovariance> for [[f64; 2]; 2] {
    fn from(covariance: EnuCovariance) -> Self {
        let EnuCovariance { ee_m2, en_m2, nn_m2 } = covariance;
        [[ee_m2, en_m2], [en_m2, nn_m2]]
    }
}

impl ErrorEllipse {
    /// Points around the ellipse, from the end of the long axis on and back to it, metres from its middle: `count` + 1 of
    /// them.
    pub fn outline(self, count: u32) -> impl Iterator<Item = Enu> {
        let (sin, cos) = self.semi_major_from_east_rad.sin_cos();
        (0..=count).map(move |i| {
            let (s, c) = (f64::from(i) / f64::from(count) * std::f64::consts::TAU).sin_cos();
            Enu {
                east_m: self.semi_major_m * c * cos - self.semi_minor_m * s * sin,
                north_m: self.semi_major_m * c * sin + self.semi_minor_m * s * cos,
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_95_percent_ellipse_is_where_the_distance_is_that_of_95_percent(
            ee in 0.1..100.0f64, nn in 0.1..100.0f64, correlation in -0.99..0.99f64,
        ) {
            let covariance = EnuCovariance { ee_m2: ee, en_m2: correlation * (ee * nn).sqrt(), nn_m2: nn };
            for point in covariance.ellipse_95().outline(48) {
                let square = covariance.squared_mahalanobis(point);
                prop_assert!((square / CHI_SQUARE_95 - 1.0).abs() < 1e-9, "{square}");
            }
        }

        #[test]
        fn the_distance_is_that_of_the_inverse_matrix(
            ee in 0.1..100.0f64, nn in 0.1..100.0f64, correlation in -0.9..0.9f64, e in -9.0..9.0f64, n in -9.0..9.0f64,
        ) {
            let covariance = EnuCovariance { ee_m2: ee, en_m2: correlation * (ee * nn).sqrt(), nn_m2: nn };
            let offset = nalgebra::Vector2::new(e, n);
            let expected = (offset.transpose() * covariance.to_matrix().try_inverse().unwrap() * offset)[0];
            let found = covariance.squared_mahalanobis(Enu { east_m: e, north_m: n });
            prop_assert!((found - expected).abs() <= 1e-9 * (1.0 + expected));
        }
    }

    #[test]
    fn containment_is_judged_along_the_ellipses_own_axes() {
        // Ten metres along the long axis (sigma 7) are inside, ten across it (sigma 1) are not.
        let slanted = EnuCovariance::from([[25.0, 24.0], [24.0, 25.0]]);
        let d = 10.0 / f64::sqrt(2.0);
        assert!(slanted.contains_95(Enu { east_m: d, north_m: d }));
        assert!(!slanted.contains_95(Enu { east_m: d, north_m: -d }));
        assert!((slanted.ellipse().semi_major_from_east_rad.to_degrees() - 45.0).abs() < 1e-12);
    }

    #[test]
    fn a_singular_covariance_contains_nothing_and_has_a_flat_ellipse() {
        let line = EnuCovariance::from([[1.0, 1.0], [1.0, 1.0]]);
        assert!(!line.contains_95(Enu::default()) && line.squared_mahalanobis(Enu::default()).is_infinite());
        let ellipse = line.ellipse();
        assert!((ellipse.semi_major_m - 2f64.sqrt()).abs() < 1e-12 && ellipse.semi_minor_m == 0.0);
    }

    #[test]
    fn a_circle_has_its_sigma_as_both_half_axes() {
        let ellipse = EnuCovariance::from_sigma_m(3.0).ellipse();
        assert_eq!((ellipse.semi_major_m, ellipse.semi_minor_m), (3.0, 3.0));
    }

    #[test]
    fn is_written_as_rows_of_a_symmetric_matrix() {
        let covariance = EnuCovariance { ee_m2: 1.5, en_m2: 0.25, nn_m2: 2.0 };
        let value = toml::Value::try_from(covariance).unwrap();
        assert_eq!(value.to_string(), "[[1.5, 0.25], [0.25, 2.0]]");
        assert_eq!(value.try_into::<EnuCovariance>().unwrap(), covariance);
    }
}
