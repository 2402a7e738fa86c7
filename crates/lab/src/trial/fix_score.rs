//! `FixScore`: the score of a set of fixes against the truth.

use super::fixes::FixOutcome;
use super::integrity_score::{IntegrityScore, ProtectedError};
use super::quantiles::Quantiles;
use overfly_core::geodesy::Enu;
use overfly_core::integrity::{DEFAULT_INTEGRITY_RISK, ErrorMixture};
use overfly_flight::locate::{Answer, Reason};
use serde::Serialize;
use std::cmp::Reverse;

/// The 97.5 % quantile of the normal distribution.
const NORMAL_975: f64 = 1.959_963_985;
/// Share of the fixes that a trimmed mean keeps.
const TRIMMED_SHARE: f64 = 0.975;
/// Mean of a chi-square variable of two degrees of freedom, given that it lies below its 97.5 % quantile q = -2 ln
/// 0.025: (2 - 0.025 (q + 2)) / 0.975.
const TRIMMED_EXPECTATION: f64 = 1.810_827;

/// The summary of `evaluate fixes`, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FixScore {
    /// Number of frames.
    pub frames: usize,
    /// Accepted fixes.
    pub fixes: usize,
    /// Accepted fixes within `right_m` of the truth.
    pub right: usize,
    /// Accepted fixes farther away.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Frames without a fix.
    pub no_fix: usize,
    /// What refused them, the most frequent reason first.
    pub refusals: Vec<Refusals>,
    /// Errors of all accepted fixes, right or false, metres.
    pub error_m: Option<Quantiles>,
    /// Share of accepted fixes whose own 95 % ellipse contains the truth.
    pub ellipse95_coverage: Option<f64>,
    /// Normalised estimation error squared (NEES) e^T C^-1 e of the accepted fixes: 2 on average if covariances are
    /// true.
    #[serde(flatten)]
    pub nees: Option<Nees>,
    /// Semi-major axes of the accepted fixes' own 95 % ellipses, metres.
    pub semi_major_95_m: Option<Quantiles>,
    /// Durations from the decoded frame in memory to the answer, milliseconds.
    pub elapsed_ms: Option<Quantiles>,
    /// Durations from the file to the decoded frame, milliseconds.
    pub decode_ms: Option<Quantiles>,
    /// Base tiles whose imagery was searched.
    pub tiles_searched: Option<Quantiles>,
    /// Protection levels against errors.
    pub integrity: IntegrityScore,
    /// Greatest error of a right fix, metres.
    pub right_m: f64,
    /// Threads of each search.
    pub threads: usize,
}

/// The frames that one reason refused.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Refusals {
    /// Why there is no fix.
    pub reason: Reason,
    /// Number of frames.
    pub frames: usize,
}

impl Refusals {
    /// Counts the refused frames by reason.
    fn count(outcomes: &[FixOutcome]) -> Vec<Self> {
        let mut refusals: Vec<Self> = Vec::new();
        for outcome in outcomes {
            let Answer::NoFix(no_fix) = &outcome.answer else { continue };
            match refusals.iter_mut().find(|refusals| refusals.reason == no_fix.reason) {
                Some(same) => same.frames += 1,
                None => refusals.push(Self { reason: no_fix.reason, frames: 1 }),
            }
        }
        refusals.sort_by_key(|refusals| (Reverse(refusals.frames), refusals.reason.word()));
        refusals
    }
}

/// The mean NEES of fixes, and the band of that mean if all covariances are true.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Nees {
    /// Mean over all fixes. A single false fix can dominate it.
    #[serde(rename = "nees_mean")]
    pub mean: f64,
    /// Mean over the fixes below the 97.5 % quantile, scaled to an expectation of 2: the mean without outliers.
    #[serde(rename = "nees_trimmed_mean")]
    pub trimmed_mean: f64,
    /// The band that contains `mean` in 95 of 100 sets of as many independent fixes.
    #[serde(rename = "nees_band95")]
    pub band95: [f64; 2],
}

impl FixScore {
    /// Scores outcomes.
    pub fn from_outcomes(outcomes: &[FixOutcome], right_m: f64, threads: usize) -> Self {
        let errors: Vec<f64> = outcomes.iter().filter_map(|o| o.error).map(Enu::length_m).collect();
        let fixes = errors.len();
        let right = errors.iter().filter(|e| **e <= right_m).count();
        let covered = outcomes.iter().filter(|o| o.is_in_ellipse95() == Some(true)).count();
        let spread = |of: fn(&FixOutcome) -> f64| Quantiles::from_values(outcomes.iter().map(of).collect());
        Self {
            frames: outcomes.len(),
            fixes,
            right,
            wrong: fixes - right,
            no_fix: outcomes.len() - fixes,
            refusals: Refusals::count(outcomes),
            error_m: Quantiles::from_values(errors),
            ellipse95_coverage: (fixes > 0).then(|| covered as f64 / fixes as f64),
            nees: Nees::from_values(outcomes.iter().filter_map(FixOutcome::nees).collect()),
            semi_major_95_m: Quantiles::from_values(outcomes.iter().filter_map(FixOutcome::semi_major_95_m).collect()),
            elapsed_ms: spread(|o| o.elapsed_ms),
            decode_ms: spread(|o| o.decode_ms),
            tiles_searched: spread(|o| o.tiles_searched() as f64),
            integrity: IntegrityScore::from_errors(
                &FixOutcome::protected_errors(outcomes, DEFAULT_INTEGRITY_RISK),
                DEFAULT_INTEGRITY_RISK,
                None,
            ),
            right_m,
            threads,
        }
    }
}

