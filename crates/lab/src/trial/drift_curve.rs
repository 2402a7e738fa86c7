//! `DriftCurve`: how the drift of relative registrations falls with the number of matched descriptors, and how many
//! matches bring it below a bound.

use super::motions::RIGHT_PX;
use super::quantiles::Quantiles;
use super::relative_sample::RelativeSample;
use overfly_core::coupling::{PAPER_DRIFT_M, PAPER_GSD_M_PER_PX, PixelDriftLaw, fit_line, fit_power, r_squared};
use serde::Serialize;

/// The drift for which the needed matches are compared with the paper's 600: one metre on its pixels of 1.19 m, 0.84
/// px.
pub const DRIFT_BOUND_PX: f64 = PAPER_DRIFT_M / PAPER_GSD_M_PER_PX;

/// The estimator whose displacement is compared with the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Estimator {
    /// The program's answer, from the brightness of everything that both images show. Pairs that the program rejects
    /// have none.
    Program,
    /// The motion on which keypoints alone agree, for the pairs that the program accepts.
    Keypoints,
    /// The motion on which keypoints alone agree, chance agreements included: every pair in which any two keypoints
    /// agree. Closest to the paper, which does not test its answers.
    KeypointsUnchecked,
}

impl Estimator {
    fn drift_px(self, sample: &RelativeSample) -> Option<f64> {
        match self {
            Self::Program => sample.drifts.drift_px,
            Self::Keypoints => sample.drifts.keypoint_drift_px.filter(|_| sample.is_registered()),
            Self::KeypointsUnchecked => sample.drifts.keypoint_drift_px,
        }
    }
}

/// Registrations with about the same number of matches.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DriftBin {
    /// Mean number of matches n.
    pub matches: f64,
    /// Least number of matches.
    pub least_matches: usize,
    /// Greatest number of matches.
    pub most_matches: usize,
    /// Number of registrations.
    pub registrations: usize,
    /// Root mean square of the drifts, pixels.
    pub rms_px: f64,
    /// Drifts, pixels.
    pub drift_px: Quantiles,
}

/// From how many matches on the drift stays below [`DRIFT_BOUND_PX`], by three definitions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MatchesNeeded {
    /// The bound, pixels.
    pub drift_px: f64,
    /// The fewest matches seen. The data say nothing about fewer.
    pub fewest_seen: usize,
    /// The least n of the first bin from which on the root mean square of every bin is below the bound; absent if the
    /// last bin is not.
    pub by_bins: Option<usize>,
    /// The least n seen from which on every single registration is below the bound; absent if one with the most
    /// matches is not.
    pub by_every_registration: Option<usize>,
    /// Number of registrations from there on.
    pub registrations_from_there: usize,
    /// The n from which on the law is below the bound; absent if it never is, or if there is no law. The law does not
    /// model chance agreements, so below `fewest_seen` it extrapolates.
    pub by_law: Option<f64>,
}

impl MatchesNeeded {
    /// `by_law` in words, limited to counts that were seen.
    pub fn law_in_words(&self) -> String {
        match self.by_law {
            Some(n) if n < self.fewest_seen as f64 => format!("below {}", self.fewest_seen),
            Some(n) => format!("{n:.1}"),
            None => "none".into(),
        }
    }
}

/// Drift against matches for one estimator.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DriftCurve {
    /// The estimator.
    pub estimator: Estimator,
    /// Number of registrations tried.
    pub tried: usize,
    /// Registrations that gave a displacement. The rest of the curve describes these.
    pub scored: usize,
    /// Registrations with an error of more than a pixel.
    pub beyond_one_px: usize,
    /// The law D_U = sqrt(floor^2 + pair^2 / n) through the bins.
    pub law: Option<PixelDriftLaw>,
    /// Share of the variance of the bins' log10 that the law explains.
    pub r2: Option<f64>,
    /// Power with which the bins fall with n. Errors that average out give -1/2.
    pub power: Option<f64>,
    /// Spearman's rank correlation of n and drift over single registrations, in [-1, 1].
    pub rank_correlation: Option<f64>,
    /// Bins, fewest matches first; each spans up to a factor of 1.5 in n.
    pub bins: Vec<DriftBin>,
    /// Matches needed for a drift below the bound; absent without a registration.
    pub matches_needed: Option<MatchesNeeded>,
}

