//! The time of a relative registration: loading, matching, thresholding and estimating, from the number of descriptors.

use super::CouplingError;
use super::error::{not_negative, positive};
use serde::{Deserialize, Serialize};

/// A_c of the paper's machine, seconds per descriptor (figure 12).
pub const PAPER_SECONDS_PER_DESCRIPTOR: f64 = 234e-6;
/// L as printed under figure 12, seconds. Nine microseconds for a 512 x 512 image would be 29 gigabytes per second from the
/// disk, so this is probably a misprint.
pub const PAPER_LOAD_S: f64 = 9e-6;
/// L as it is probably meant: nine milliseconds, in seconds.
pub const PROBABLE_LOAD_S: f64 = 9e-3;
/// Ground sample distance of the paper's 72 images, metres per pixel (section V.D).
pub const PAPER_GSD_M_PER_PX: f64 = 1.19;
/// Edge of the paper's images, pixels (section V.D).
pub const PAPER_IMAGE_PX: f64 = 512.0;

/// N, the number of descriptors on an image: density times ground area.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # References
/// Section V.C: N = rho a b, not numbered.
pub fn descriptor_count(descriptors_per_m2: f64, across_m: f64, along_m: f64) -> Result<f64, CouplingError> {
    let density = not_negative("descriptors_per_m2", descriptors_per_m2)?;
    Ok(density * positive("across_m", across_m)? * positive("along_m", along_m)?)
}

/// The constants of one machine and one descriptor. The paper prints A_c and L; t0, B and t_c only appear in its figures 13
/// and 14.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RelativeCost {
    /// A_c: time to describe one keypoint, seconds.
    pub seconds_per_descriptor: f64,
    /// L: time to read an image into memory, seconds.
    pub load_s: f64,
    /// t0 of (43, 45), which is not t0 of (9): time to compare one pair of descriptors, seconds.
    pub pair_comparison_s: f64,
    /// B: time to accept or reject one correspondence, seconds.
    pub threshold_s_per_descriptor: f64,
    /// t_c: time to estimate displacement and rotation, seconds.
    pub estimate_s: f64,
}

impl RelativeCost {
    /// t_l, seconds: the time to read one image and describe `descriptor_count` keypoints.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`], also for the constants themselves.
    ///
    /// # References
    /// Equation 42.
    pub fn loading_s(&self, descriptor_count: f64) -> Result<f64, CouplingError> {
        let n = not_negative("descriptor_count", descriptor_count)?;
        let each_s = not_negative("seconds_per_descriptor", self.seconds_per_descriptor)?;
        Ok(each_s * n + not_negative("load_s", self.load_s)?)
    }

    /// t_m, seconds: the time to compare every descriptor of one image with every descriptor of the other, where both have
    /// `descriptor_count`.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Equation 43.
    pub fn matching_s(&self, descriptor_count: f64) -> Result<f64, CouplingError> {
        let n = not_negative("descriptor_count", descriptor_count)?;
        Ok(not_negative("pair_comparison_s", self.pair_comparison_s)? * n * n)
    }

    /// t_tau, seconds: the time to threshold the correspondences, independent of the overlap.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Equation 44.
    pub fn threshold_s(&self, descriptor_count: f64) -> Result<f64, CouplingError> {
        let n = not_negative("descriptor_count", descriptor_count)?;
        Ok(not_negative("threshold_s_per_descriptor", self.threshold_s_per_descriptor)? * n)
    }

    /// T_exe, seconds: the time of a whole relative registration with the descriptors of the earlier image in memory. This is
    /// `relative_s` of [`CouplingParameters`](super::CouplingParameters), t0 of (9) and (17).
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # Example
    /// 1000 descriptors of 234 microseconds, 9 ms, a million comparisons of 20 ns, 1 microsecond each, 2 ms.
    /// ```
    /// let cost = overfly_core::coupling::RelativeCost {
    ///     seconds_per_descriptor: 234e-6, load_s: 9e-3, pair_comparison_s: 20e-9,
    ///     threshold_s_per_descriptor: 1e-6, estimate_s: 2e-3,
    /// };
    /// assert!((cost.total_s(1000.0).unwrap() - 0.266).abs() < 1e-12);
    /// ```
    ///
    /// # References
    /// Equation 45.
    pub fn total_s(&self, descriptor_count: f64) -> Result<f64, CouplingError> {
        let steps_s = self.loading_s(descriptor_count)?
            + self.matching_s(descriptor_count)?
            + self.threshold_s(descriptor_count)?;
        Ok(steps_s + not_negative("estimate_s", self.estimate_s)?)
    }

