//! `RelativeSample`: the times and the error of one relative registration; and their table.

use super::csv_file::{Decimals, Shortest, csv_text};
use super::motions::RIGHT_PX;
use serde::Serialize;

/// Times of the steps of a registration, seconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepTimes {
    /// Decoding and describing an image (42).
    pub loading_s: f64,
    /// Comparing all descriptors with all (43).
    pub matching_s: f64,
    /// Choosing the correspondences to keep: those whose second nearest descriptor is farther and that choose each
    /// other (44).
    pub threshold_s: f64,
    /// Finding the correspondences that agree on a motion. The paper has no such step; it takes the mean of all.
    pub agreement_s: f64,
    /// Estimating shift and turn from what both views show; absent if nothing agreed.
    pub estimate_s: Option<f64>,
}

impl StepTimes {
    /// t_c: time of the motion from the kept correspondences, agreement and estimate together, seconds.
    ///
    /// # References
    /// Phase C of section V.C.
    pub fn motion_s(&self) -> Option<f64> {
        self.estimate_s.map(|estimate_s| self.agreement_s + estimate_s)
    }

    /// Time of all steps, with one image loaded, seconds; absent if nothing agreed.
    ///
    /// # References
    /// Equation 45.
    pub fn total_s(&self) -> Option<f64> {
        self.motion_s().map(|motion_s| self.loading_s + self.matching_s + self.threshold_s + motion_s)
    }
}

/// Distances between found and true displacement of an image's centre, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Drifts {
    /// Drift of the program's answer; absent if the program would have given none.
    pub drift_px: Option<f64>,
    /// Drift of the motion on which keypoints alone agree, as in the paper; absent if nothing agreed.
    pub keypoint_drift_px: Option<f64>,
}

/// One pair registered with one descriptor limit. Times are medians of its runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RelativeSample {
    /// Number of the image, from 1.
    pub image: usize,
    /// Share of the ground that both views show, per cent.
    pub overlap_percent: f64,
    /// Descriptor limit.
    pub limit: usize,
    /// N: descriptors found, geometric mean of both views.
    pub descriptors: f64,
    /// Times of the steps.
    #[serde(flatten)]
    pub times: StepTimes,
    /// n: agreeing correspondences.
    pub matched: usize,
    /// Drifts. The drift of keypoints alone is stated even if the program rejects the motion.
    #[serde(flatten)]
    pub drifts: Drifts,
}

impl RelativeSample {
    /// Whether the program would have answered with a motion.
    pub fn is_registered(&self) -> bool {
        self.drifts.drift_px.is_some()
    }

    /// Whether the program would have answered with an error beyond [`RIGHT_PX`].
    pub fn is_false(&self) -> bool {
        self.drifts.drift_px.is_some_and(|drift_px| drift_px > RIGHT_PX)
    }
}

/// A row of `samples.csv`.
#[derive(Serialize, Default)]
struct RegistrationRow {
    image: usize,
    overlap_percent: Shortest,
    limit: usize,
    descriptors: Decimals<1>,
    loading_s: Decimals<6>,
    matching_s: Decimals<6>,
    threshold_s: Decimals<9>,
    agreement_s: Decimals<6>,
    estimate_s: Option<Decimals<6>>,
    matched: usize,
    registered: u8,
    drift_px: Option<Decimals<6>>,
    keypoint_drift_px: Option<Decimals<6>>,
}

impl RegistrationRow {
    fn new(s: &RelativeSample) -> Self {
        Self {
            image: s.image,
            overlap_percent: Shortest(s.overlap_percent),
            limit: s.limit,
            descriptors: Decimals(s.descriptors),
            loading_s: Decimals(s.times.loading_s),
            matching_s: Decimals(s.times.matching_s),
            threshold_s: Decimals(s.times.threshold_s),
            agreement_s: Decimals(s.times.agreement_s),
            estimate_s: s.times.estimate_s.map(Decimals),
            matched: s.matched,
            registered: u8::from(s.is_registered()),
            drift_px: s.drifts.drift_px.map(Decimals),
            keypoint_drift_px: s.drifts.keypoint_drift_px.map(Decimals),
        }
    }
}

/// The samples as CSV, a row each; absent numbers are empty cells.
pub fn samples_csv(samples: &[RelativeSample]) -> String {
    csv_text(samples.iter().map(RegistrationRow::new))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_a_registration_is_that_of_its_steps() {
        let times = StepTimes {
            loading_s: 0.006,
            matching_s: 0.001,
            threshold_s: 1e-6,
            agreement_s: 0.0005,
            estimate_s: Some(0.002),
        };
        assert!((times.total_s().unwrap() - 0.009_501).abs() < 1e-12);
        assert_eq!(StepTimes { estimate_s: None, ..times }.total_s(), None);
    }

    #[test]
    fn a_row_says_what_is_absent_by_empty_cells() {
        let times =
            StepTimes { loading_s: 0.006, matching_s: 0.001, threshold_s: 1e-6, agreement_s: 0.0, estimate_s: None };
        let drifts = Drifts { drift_px: None, keypoint_drift_px: Some(250.0) };
        let sample =
            RelativeSample { image: 3, overlap_percent: 10.0, limit: 75, descriptors: 74.5, times, matched: 4, drifts };
        assert!(!sample.is_registered() && !sample.is_false());
        let text = samples_csv(&[sample]);
        let [header, row] = text.lines().collect::<Vec<_>>()[..] else { panic!("{text}") };
        assert_eq!(row, "3,10,75,74.5,0.006000,0.001000,0.000001000,0.000000,,4,0,,250.000000");
        assert_eq!(header.split(',').count(), row.split(',').count());
    }
}
