//! `RelativeLaws`: the laws (42) to (45) and the law of drift, fitted to registrations of known pairs.

use super::drift_curve::{DriftCurve, Estimator};
use super::error::TrialError;
use super::quantiles::Quantiles;
use super::relative_sample::{Drifts, RelativeSample, StepTimes};
use overfly_core::coupling::{RelativeCost, fit_line, fit_slope};
use overfly_core::registration::relative::QUICK;
use serde::Serialize;

/// All samples of one descriptor limit. Times are medians over pairs; drifts are root mean squares over the
/// registered pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DescriptorRow {
    /// Descriptor limit.
    pub limit: usize,
    /// N: mean number of descriptors found.
    pub descriptors: f64,
    /// Time of each step.
    #[serde(flatten)]
    pub times: StepTimes,
    /// Time of the motion from the kept correspondences: agreement and estimate together, seconds.
    pub motion_s: Option<f64>,
    /// Time of all steps together, seconds.
    pub total_s: Option<f64>,
    /// n: median number of agreeing matches over the registered pairs.
    pub matched: f64,
    /// Drifts of the registered pairs.
    #[serde(flatten)]
    pub drifts: Drifts,
    /// Registered pairs.
    pub registered: usize,
    /// Registered pairs with an error of more than a pixel.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Pairs tried.
    pub pairs: usize,
}

/// Constants of relative registration on one machine, and the rows they were fitted to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RelativeLaws {
    /// The constants A_c, L, t0, B and t_c.
    pub relative: RelativeCost,
    /// N with the usual descriptor limit of registrations.
    pub descriptor_count: f64,
    /// n with the same limit.
    pub matched_count: f64,
    /// T_exe of (45) with these constants and N, seconds.
    pub relative_s: f64,
    /// The rows, by descriptor limit.
    pub rows: Vec<DescriptorRow>,
    /// Drift of the program's answers.
    pub program: DriftCurve,
    /// Drift of keypoints alone, for the same pairs.
    pub keypoints: DriftCurve,
    /// Drift of keypoints alone, for every pair, chance agreements included.
    pub keypoints_unchecked: DriftCurve,
}

impl RelativeLaws {
    /// Fits the laws to samples, in any order. The laws are fitted to the rows (medians of many pairs); t_c is the
    /// median with the usual descriptor limit of registrations.
    ///
    /// # Errors
    /// [`TrialError::Option`] if no pair was registered.
    pub fn fit(samples: &[RelativeSample]) -> Result<Self, TrialError> {
        let expected = "at least one; take photos with more texture, or more pairs";
        let no_pair = || TrialError::Option { name: "registered pairs", value: 0.0, expected };
        let rows = rows(samples);
        let points = |x: fn(f64) -> f64, y: fn(&DescriptorRow) -> f64| -> Vec<(f64, f64)> {
            rows.iter().map(|r| (x(r.descriptors), y(r))).collect()
        };
        let usual = rows.iter().filter(|r| r.registered > 0).min_by_key(|r| r.limit.abs_diff(QUICK.limit));
        let usual = usual.ok_or_else(no_pair)?;
        let (descriptor_count, matched_count) = (usual.descriptors, usual.matched);
        let [load_s, seconds_per_descriptor] = fit_line(&points(|n| n, |r| r.times.loading_s)).ok_or_else(no_pair)?;
        let relative = RelativeCost {
            seconds_per_descriptor,
            load_s,
            pair_comparison_s: fit_slope(&points(|n| n * n, |r| r.times.matching_s)).unwrap_or(0.0),
            threshold_s_per_descriptor: fit_slope(&points(|n| n, |r| r.times.threshold_s)).unwrap_or(0.0),
            estimate_s: usual.motion_s.ok_or_else(no_pair)?,
        };
        let relative_s = relative.total_s(descriptor_count).map_err(|_| no_pair())?;
        let [program, keypoints, keypoints_unchecked] =
            [Estimator::Program, Estimator::Keypoints, Estimator::KeypointsUnchecked]
                .map(|estimator| DriftCurve::fit(estimator, samples));
        Ok(Self {
            relative,
            descriptor_count,
            matched_count,
            relative_s,
            rows,
            program,
            keypoints,
            keypoints_unchecked,
        })
    }
}