    /// The largest number of descriptors with which a relative registration ends within `limit_s` (for instance
    /// [`overlap_limit_s`](super::overlap_limit_s)). The error decreases with that number, so it is the best choice in the
    /// sense of section III. Infinite where descriptors take no time.
    ///
    /// # Errors
    /// [`CouplingError::NoTime`] where loading and estimating alone take longer; [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Section III.A and figure 1, where the time is proportional to n. By (45) the time is quadratic; the result is the
    /// larger root.
    pub fn most_descriptors(&self, limit_s: f64) -> Result<f64, CouplingError> {
        let least_s = self.total_s(0.0)?;
        let left_s = not_negative("limit_s", limit_s)? - least_s;
        if left_s < 0.0 {
            return Err(CouplingError::NoTime { least_s, limit_s });
        }
        let linear =
            self.seconds_per_descriptor + not_negative("threshold_s_per_descriptor", self.threshold_s_per_descriptor)?;
        let square = not_negative("pair_comparison_s", self.pair_comparison_s)?;
        if linear == 0.0 && square == 0.0 {
            return Ok(f64::INFINITY);
        }
        // The root of t0 N^2 + (A_c + B) N - left = 0, in the form without cancellation for small t0.
        Ok(2.0 * left_s / (linear + (linear * linear + 4.0 * square * left_s).sqrt()).max(f64::MIN_POSITIVE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const COST: RelativeCost = RelativeCost {
        seconds_per_descriptor: PAPER_SECONDS_PER_DESCRIPTOR,
        load_s: PROBABLE_LOAD_S,
        pair_comparison_s: 20e-9,
        threshold_s_per_descriptor: 1e-6,
        estimate_s: 2e-3,
    };

    #[test]
    fn the_parts_are_counted_as_a_program_would_do_them() {
        // Every step spelled out: describe each, compare each with each, sift each.
        let n = 60;
        let (mut describing, mut comparing, mut sifting) = (0.0, 0.0, 0.0);
        for _ in 0..n {
            describing += COST.seconds_per_descriptor;
            sifting += COST.threshold_s_per_descriptor;
            for _ in 0..n {
                comparing += COST.pair_comparison_s;
            }
        }
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(COST.loading_s(60.0).unwrap(), describing + COST.load_s));
        assert!(near(COST.matching_s(60.0).unwrap(), comparing));
        assert!(near(COST.threshold_s(60.0).unwrap(), sifting));
        let sum = describing + COST.load_s + comparing + sifting + COST.estimate_s;
        assert!(near(COST.total_s(60.0).unwrap(), sum));
    }

    #[test]
    fn the_printed_load_reads_faster_than_any_disk() {
        let bytes = PAPER_IMAGE_PX * PAPER_IMAGE_PX;
        assert!(bytes / PAPER_LOAD_S > 29e9 && bytes / PROBABLE_LOAD_S < 30e6);
        // As printed it would be worth a twenty-sixth of one descriptor, which figure 12 could not show.
        let descriptors = |load_s: f64| load_s / PAPER_SECONDS_PER_DESCRIPTOR;
        assert!(descriptors(PAPER_LOAD_S) < 1.0 / 25.9 && descriptors(PROBABLE_LOAD_S) > 38.0);
    }

    #[test]
    fn the_papers_pixel_is_level_16_at_the_equator_and_smaller_at_avignon() {
        let equator_m_per_px = std::f64::consts::TAU * 6_378_137.0 / PAPER_IMAGE_PX / 2f64.powi(16);
        assert!((equator_m_per_px - 1.194).abs() < 0.001);
        assert!((PAPER_GSD_M_PER_PX - equator_m_per_px).abs() < 0.005);
        assert!((equator_m_per_px * 43.95f64.to_radians().cos() - 0.86).abs() < 0.005);
        // 72 such images are the 27 km^2 of section V.D only at the equator's pixel; at Avignon's they are 14.
        let area_km2 = |gsd: f64| 72.0 * (PAPER_IMAGE_PX * gsd).powi(2) / 1e6;
        assert!((area_km2(PAPER_GSD_M_PER_PX) - 27.0).abs() < 0.5 && (area_km2(0.86) - 14.0).abs() < 0.5);
    }

    proptest! {
        #[test]
        fn the_most_descriptors_use_up_the_time(
            a in 0.0..1e-3f64, t0 in 0.0..1e-6f64, b in 1e-9..1e-4f64, spare in 1e-3..100.0f64,
        ) {
            let cost = RelativeCost { seconds_per_descriptor: a, pair_comparison_s: t0, threshold_s_per_descriptor: b, ..COST };
            let limit_s = cost.total_s(0.0).unwrap() + spare;
            let most = cost.most_descriptors(limit_s).unwrap();
            prop_assume!(most < 1e9);
            prop_assert!((cost.total_s(most).unwrap() - limit_s).abs() < 1e-9 * limit_s);
        }
    }

    #[test]
    fn says_when_there_is_no_time_at_all() {
        assert_eq!(COST.most_descriptors(0.010).unwrap_err().code(), "no_time");
        assert_eq!(COST.most_descriptors(COST.load_s + COST.estimate_s), Ok(0.0));
        let free = RelativeCost {
            seconds_per_descriptor: 0.0,
            threshold_s_per_descriptor: 0.0,
            pair_comparison_s: 0.0,
            ..COST
        };
        assert_eq!(free.most_descriptors(1.0), Ok(f64::INFINITY));
        assert!(COST.total_s(f64::NAN).is_err() && RelativeCost { load_s: -1.0, ..COST }.loading_s(1.0).is_err());
    }

    #[test]
    fn descriptors_are_density_times_area() {
        assert_eq!(descriptor_count(0.002, 600.0, 400.0), Ok(480.0));
        assert!(descriptor_count(-1.0, 600.0, 400.0).is_err());
    }
}