impl DriftCurve {
    /// Fits a curve to samples, in any order.
    pub fn fit(estimator: Estimator, samples: &[RelativeSample]) -> Self {
        let mut drifts: Vec<(usize, f64)> =
            samples.iter().filter_map(|s| Some((s.matched, estimator.drift_px(s)?))).filter(|d| d.0 >= 1).collect();
        drifts.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let bins = bins(&drifts);
        let law = law(&bins);
        let logs: Vec<_> = bins.iter().map(|b| (b.matches, b.rms_px.log10())).collect();
        let roots: Vec<_> = bins.iter().map(|b| (b.matches, b.rms_px)).collect();
        Self {
            estimator,
            tried: samples.len(),
            scored: drifts.len(),
            beyond_one_px: drifts.iter().filter(|d| d.1 > RIGHT_PX).count(),
            law,
            r2: law.and_then(|law| r_squared(&logs, |n| law.drift_px(n).log10())),
            power: fit_power(&roots),
            rank_correlation: rank_correlation(&drifts),
            matches_needed: needed(&drifts, &bins, law),
            bins,
        }
    }
}

/// `drifts` must be sorted by matches.
fn bins(drifts: &[(usize, f64)]) -> Vec<DriftBin> {
    let of = |n: usize| ((n as f64).ln() / 1.5f64.ln()).floor();
    let bin = |bin: &[(usize, f64)]| {
        let mean = |value: fn(&(usize, f64)) -> f64| bin.iter().map(value).sum::<f64>() / bin.len() as f64;
        Some(DriftBin {
            matches: mean(|d| d.0 as f64),
            least_matches: bin.first()?.0,
            most_matches: bin.last()?.0,
            registrations: bin.len(),
            rms_px: mean(|d| d.1 * d.1).sqrt(),
            drift_px: Quantiles::from_values(bin.iter().map(|d| d.1).collect())?,
        })
    };
    drifts.chunk_by(|a, b| of(a.0) == of(b.0)).filter_map(bin).collect()
}

/// The law through the bins: the square of the drift is linear in 1 / n.
fn law(bins: &[DriftBin]) -> Option<PixelDriftLaw> {
    let points: Vec<_> = bins.iter().map(|b| (1.0 / b.matches, b.rms_px * b.rms_px)).collect();
    let [floor2, pair2] = fit_line(&points)?;
    Some(PixelDriftLaw { pair_drift_px: pair2.sqrt(), floor_px: floor2.sqrt() })
}

/// `drifts` must be sorted by matches.
fn needed(drifts: &[(usize, f64)], bins: &[DriftBin], law: Option<PixelDriftLaw>) -> Option<MatchesNeeded> {
    let good_bins = bins.iter().rev().take_while(|b| b.rms_px < DRIFT_BOUND_PX).count();
    // Registrations with as many matches as the last bad one do not count either.
    let last_bad = drifts.iter().rev().find(|d| d.1 >= DRIFT_BOUND_PX).map_or(0, |d| d.0);
    let good = &drifts[drifts.partition_point(|d| d.0 <= last_bad)..];
    let by_law = law.and_then(|l| l.in_metres(1.0).ok()?.matches_for(DRIFT_BOUND_PX).ok()).filter(|n| n.is_finite());
    Some(MatchesNeeded {
        drift_px: DRIFT_BOUND_PX,
        fewest_seen: drifts.first()?.0,
        by_bins: bins[bins.len() - good_bins..].first().map(|b| b.least_matches),
        by_every_registration: good.first().map(|d| d.0),
        registrations_from_there: good.len(),
        by_law,
    })
}

/// Spearman's rank correlation: Pearson's correlation of the ranks; equal values share their mean rank.
fn rank_correlation(points: &[(usize, f64)]) -> Option<f64> {
    let x = ranks(points.iter().map(|p| p.0 as f64).collect());
    let y = ranks(points.iter().map(|p| p.1).collect());
    let mean = (points.len() as f64 - 1.0) / 2.0;
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>();
    let share = product(&x, &y) / (product(&x, &x) * product(&y, &y)).sqrt();
    (points.len() >= 3 && share.is_finite()).then_some(share)
}