fn rows(samples: &[RelativeSample]) -> Vec<DescriptorRow> {
    let mut limits: Vec<usize> = samples.iter().map(|s| s.limit).collect();
    limits.sort_unstable();
    limits.dedup();
    limits.into_iter().filter_map(|limit| row(limit, samples)).collect()
}

fn row(limit: usize, samples: &[RelativeSample]) -> Option<DescriptorRow> {
    let of_limit: Vec<&RelativeSample> = samples.iter().filter(|s| s.limit == limit).collect();
    let registered: Vec<&RelativeSample> = of_limit.iter().copied().filter(|s| s.is_registered()).collect();
    let median = |of: &dyn Fn(&RelativeSample) -> Option<f64>| {
        Quantiles::from_values(of_limit.iter().filter_map(|s| of(s)).collect()).map(|s| s.median)
    };
    let rms = |of: fn(&Drifts) -> Option<f64>| {
        let squares: Vec<f64> = registered.iter().filter_map(|s| of(&s.drifts)).map(|d| d * d).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    Some(DescriptorRow {
        limit,
        descriptors: of_limit.iter().map(|s| s.descriptors).sum::<f64>() / of_limit.len() as f64,
        times: StepTimes {
            loading_s: median(&|s| Some(s.times.loading_s))?,
            matching_s: median(&|s| Some(s.times.matching_s))?,
            threshold_s: median(&|s| Some(s.times.threshold_s))?,
            agreement_s: median(&|s| Some(s.times.agreement_s))?,
            estimate_s: median(&|s| s.times.estimate_s),
        },
        motion_s: median(&|s| s.times.motion_s()),
        total_s: median(&|s| s.times.total_s()),
        matched: Quantiles::from_values(registered.iter().map(|s| s.matched as f64).collect())
            .map_or(0.0, |s| s.median),
        drifts: Drifts { drift_px: rms(|d| d.drift_px), keypoint_drift_px: rms(|d| d.keypoint_drift_px) },
        registered: registered.len(),
        wrong: registered.iter().filter(|s| s.is_false()).count(),
        pairs: of_limit.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::drift_curve::tests::sample;
    use super::*;

    #[test]
    fn finds_the_constants_that_samples_were_made_of() {
        // A drift of 0.6 px for one pair and a floor of 0.02 px.
        let samples: Vec<_> = [(100, 90.0, 20), (600, 560.0, 150), (2400, 2100.0, 700)]
            .map(|(limit, n, matched)| sample(limit, n, matched, 0.02f64.hypot(0.6 / (matched as f64).sqrt())))
            .to_vec();
        let found = RelativeLaws::fit(&samples).unwrap();
        let near = |found: f64, made: f64| assert!((found / made - 1.0).abs() < 1e-6, "{found} {made}");
        near(found.relative.load_s, 0.004);
        near(found.relative.seconds_per_descriptor, 3e-6);
        near(found.relative.pair_comparison_s, 5e-9);
        near(found.relative.threshold_s_per_descriptor, 2e-9);
        near(found.relative.estimate_s, 0.003);
        near(found.relative_s, 0.004 + 3e-6 * 560.0 + 5e-9 * 560.0 * 560.0 + 2e-9 * 560.0 + 0.003);
        near(found.program.law.unwrap().pair_drift_px, 0.6);
        near(found.program.law.unwrap().floor_px, 0.02);
        near(found.keypoints.law.unwrap().pair_drift_px, 1.8);
        near(found.matched_count, 150.0);
    }

    #[test]
    fn pairs_that_were_not_registered_count_as_tried_and_for_nothing_else() {
        let mut lost = sample(600, 560.0, 4, 300.0);
        lost.drifts = Drifts { drift_px: None, keypoint_drift_px: Some(300.0) };
        let laws = RelativeLaws::fit(&[sample(600, 560.0, 150, 0.05), lost]).unwrap();
        let row = &laws.rows[0];
        assert_eq!((row.registered, row.pairs, row.wrong, row.matched), (1, 2, 0, 150.0));
        assert_eq!(row.drifts, Drifts { drift_px: Some(0.05), keypoint_drift_px: Some(0.15000000000000002) });
        assert_eq!(RelativeLaws::fit(&[lost]).unwrap_err().code(), "bad_option");
        assert!(RelativeLaws::fit(&[]).is_err());
    }
}
