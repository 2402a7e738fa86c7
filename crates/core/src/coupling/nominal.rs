//! The nominal count 𝒩: the searched area as a multiple of the area of one image.

use super::error::positive;
use super::{CouplingError, swept_area_paper_m2, turned_rad};

/// Edges of the sequential region, metres: (across the heading, along it) = (a + I + 2 D_T, b + I + 2 D_T).
/// `across_m` a and `along_m` b are the image's ground extent, `inaccuracy_m` I is the full width of the last fix's
/// error, `drift_m` D_T the one-sided drift since that fix.
///
/// # References
/// The factors of equation 3.
pub fn region_edges_m(across_m: f64, along_m: f64, inaccuracy_m: f64, drift_m: f64) -> (f64, f64) {
    let growth_m = inaccuracy_m + 2.0 * drift_m;
    (across_m + growth_m, along_m + growth_m)
}

/// 𝒩 of the sequential mode: the area of the region over the area of one image. 𝒩 is 1 without drift and inaccuracy, where
/// a search on a grid of tiles still reads up to 4 tiles: 𝒩 is not a count of tiles. The arguments are those of
/// [`region_edges_m`], metres. The result is not finite where the image has no area.
///
/// # Example
/// A 600 x 400 m image, 100 m of inaccuracy, 150 m of drift: (1000 x 800) / (600 x 400).
/// ```
/// let n = overfly_core::coupling::nominal_count_sequential(600.0, 400.0, 100.0, 150.0);
/// assert!((n - 10.0 / 3.0).abs() < 1e-12);
/// ```
///
/// # References
/// Equation 3.
pub fn nominal_count_sequential(across_m: f64, along_m: f64, inaccuracy_m: f64, drift_m: f64) -> f64 {
    let (width_m, length_m) = region_edges_m(across_m, along_m, inaccuracy_m, drift_m);
    width_m * length_m / (across_m * along_m)
}

/// The largest turn at which (28) is used for 𝒩, radians. (24) requires a turn far below 1 without a limit. Up to one radian the
/// wings from which (27) is derived, s^3 / (6 R_min) each, equal those of circles to within 1.7 %.
pub const PAPER_TURN_RAD: f64 = 1.0;

/// 𝒩 of the combined mode as printed: Λ over the area of one image, for a flight of `path_m` (v t_exe) since the last
/// fix. `None` beyond [`PAPER_TURN_RAD`]. Below 1 on short flights, because Λ leaves out the extent of the image itself.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # Example
/// A flight of 500 m with a turn radius of at least 1000 m and a 600 x 400 m image: (2 x 500^3 / 3000 + 600 x 500) / (600 x 400).
/// ```
/// # use overfly_core::coupling::nominal_count_combined;
/// let n = nominal_count_combined(600.0, 400.0, 500.0, 1000.0).unwrap().unwrap();
/// assert!((n - (250_000.0 / 3.0 + 300_000.0) / 240_000.0).abs() < 1e-9);
/// assert_eq!(nominal_count_combined(600.0, 400.0, 1001.0, 1000.0), Ok(None));
/// ```
///
/// # References
/// Equation 28, and its condition 24.
pub fn nominal_count_combined(
    across_m: f64,
    along_m: f64,
    path_m: f64,
    min_turn_radius_m: f64,
) -> Result<Option<f64>, CouplingError> {
    if turned_rad(path_m, min_turn_radius_m)? > PAPER_TURN_RAD {
        return Ok(None);
    }
    let swept_m2 = swept_area_paper_m2(across_m, path_m, min_turn_radius_m)?;
    Ok(Some(swept_m2 / (across_m * positive("along_m", along_m)?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn grows_with_drift_from_one(a in 1.0..5e3f64, b in 1.0..5e3f64, i in 0.0..1e3f64, d in 0.0..1e4f64) {
            let n = nominal_count_sequential(a, b, i, d);
            prop_assert!(n >= 1.0 - 1e-12);
            prop_assert!(nominal_count_sequential(a, b, i, d + 1.0) > n);
        }

        #[test]
        fn inaccuracy_is_a_full_width_and_drift_one_sided(a in 1.0..5e3f64, b in 1.0..5e3f64, d in 0.0..1e4f64) {
            let by_drift = nominal_count_sequential(a, b, 0.0, d);
            let by_inaccuracy = nominal_count_sequential(a, b, 2.0 * d, 0.0);
            prop_assert!((by_drift - by_inaccuracy).abs() <= 1e-12 * by_drift);
        }
    }

    #[test]
    fn is_one_where_nothing_is_uncertain() {
        assert_eq!(nominal_count_sequential(300.0, 200.0, 0.0, 0.0), 1.0);
    }
}