/// Ranks of all values, from 0; equal values share their mean rank.
fn ranks(values: Vec<f64>) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    for equals in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let shared = first as f64 + (equals.len() as f64 - 1.0) / 2.0;
        equals.iter().for_each(|&i| ranks[i] = shared);
        first += equals.len();
    }
    ranks
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::relative_sample::{Drifts, StepTimes};
    use super::*;

    /// A sample that follows the laws which calibrations look for.
    pub fn sample(limit: usize, n: f64, matched: usize, drift_px: f64) -> RelativeSample {
        RelativeSample {
            image: 1,
            overlap_percent: 50.0,
            limit,
            descriptors: n,
            times: StepTimes {
                loading_s: 0.004 + 3e-6 * n,
                matching_s: 5e-9 * n * n,
                threshold_s: 2e-9 * n,
                agreement_s: 0.001,
                estimate_s: Some(0.002),
            },
            matched,
            drifts: Drifts { drift_px: Some(drift_px), keypoint_drift_px: Some(3.0 * drift_px) },
        }
    }

    /// Registrations of 2 px / sqrt(n).
    fn averaging() -> Vec<RelativeSample> {
        [1usize, 2, 4, 8, 16, 32, 64, 128].map(|n| sample(600, 500.0, n, 2.0 / (n as f64).sqrt())).to_vec()
    }

    #[test]
    fn errors_that_average_out_are_known_by_law_power_and_rank() {
        let curve = DriftCurve::fit(Estimator::Program, &averaging());
        let near = |found: f64, made: f64| assert!((found - made).abs() < 1e-6, "{found} {made}");
        near(curve.law.unwrap().pair_drift_px, 2.0);
        near(curve.law.unwrap().floor_px, 0.0);
        near(curve.r2.unwrap(), 1.0);
        near(curve.power.unwrap(), -0.5);
        near(curve.rank_correlation.unwrap(), -1.0);
        // (2 / 0.84)^2 is 5.66: of the counts seen, 8 is the first beyond.
        let needed = curve.matches_needed.unwrap();
        near(needed.by_law.unwrap(), (2.0 * 1.19f64).powi(2));
        assert_eq!(
            (needed.by_bins, needed.by_every_registration, needed.registrations_from_there),
            (Some(8), Some(8), 5)
        );
        assert_eq!((needed.fewest_seen, curve.beyond_one_px), (1, 2));
        assert_eq!(needed.law_in_words(), "5.7");
        assert_eq!(MatchesNeeded { fewest_seen: 8, ..needed }.law_in_words(), "below 8");
    }

    #[test]
    fn one_bad_registration_counts_against_all_with_as_few_matches_or_fewer() {
        let mut samples = averaging();
        samples.push(sample(600, 500.0, 32, 5.0));
        let needed = DriftCurve::fit(Estimator::Program, &samples).matches_needed.unwrap();
        assert_eq!(
            (needed.by_bins, needed.by_every_registration, needed.registrations_from_there),
            (Some(64), Some(64), 2)
        );
        samples.push(sample(600, 500.0, 4000, 5.0));
        let needed = DriftCurve::fit(Estimator::Program, &samples).matches_needed.unwrap();
        assert_eq!((needed.by_bins, needed.by_every_registration, needed.registrations_from_there), (None, None, 0));
    }

    #[test]
    fn a_refused_pair_counts_for_unchecked_keypoints_only() {
        let mut lost = sample(75, 70.0, 3, 100.0);
        lost.drifts.drift_px = None;
        let samples = [lost, sample(600, 500.0, 90, 0.1), sample(600, 500.0, 90, 0.2)];
        let of = |estimator| DriftCurve::fit(estimator, &samples);
        let [program, keypoints, unchecked] =
            [Estimator::Program, Estimator::Keypoints, Estimator::KeypointsUnchecked].map(of);
        assert_eq!([program.scored, keypoints.scored, unchecked.scored], [2, 2, 3]);
        assert_eq!([program.tried, unchecked.tried, unchecked.beyond_one_px], [3, 3, 1]);
        assert_eq!(unchecked.matches_needed.unwrap().by_every_registration, Some(90));
        assert_eq!(DriftCurve::fit(Estimator::Program, &[]).matches_needed, None);
    }

    #[test]
    fn equals_share_their_rank() {
        assert_eq!(ranks(vec![5.0, 1.0, 5.0, 9.0]), [1.5, 0.0, 1.5, 3.0]);
        // scipy.stats.spearmanr([1, 2, 2, 4], [3, 1, 4, 2]).statistic = -0.31622776601683794
        let found = rank_correlation(&[(1, 3.0), (2, 1.0), (2, 4.0), (4, 2.0)]).unwrap();
        assert!((found + 0.316_227_766_016_837_94).abs() < 1e-12, "{found}");
    }
}
