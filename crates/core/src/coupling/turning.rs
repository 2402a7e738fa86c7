//! Areas of the combined mode (section IV.D): the positions that an aircraft can reach in a stretch of flight, and the ground
//! that its image can then show.
//!
//! The aircraft starts at the origin and flies ahead (y of figure 6); right is x. `path_m` is v t_exe. The module `region` has
//! the shape itself as a polygon on the map.

use super::CouplingError;
use super::error::{not_negative, positive, positive_or_infinite};
use crate::geodesy::BodyOffset;
use std::f64::consts::FRAC_PI_2;

/// The end of `path_m` metres of flight on a circle of `radius_m` to the right, relative to the start and the heading there;
/// straight ahead for an infinite radius.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # Example
/// The end of a quarter of a circle of 100 m.
/// ```
/// let end = overfly_core::coupling::turn_point(100.0 * std::f64::consts::FRAC_PI_2, 100.0).unwrap();
/// assert!((end.right_m - 100.0).abs() < 1e-9 && (end.ahead_m - 100.0).abs() < 1e-9);
/// ```
///
/// # References
/// Equation 23, with 1 - cos as 2 sin^2 of the half angle, which does not cancel on wide circles.
pub fn turn_point(path_m: f64, radius_m: f64) -> Result<BodyOffset, CouplingError> {
    let turned_rad = turned_rad(path_m, radius_m)?;
    if turned_rad == 0.0 {
        return Ok(BodyOffset { right_m: 0.0, ahead_m: path_m });
    }
    let half = (turned_rad / 2.0).sin();
    Ok(BodyOffset { right_m: 2.0 * radius_m * half * half, ahead_m: radius_m * turned_rad.sin() })
}

/// v t_exe / R, radians: the turn in `path_m` metres on a circle of `radius_m`. The paper's formulas require that it is far
/// below 1.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # References
/// Equation 24.
pub fn turned_rad(path_m: f64, radius_m: f64) -> Result<f64, CouplingError> {
    Ok(not_negative("path_m", path_m)? / positive_or_infinite("radius_m", radius_m)?)
}

/// Returns `path / radius` if it is at most a quarter of a turn.
fn up_to_a_quarter_turn(path_m: f64, min_turn_radius_m: f64) -> Result<f64, CouplingError> {
    let turned_rad = turned_rad(path_m, min_turn_radius_m)?;
    // R pi / 2 over R may round to just above a quarter of a turn.
    if turned_rad > FRAC_PI_2 * (1.0 + 1e-12) {
        return Err(CouplingError::BeyondQuarterTurn { path_m, min_turn_radius_m });
    }
    Ok(turned_rad)
}

/// The exact area under the right part of the curve on which all circles of at least `min_turn_radius_m` end (figure 7),
/// square metres.
///
/// # Errors
/// [`CouplingError::BeyondQuarterTurn`], [`CouplingError::OutOfDomain`].
///
/// # References
/// Equation 25. With u = s / R it is s^2 times the integral of sin(u) (u sin(u) - 1 + cos(u)) / u^3 from 0 to s / R_min,
/// whose power series is summed here.
pub fn end_curve_area_m2(path_m: f64, min_turn_radius_m: f64) -> Result<f64, CouplingError> {
    let u = up_to_a_quarter_turn(path_m, min_turn_radius_m)?;
    // Terms of u^(2k+1) in the numerator: (-1)^k (4^k / (2k+1)! - 4^k / (2 (2k)!) - 1 / (2k+1)!). 18 terms reach 1e-17.
    let (mut sum, mut even_factorial, mut power) = (0.0, 1.0, u);
    for k in 1..=18 {
        let k = f64::from(k);
        even_factorial *= (2.0 * k - 1.0) * 2.0 * k;
        let (fours, odd_factorial) = (4f64.powf(k), even_factorial * (2.0 * k + 1.0));
        let sign = if k % 2.0 == 0.0 { 1.0 } else { -1.0 };
        let numerator = sign * ((fours - 1.0) / odd_factorial - fours / (2.0 * even_factorial));
        sum += numerator * power / (2.0 * k - 1.0);
        power *= u * u;
    }
    Ok(path_m * path_m * sum)
}

/// [`end_curve_area_m2`] to leading order: s^3 / (2 R_min), square metres. Too large by the share 5/36 (s / R_min)^2.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # References
/// Equation 26.
pub fn end_curve_area_paper_m2(path_m: f64, min_turn_radius_m: f64) -> Result<f64, CouplingError> {
    Ok(path_m * path_m * turned_rad(path_m, min_turn_radius_m)? / 2.0)
}

