//! Section III: the ground extent of an image, the time limit of a relative registration, and the registration's error.

use super::CouplingError;
use super::error::{not_negative, positive};

/// The ground extent of an image in one direction, metres, from the height above ground and the full field of view in that
/// direction: b along the heading, a across it. The ground is flat and the camera looks straight down.
///
/// # Errors
/// [`CouplingError::OutOfDomain`] for a height that is not positive, or a field of view outside (0, pi).
///
/// # Example
/// A field of view of 90 degrees covers twice the height.
/// ```
/// let along_m = overfly_core::coupling::ground_extent_m(500.0, 90f64.to_radians()).unwrap();
/// assert!((along_m - 1000.0).abs() < 1e-9);
/// ```
///
/// # References
/// Section III.A: b = 2 h tan(theta_l / 2), not numbered.
pub fn ground_extent_m(height_m: f64, field_of_view_rad: f64) -> Result<f64, CouplingError> {
    positive("height_m", height_m)?;
    if !(field_of_view_rad > 0.0 && field_of_view_rad < std::f64::consts::PI) {
        let expected = "between 0 and pi";
        return Err(CouplingError::OutOfDomain { name: "field_of_view_rad", value: field_of_view_rad, expected });
    }
    Ok(2.0 * height_m * (field_of_view_rad / 2.0).tan())
}

/// t_lim, seconds: the time after which two images of straight flight share no ground. A relative registration must end
/// earlier (t_exe < t_lim). At t_lim the overlap is zero; for a registration that needs an overlap see [`overlap_limit_s`].
///
/// # Errors
/// [`CouplingError::OutOfDomain`] where an argument is not positive.
///
/// # References
/// Section III.A: t_lim = b / v, not numbered.
pub fn scan_limit_s(along_m: f64, speed_mps: f64) -> Result<f64, CouplingError> {
    Ok(positive("along_m", along_m)? / positive("speed_mps", speed_mps)?)
}

/// The time of straight flight, seconds, after which two images still share the fraction `overlap` (in [0, 1)) of their
/// ground: (1 - overlap) b / v. Equals [`scan_limit_s`] at overlap 0.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # Example
/// Images of 600 m at 30 m/s share a quarter after 15 s.
/// ```
/// assert_eq!(overfly_core::coupling::overlap_limit_s(600.0, 30.0, 0.25), Ok(15.0));
/// ```
pub fn overlap_limit_s(along_m: f64, speed_mps: f64, overlap: f64) -> Result<f64, CouplingError> {
    if !(0.0..1.0).contains(&overlap) {
        return Err(CouplingError::OutOfDomain { name: "overlap", value: overlap, expected: "from 0 to below 1" });
    }
    Ok((1.0 - overlap) * scan_limit_s(along_m, speed_mps)?)
}

/// Standard deviation of the mean displacement of `matched_count` descriptor pairs with `pair_sigma_m` each, metres:
/// sigma / sqrt(n). The errors of the pairs are assumed independent and centred. A common error does not average out (see
/// [`DriftLaw`](super::DriftLaw)).
///
/// # Errors
/// [`CouplingError::OutOfDomain`] for fewer than one pair.
///
/// # References
/// Section III.A, not numbered. For a Gaussian the mean absolute error m of figure 1 is sqrt(2 / pi) times this value.
pub fn displacement_sigma_m(pair_sigma_m: f64, matched_count: f64) -> Result<f64, CouplingError> {
    not_negative("pair_sigma_m", pair_sigma_m)?;
    positive("matched_count", matched_count)?;
    if matched_count < 1.0 {
        return Err(CouplingError::OutOfDomain { name: "matched_count", value: matched_count, expected: "at least 1" });
    }
    Ok(pair_sigma_m / matched_count.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn two_rays_from_the_camera_meet_the_ground_an_extent_apart() {
        for (height_m, view_deg) in [(120.0, 20.0f64), (500.0, 64.0), (3000.0, 130.0)] {
            // A ray of slope angle g falls one metre for every tan(g) aside: march it down in small steps.
            let half = view_deg.to_radians() / 2.0;
            let (mut aside, mut down) = (0.0, 0.0);
            let step = height_m / 1e5;
            while down < height_m {
                aside += step / half.cos() * half.sin();
                down += step;
            }
            let extent = ground_extent_m(height_m, view_deg.to_radians()).unwrap();
            assert!((extent - 2.0 * aside).abs() < 1e-4 * extent, "{extent} against {aside}");
        }
    }

    #[test]
    fn images_taken_at_the_limit_share_no_ground_and_before_it_the_stated_part() {
        let (along_m, speed_mps) = (480.0, 37.0);
        for overlap in [0.0, 0.1, 0.5, 0.95] {
            let flown_m = speed_mps * overlap_limit_s(along_m, speed_mps, overlap).unwrap();
            let shared_m = (along_m - flown_m).max(0.0);
            assert!((shared_m / along_m - overlap).abs() < 1e-12);
        }
        assert_eq!(overlap_limit_s(along_m, speed_mps, 0.0), scan_limit_s(along_m, speed_mps));
    }

    #[test]
    fn the_mean_of_n_drawn_errors_spreads_by_sigma_over_root_n() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for n in [4usize, 25, 100] {
            let draws = 4000;
            let mut square = 0.0;
            for _ in 0..draws {
                // Uniform in +-sqrt(3): standard deviation 1.
                let mean = (0..n).map(|_| rng.random_range(-1.0..1.0) * 3f64.sqrt()).sum::<f64>() / n as f64;
                square += mean * mean;
            }
            let seen = (square / draws as f64).sqrt();
            let stated = displacement_sigma_m(1.0, n as f64).unwrap();
            // 4000 draws know a standard deviation to 1 / sqrt(8000) = 1.1 %; four of these.
            assert!((seen / stated - 1.0).abs() < 0.045, "{seen} against {stated}");
        }
    }

    #[test]
    fn refuses_what_no_camera_does() {
        assert!(ground_extent_m(0.0, 1.0).is_err() && ground_extent_m(100.0, 3.2).is_err());
        assert!(ground_extent_m(100.0, f64::NAN).is_err() && scan_limit_s(100.0, 0.0).is_err());
        assert!(overlap_limit_s(100.0, 10.0, 1.0).is_err() && displacement_sigma_m(1.0, 0.5).is_err());
    }
}
