//! Errors measured by their own covariance.

use overfly_core::geodesy::Enu;

/// The 95 % quantile of chi-square with two degrees of freedom: -2 ln(0.05).
pub const CHI_SQUARE_95: f64 = 5.991_464_547_107_98;

/// Normalised estimation error squared (NEES) e^T C^-1 e of an error and its covariance [[ee, en], [en, nn]], m^2;
/// infinite if the covariance is not positive definite.
pub fn nees(error: Enu, [[ee, en], [_, nn]]: [[f64; 2]; 2]) -> f64 {
    let Enu { east_m: e, north_m: n } = error;
    let determinant = ee * nn - en * en;
    let is_definite = ee > 0.0 && determinant > 0.0;
    if is_definite { (nn * e * e - 2.0 * en * e * n + ee * n * n) / determinant } else { f64::INFINITY }
}