/// One wing of figure 5: the area that an aircraft can reach on the right of its first heading, square metres, with a turn
/// radius of at least `min_turn_radius_m` at every moment and a flight of at most `path_m`: s^3 / (6 R_min).
///
/// Exact up to a quarter of a turn. A turn followed by straight flight ends between the tightest circle and its involute,
/// whose tangents have the lengths s - R phi. Half the integral of their squares over phi in [0, s / R] is s^3 / (6 R). No
/// other path reaches further, and no path this short ends inside the circle.
///
/// # Errors
/// [`CouplingError::BeyondQuarterTurn`], [`CouplingError::OutOfDomain`].
///
/// # References
/// Between equations 26 and 27, where it is given to leading order for circles: (26) minus the s^3 / (3 R) below the tightest
/// one.
pub fn wing_area_m2(path_m: f64, min_turn_radius_m: f64) -> Result<f64, CouplingError> {
    Ok(path_m * path_m * up_to_a_quarter_turn(path_m, min_turn_radius_m)? / 6.0)
}

/// The part of a wing that circles of a constant radius reach, square metres: s^3 / (6 R) (1 - u^2 / 60 + ...), u = s / R.
///
/// # Errors
/// [`CouplingError::BeyondQuarterTurn`], [`CouplingError::OutOfDomain`].
///
/// # References
/// Figure 5. Points of arc length l and curvature c have the area element (1 - cos(c l)) / c^2. Its integral over l up to s is
/// s^2 times the integral of (u - sin(u)) / u^3, whose power series is summed here.
pub fn circle_wing_area_m2(path_m: f64, min_turn_radius_m: f64) -> Result<f64, CouplingError> {
    let u = up_to_a_quarter_turn(path_m, min_turn_radius_m)?;
    let (mut sum, mut term) = (0.0, u / 6.0);
    for k in 0..12 {
        let k = f64::from(k);
        sum += term / (2.0 * k + 1.0);
        term *= -u * u / ((2.0 * k + 4.0) * (2.0 * k + 5.0));
    }
    Ok(path_m * path_m * sum)
}

/// Lambda as printed, square metres: 2 s^3 / (3 R_min) + a s. Its wings are twice as large as the paper's own derivation gives,
/// and it leaves out the image's length, the image's width where the aircraft turns, and I.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # References
/// Equation 27. See [`swept_area_m2`] and [`shown_area_m2`].
pub fn swept_area_paper_m2(across_m: f64, path_m: f64, min_turn_radius_m: f64) -> Result<f64, CouplingError> {
    let wings_m2 = 2.0 / 3.0 * path_m * path_m * turned_rad(path_m, min_turn_radius_m)?;
    Ok(wings_m2 + positive("across_m", across_m)? * path_m)
}

/// Lambda with corrected wings, square metres: s^3 / (3 R_min) + a s, the area that the image's lower edge can sweep without
/// a change of direction.
///
/// # Errors
/// [`CouplingError::BeyondQuarterTurn`], [`CouplingError::OutOfDomain`].
///
/// # References
/// Equation 27 by its own derivation: one wing on each side, and the rectangle between them.
pub fn swept_area_m2(across_m: f64, path_m: f64, min_turn_radius_m: f64) -> Result<f64, CouplingError> {
    Ok(2.0 * wing_area_m2(path_m, min_turn_radius_m)? + positive("across_m", across_m)? * path_m)
}

/// The area that an image of `across_m` by `along_m` can show, square metres: the set of reachable positions dilated by the
/// image without a change of its direction. To include the error of the prior, add I to both edges.
///
/// The area is s^3 / (3 R) + a s + 2 b R (1 - cos(s / R)) + a b. Every line across or along the heading meets the set in at
/// most one segment. So a dilation by a adds a times the extent ahead (s), and a dilation by b adds b times the extent across
/// (twice R (1 - cos), the end of the tightest circle, plus a).
///
/// # Errors
/// [`CouplingError::BeyondQuarterTurn`], [`CouplingError::OutOfDomain`].
///
/// # Example
/// Straight flight of 100 m with a 600 x 400 m image: 600 x 500.
/// ```
/// assert_eq!(overfly_core::coupling::shown_area_m2(600.0, 400.0, 100.0, f64::INFINITY), Ok(300_000.0));
/// ```
///
/// # References
/// Replaces equation 27, which only contains the first half.
pub fn shown_area_m2(across_m: f64, along_m: f64, path_m: f64, min_turn_radius_m: f64) -> Result<f64, CouplingError> {
    let swept_m2 = swept_area_m2(across_m, path_m, min_turn_radius_m)?;
    let aside_m = turn_point(path_m, min_turn_radius_m)?.right_m;
    Ok(swept_m2 + positive("along_m", along_m)? * (across_m + 2.0 * aside_m))
}

#[cfg(test)]
mod tests;