impl Nees {
    /// The summary of the NEES values of fixes; `None` without values.
    fn from_values(mut values: Vec<f64>) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        values.sort_by(f64::total_cmp);
        let n = values.len() as f64;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let kept = (n * TRIMMED_SHARE).ceil() as usize;
        // The sum of n values is chi-square with 2 n degrees of freedom; its quantiles by Wilson and Hilferty are
        // good to 0.1 % from n = 5 on.
        let quantile = |z: f64| {
            let k = 2.0 * n;
            2.0 * (1.0 - 2.0 / (9.0 * k) + z * (2.0 / (9.0 * k)).sqrt()).powi(3)
        };
        let trimmed_mean = 2.0 * mean(&values[..kept]) / TRIMMED_EXPECTATION;
        Some(Self { mean: mean(&values), trimmed_mean, band95: [quantile(-NORMAL_975), quantile(NORMAL_975)] })
    }
}

impl FixOutcome {
    /// NEES of the fix: e^T C^-1 e of its error and its own covariance. `None` without a fix; infinite if the
    /// covariance is not positive definite.
    pub fn nees(&self) -> Option<f64> {
        Some(self.covariance?.squared_mahalanobis(self.error?))
    }

    /// Whether the fix's own 95 % ellipse contains the truth; `None` without a fix. A covariance that is not positive
    /// definite contains nothing.
    pub fn is_in_ellipse95(&self) -> Option<bool> {
        Some(self.covariance?.contains_95(self.error?))
    }

    /// Semi-major axis of the fix's own 95 % ellipse, metres; `None` without a fix.
    pub fn semi_major_95_m(&self) -> Option<f64> {
        Some(self.covariance?.ellipse_95().semi_major_m)
    }

    /// The protection level of the point that is judged, metres; `None` without a fix, and where there is none.
    pub fn protection_level_m(&self, integrity_risk: f64) -> Option<f64> {
        let Answer::Fix(fix) = &self.answer else { return None };
        ErrorMixture::of_fix(self.covariance?, fix.false_fix_probability).protection_level_m(integrity_risk)
    }

    /// The error of each frame, infinite without a fix, with its protection level.
    pub fn protected_errors(outcomes: &[Self], integrity_risk: f64) -> Vec<ProtectedError> {
        let of = |o: &Self| ProtectedError {
            error_m: o.error.map_or(f64::INFINITY, Enu::length_m),
            protection_level_m: o.protection_level_m(integrity_risk),
        };
        outcomes.iter().map(of).collect()
    }

