//! `RelativeSample`: what one relative registration took and how far it was off; and the table of them.

use super::RIGHT_PX;
use serde::Serialize;

/// Times of the steps of a registration, seconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepTimes {
    /// Decoding an image, and describing it (42).
    pub loading_s: f64,
    /// All descriptors against all (43).
    pub matching_s: f64,
    /// Which correspondences are kept: the second nearest descriptor is farther, and both choose each other (44).
    pub threshold_s: f64,
    /// Which of those agree on a motion. The paper has no such step; it takes the mean of all.
    pub agreement_s: f64,
    /// Shift and turn from what both views show; absent where nothing agreed.
    pub estimate_s: Option<f64>,
}

impl StepTimes {
    /// t_c: the motion from what was kept, agreement and estimate together, seconds.
    ///
    /// # References
    /// Phase C of section V.C.
    pub fn motion_s(&self) -> Option<f64> {
        self.estimate_s.map(|estimate_s| self.agreement_s + estimate_s)
    }

    /// All steps, one image being loaded, seconds; absent where nothing agreed.
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
    /// Of the program's answer; absent where it would not have given one.
    pub drift_px: Option<f64>,
    /// Of what keypoints alone agree on, as the paper has it; absent where nothing agreed.
    pub keypoint_drift_px: Option<f64>,
}

/// One pair registered with one number of descriptors. Times are medians of its runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RelativeSample {
    /// Which image, from 1.
    pub image: usize,
    /// Ground that the views share.
    pub overlap_percent: f64,
    /// Descriptors at most.
    pub limit: usize,
    /// N: descriptors found, geometric mean of both views.
    pub descriptors: f64,
    /// What it took.
    #[serde(flatten)]
    pub times: StepTimes,
    /// n: correspondences that agree.
    pub matched: usize,
    /// How far it was off. That of keypoints alone is stated whether or not the program accepted what they agree on.
    #[serde(flatten)]
    pub drifts: Drifts,
}

impl RelativeSample {
    /// Whether the program would have answered with a motion.
    pub fn is_registered(&self) -> bool {
        self.drifts.drift_px.is_some()
    }

    /// Whether it would have, and wrongly: beyond [`RIGHT_PX`].
    pub fn is_false(&self) -> bool {
        self.drifts.drift_px.is_some_and(|drift_px| drift_px > RIGHT_PX)
    }
}

const HEADER: &str = "image,overlap_percent,limit,descriptors,loading_s,matching_s,threshold_s,agreement_s,estimate_s,matched,\
                      registered,drift_px,keypoint_drift_px";

/// The table of samples, a row each; absent numbers are empty cells.
pub fn samples_csv(samples: &[RelativeSample]) -> String {
    let mut text = format!("{HEADER}\n");
    let cell = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.6}"));
    for s in samples {
        let StepTimes { loading_s, matching_s, threshold_s, agreement_s, estimate_s } = s.times;
        text.push_str(&format!(
            "{},{},{},{:.1},{loading_s:.6},{matching_s:.6},{threshold_s:.9},{agreement_s:.6},{},{},{},{},{}\n",
            s.image,
            s.overlap_percent,
            s.limit,
            s.descriptors,
            cell(estimate_s),
            s.matched,
            u8::from(s.is_registered()),
            cell(s.drifts.drift_px),
            cell(s.drifts.keypoint_drift_px)
        ));
    }
    text
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