    /// Base tiles whose imagery was searched.
    pub fn tiles_searched(&self) -> usize {
        match &self.answer {
            Answer::Fix(fix) => fix.tiles_searched,
            Answer::NoFix(no_fix) => no_fix.tiles_searched,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use overfly_core::geodesy::{CHI_SQUARE_95, Geodetic, Heading, LocalFrame};
    use overfly_flight::locate::{Fix, NoFix, PositionOf, Reason, SearchedMap};

    /// A fix with an error of `error` metres and a given covariance, or no fix.
    pub(crate) fn outcome(error: Option<[f64; 2]>, covariance_m2: [[f64; 2]; 2]) -> FixOutcome {
        let truth = Geodetic::from_degrees(48.0, 15.0).unwrap();
        let error = error.map(|[east_m, north_m]| Enu { east_m, north_m });
        let answer = match error {
            Some(error) => {
                let at = LocalFrame::at(truth).geodetic_from_enu(error).unwrap();
                Answer::Fix(Fix {
                    position: at,
                    position_of: PositionOf::Nadir,
                    heading: Heading::from_degrees(12.0),
                    heading_sigma_rad: 0.2f64.to_radians(),
                    gsd_m_per_px: 1.0,
                    scale_sigma_ratio: 0.001,
                    covariance: covariance_m2.into(),
                    score: 20.0,
                    false_fix_probability: 1e-9,
                    log10_false_alarms: Some(-9.0),
                    image_centre: at,
                    image_centre_covariance: covariance_m2.into(),
                    attitude_sigma_rad: Some(0.0),
                    inliers: 30,
                    tiles_searched: 6,
                    nominal_count: 4.0,
                    map_error_m: 0.0,
                    map_error_known: true,
                    map_epoch: None,
                    map: SearchedMap::default(),
                    time_s: None,
                })
            }
            None => Answer::NoFix(NoFix {
                reason: Reason::Ambiguous,
                detail: "two places".into(),
                score: None,
                log10_false_alarms: None,
                tiles_searched: 9,
                nominal_count: 4.0,
                map: SearchedMap::default(),
                time_s: None,
            }),
        };
        FixOutcome {
            image: "a.png".into(),
            truth,
            prior: truth,
            answer,
            error,
            covariance: error.map(|_| covariance_m2.into()),
            elapsed_ms: 10.0,
            decode_ms: 1.0,
        }
    }

    #[test]
    fn counts_right_false_and_none_apart() {
        let unit = [[1.0, 0.0], [0.0, 1.0]];
        let outcomes = [
            outcome(Some([3.0, 4.0]), unit),
            outcome(Some([0.0, 1.0]), unit),
            outcome(Some([300.0, 0.0]), unit),
            outcome(None, unit),
        ];
        let score = FixScore::from_outcomes(&outcomes, 5.0, 2);
        assert_eq!((score.frames, score.fixes, score.right, score.wrong, score.no_fix), (4, 3, 2, 1, 1));
        let error = score.error_m.unwrap();
        assert!((error.median - 5.0).abs() < 1e-9 && (error.max - 300.0).abs() < 1e-9);
        // Only the one at one sigma lies in its ellipse.
        assert!((score.ellipse95_coverage.unwrap() - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(score.tiles_searched.unwrap().max, 9.0);
        let json = serde_json::to_value(&score).unwrap();
        assert_eq!(json["false"], 1);
        assert_eq!(json["error_m"]["p95"].as_f64().unwrap(), error.p95);
    }

    #[test]
    fn an_ellipse_is_judged_along_its_own_axes() {
        // Ten metres along its long axis (sigma 7), and the same ten across it (sigma about 1).
        let slanted = [[25.0, 24.0], [24.0, 25.0]];
        let d = 10.0 / f64::sqrt(2.0);
        assert_eq!(outcome(Some([d, d]), slanted).is_in_ellipse95(), Some(true));
        assert_eq!(outcome(Some([d, -d]), slanted).is_in_ellipse95(), Some(false));
        assert_eq!(outcome(Some([0.0, 0.0]), [[1.0, 1.0], [1.0, 1.0]]).is_in_ellipse95(), Some(false));
        assert_eq!(outcome(None, slanted).is_in_ellipse95(), None);
    }

    #[test]
    fn nees_of_true_covariances_lies_in_its_band() {
        // Quantiles of chi-square with two degrees, -2 ln(1 - p), in all directions of a slanted covariance.
        let covariance = [[25.0, 12.0], [12.0, 9.0]];
        let (l00, l10) = (5.0, 12.0 / 5.0);
        let l11 = f64::sqrt(9.0 - l10 * l10);
        let outcomes: Vec<_> = (0..400)
            .map(|i| {
                let (p, angle) = ((f64::from(i) + 0.5) / 400.0, f64::from(i) * 2.4);
                let (u, v) =
                    ((-2.0 * (1.0 - p).ln()).sqrt() * angle.cos(), (-2.0 * (1.0 - p).ln()).sqrt() * angle.sin());
                outcome(Some([l00 * u, l10 * u + l11 * v]), covariance)
            })
            .collect();
        let score = FixScore::from_outcomes(&outcomes, 100.0, 1);
        let nees = score.nees.unwrap();
        assert!((nees.mean - 2.0).abs() < 0.02 && (nees.trimmed_mean - 2.0).abs() < 0.02, "{nees:?}");
        // scipy.stats.chi2.ppf([0.025, 0.975], 800) / 400 = [1.808781, 2.200688]
        assert!((nees.band95[0] - 1.808_781).abs() < 1e-3 && (nees.band95[1] - 2.200_688).abs() < 1e-3, "{nees:?}");
        assert!((score.ellipse95_coverage.unwrap() - 0.95).abs() < 0.003);
        assert_eq!(serde_json::to_value(&score).unwrap()["nees_mean"], nees.mean);
        // Half axes of the 95 % ellipse: eigenvalues 17 +- sqrt(64 + 144).
        let semi_major_m = (CHI_SQUARE_95 * (17.0 + 208f64.sqrt())).sqrt();
        assert!((score.semi_major_95_m.unwrap().median - semi_major_m).abs() < 1e-9);
    }

    #[test]
    fn no_frame_accepted_is_a_score_too() {
        let score = FixScore::from_outcomes(&[outcome(None, [[1.0, 0.0], [0.0, 1.0]])], 5.0, 1);
        assert_eq!((score.fixes, score.error_m, score.ellipse95_coverage), (0, None, None));
    }
}
