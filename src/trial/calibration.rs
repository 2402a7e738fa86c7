//! From measurements to constants: the fits behind `calibration.toml`, and the file.

use super::{Cost, RelativeSample, Spread, TrialError};
use crate::coupling::{CalibratedImages, Calibration, PixelDriftLaw, RelativeCost, SearchCost, fit_line, fit_slope};
use crate::registration::relative::{MOST_EDGE_PX, QUICK};
use crate::tile::TILE_SIZE_PX;
use serde::Serialize;
use std::path::Path;

/// All samples of one number of descriptors. Times are medians over pairs, seconds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CalibrationRow {
    /// Descriptors at most.
    pub limit: usize,
    /// N: mean of those found.
    pub descriptors: f64,
    /// As [`RelativeSample`].
    pub loading_s: f64,
    /// As [`RelativeSample`].
    pub matching_s: f64,
    /// As [`RelativeSample`].
    pub threshold_s: f64,
    /// As [`RelativeSample`]; absent where no pair agreed.
    pub estimate_s: Option<f64>,
    /// n: median of matches that agree, over the registered pairs.
    pub matched: f64,
    /// Root of the mean square over the registered pairs, pixels.
    pub drift_px: Option<f64>,
    /// The same from keypoints alone.
    pub keypoint_drift_px: Option<f64>,
    /// Pairs registered, and tried.
    pub registered: usize,
    /// Pairs tried.
    pub pairs: usize,
}

/// What `overfly calibrate` found, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibrated {
    /// The constants.
    #[serde(flatten)]
    pub calibration: Calibration,
    /// D_U of keypoints alone, as the paper measures it.
    pub keypoint_drift: PixelDriftLaw,
    /// T_exe of (45) with these constants, seconds.
    pub relative_s: f64,
    /// What they were fitted to, by number of descriptors.
    pub rows: Vec<CalibrationRow>,
    /// Drift by matches: bins of n, and the root of the mean square in each, pixels.
    pub drift_by_matches: Vec<[f64; 2]>,
    /// The search.
    pub cost: Cost,
}

impl Calibrated {
    /// Fits the models of (42) to (45) and of the drift to the samples, and takes K1 from `cost`. Where a search's measured
    /// time does not grow with its area (few tiles, a busy machine), K1 is the time of the largest area over its tiles, and
    /// the constant 0: never too quick.
    ///
    /// # Errors
    /// [`TrialError::Option`] where not one pair was registered, or no area searched.
    pub fn of(samples: &[RelativeSample], edge_px: usize, cost: Cost) -> Result<Self, TrialError> {
        let nothing = |name, expected| TrialError::Option { name, value: 0.0, expected };
        let rows = rows(samples);
        let points = |x: fn(f64) -> f64, y: fn(&CalibrationRow) -> f64| -> Vec<(f64, f64)> {
            rows.iter().map(|r| (x(r.descriptors), y(r))).collect()
        };
        let no_pair = || nothing("registered pairs", "at least one; take photos with more texture, or more pairs");
        let [load_s, seconds_per_descriptor] = fit_line(&points(|n| n, |r| r.loading_s)).ok_or_else(no_pair)?;
        let estimates: Vec<f64> = samples.iter().filter_map(|s| s.estimate_s).collect();
        let usual = rows.iter().filter(|r| r.registered > 0).min_by_key(|r| r.limit.abs_diff(QUICK.limit));
        let usual = usual.ok_or_else(no_pair)?;
        let by_matches = drift_by_matches(samples, |s| s.drift_px);
        let calibration = Calibration {
            images: CalibratedImages {
                edge_px: edge_px as f64,
                most_compared_edge_px: MOST_EDGE_PX,
                descriptor_count: usual.descriptors,
                matched_count: usual.matched,
            },
            relative: RelativeCost {
                seconds_per_descriptor,
                load_s,
                pair_comparison_s: fit_slope(&points(|n| n * n, |r| r.matching_s)).unwrap_or(0.0),
                // Not a line here: drawing ends early where much agrees. What the usual number of descriptors takes counts.
                threshold_s_per_descriptor: usual.threshold_s / usual.descriptors.max(1.0),
                estimate_s: Spread::of(estimates).ok_or_else(no_pair)?.median,
            },
            drift: law(&by_matches).ok_or_else(no_pair)?,
            search: search_cost(&cost).ok_or_else(|| nothing("areas searched", "at least one that the map fills"))?,
        };
        let keypoint_drift = law(&drift_by_matches(samples, |s| s.keypoint_drift_px)).ok_or_else(no_pair)?;
        let relative_s = calibration.relative.total_s(usual.descriptors).map_err(|_| no_pair())?;
        Ok(Self { calibration, keypoint_drift, relative_s, rows, drift_by_matches: by_matches, cost })
    }
}

fn search_cost(cost: &Cost) -> Option<SearchCost> {
    let largest = cost.steps.iter().max_by(|a, b| a.tiles.total_cmp(&b.tiles))?;
    let grows = cost.seconds_per_tile > 0.0 && cost.constant_s >= 0.0;
    let through_origin = [0.0, largest.elapsed_ms.median / 1e3 / largest.tiles];
    let [search_constant_s, seconds_per_store_tile] =
        if grows { [cost.constant_s, cost.seconds_per_tile] } else { through_origin };
    Some(SearchCost { seconds_per_store_tile, search_constant_s, tile_px: f64::from(TILE_SIZE_PX) })
}

fn rows(samples: &[RelativeSample]) -> Vec<CalibrationRow> {
    let mut limits: Vec<usize> = samples.iter().map(|s| s.limit).collect();
    limits.sort_unstable();
    limits.dedup();
    limits.into_iter().filter_map(|limit| row(limit, samples)).collect()
}

fn row(limit: usize, samples: &[RelativeSample]) -> Option<CalibrationRow> {
    let of_limit: Vec<&RelativeSample> = samples.iter().filter(|s| s.limit == limit).collect();
    let median = |of: &dyn Fn(&RelativeSample) -> Option<f64>| {
        Spread::of(of_limit.iter().filter_map(|s| of(s)).collect()).map(|s| s.median)
    };
    let rms = |of: fn(&RelativeSample) -> Option<f64>| {
        let squares: Vec<f64> = of_limit.iter().filter_map(|s| of(s)).map(|d| d * d).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    Some(CalibrationRow {
        limit,
        descriptors: of_limit.iter().map(|s| s.descriptors).sum::<f64>() / of_limit.len() as f64,
        loading_s: median(&|s| Some(s.loading_s))?,
        matching_s: median(&|s| Some(s.matching_s))?,
        threshold_s: median(&|s| Some(s.threshold_s))?,
        estimate_s: median(&|s| s.estimate_s),
        matched: median(&|s| s.drift_px.map(|_| s.matched as f64)).unwrap_or(0.0),
        drift_px: rms(|s| s.drift_px),
        keypoint_drift_px: rms(|s| s.keypoint_drift_px),
        registered: of_limit.iter().filter(|s| s.drift_px.is_some()).count(),
        pairs: of_limit.len(),
    })
}

/// Bins of matched counts, each up to one and a half times as wide as it begins: mean n, and the root of the mean square.
fn drift_by_matches(samples: &[RelativeSample], drift: impl Fn(&RelativeSample) -> Option<f64>) -> Vec<[f64; 2]> {
    let mut drifts: Vec<(f64, f64)> =
        samples.iter().filter_map(|s| Some((s.matched as f64, drift(s)?))).filter(|(n, _)| *n >= 1.0).collect();
    drifts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let same_bin = |a: &(f64, f64), b: &(f64, f64)| {
        let bin = |n: f64| (n.ln() / 1.5f64.ln()).floor();
        bin(a.0) == bin(b.0)
    };
    let mean = |bin: &[(f64, f64)], of: fn(&(f64, f64)) -> f64| bin.iter().map(of).sum::<f64>() / bin.len() as f64;
    drifts.chunk_by(same_bin).map(|bin| [mean(bin, |d| d.0), mean(bin, |d| d.1 * d.1).sqrt()]).collect()
}

/// The law through the bins: squares of drift are a line over 1 / n.
fn law(by_matches: &[[f64; 2]]) -> Option<PixelDriftLaw> {
    let points: Vec<_> = by_matches.iter().map(|[n, drift]| (1.0 / n, drift * drift)).collect();
    let [floor2, pair2] = fit_line(&points)?;
    Some(PixelDriftLaw { pair_drift_px: pair2.sqrt(), floor_px: floor2.sqrt() })
}

/// The text of a `calibration.toml`: every field with its unit, and no word of when and where.
pub fn calibration_toml(calibration: &Calibration) -> String {
    let Calibration { images: i, relative: r, drift: d, search: s } = calibration;
    format!(
        "# What registrations cost and err on one machine: `overfly calibrate` measured it, `overfly plan --calibration` reads it.\n\
         # All fields are needed, others are refused. Numbers in brackets are the paper's equations (docs/equations.md).\n\n\
         [images]\n\
         # Edge of the square images that were registered, pixels. load_s is taken to grow with an image's pixels.\n\
         edge_px = {:?}\n\
         # Images with a larger edge (root of the area) are compared at a whole fraction of their size, pixels.\n\
         most_compared_edge_px = {:?}\n\
         # N: descriptors per image, as registrations take them.\ndescriptor_count = {:.1}\n\
         # n: matches that agree, of those: median over overlaps from 10 to 95 %.\nmatched_count = {:.1}\n\n\
         [relative]\n\
         # A_c (42): describing one keypoint, s.\nseconds_per_descriptor = {:.3e}\n\
         # L (42): decoding an image and looking for corners, s.\nload_s = {:.3e}\n\
         # t0 (43): comparing one pair of descriptors, s.\npair_comparison_s = {:.3e}\n\
         # B (44): keeping or dropping one correspondence, s.\nthreshold_s_per_descriptor = {:.3e}\n\
         # t_c (45): estimating shift and turn, s.\nestimate_s = {:.3e}\n\n\
         [drift]\n\
         # D_U(n) = sqrt(floor_px^2 + pair_drift_px^2 / n), root of the mean square, pixels of the images as compared.\n\
         pair_drift_px = {:.3e}\nfloor_px = {:.3e}\n\n\
         [search]\n\
         # t_exe = search_constant_s + seconds_per_store_tile * tiles (4): K1 per base tile of a store, s; the constant, s.\n\
         seconds_per_store_tile = {:.3e}\nsearch_constant_s = {:.3e}\n\
         # Edge of a tile, pixels of the map.\ntile_px = {:?}\n",
        i.edge_px,
        i.most_compared_edge_px,
        i.descriptor_count,
        i.matched_count,
        r.seconds_per_descriptor,
        r.load_s,
        r.pair_comparison_s,
        r.threshold_s_per_descriptor,
        r.estimate_s,
        d.pair_drift_px,
        d.floor_px,
        s.seconds_per_store_tile,
        s.search_constant_s,
        s.tile_px,
    )
}

/// Writes the table of samples as CSV.
///
/// # Errors
/// [`TrialError::Unwritable`].
pub fn write_samples(path: &Path, samples: &[RelativeSample]) -> Result<(), TrialError> {
    let mut text = String::from(
        "overlap_percent,limit,descriptors,loading_s,matching_s,threshold_s,estimate_s,matched,drift_px,keypoint_drift_px\n",
    );
    let cell = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.6}"));
    for s in samples {
        text.push_str(&format!(
            "{},{},{:.1},{:.6},{:.6},{:.6},{},{},{},{}\n",
            s.overlap_percent,
            s.limit,
            s.descriptors,
            s.loading_s,
            s.matching_s,
            s.threshold_s,
            cell(s.estimate_s),
            s.matched,
            cell(s.drift_px),
            cell(s.keypoint_drift_px)
        ));
    }
    std::fs::write(path, text).map_err(|cause| TrialError::Unwritable { path: path.into(), cause })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::CostStep;

    fn sample(limit: usize, n: f64, matched: usize, drift_px: f64) -> RelativeSample {
        RelativeSample {
            overlap_percent: 50.0,
            limit,
            descriptors: n,
            loading_s: 0.004 + 3e-6 * n,
            matching_s: 5e-9 * n * n,
            threshold_s: 2e-6 * n,
            estimate_s: Some(0.003),
            matched,
            drift_px: Some(drift_px),
            keypoint_drift_px: Some(3.0 * drift_px),
        }
    }

    fn cost(medians_ms: [f64; 2]) -> Cost {
        let step = |tiles: f64, median: f64| CostStep {
            tiles,
            half_width_m: 100.0,
            tiles_searched: 4,
            nominal_count: 4.0,
            right: 5,
            repeats: 6,
            first_ms: 90.0,
            elapsed_ms: Spread { median, p95: median, max: median },
        };
        let slope = (medians_ms[1] - medians_ms[0]) / 8e3;
        Cost {
            frame_px: [320, 240],
            unknown_heading: false,
            seconds_per_tile: slope,
            constant_s: medians_ms[0] / 1e3 - slope,
            steps: vec![step(1.0, medians_ms[0]), step(9.0, medians_ms[1])],
            skipped: vec![],
            threads: 1,
        }
    }

    #[test]
    fn finds_the_constants_that_samples_were_made_of_and_writes_what_plan_reads() {
        // Drift of 0.6 px for one pair and 0.02 px that stays.
        let samples: Vec<_> = [(100, 90.0, 20), (600, 560.0, 150), (2400, 2100.0, 700)]
            .map(|(limit, n, matched)| sample(limit, n, matched, 0.02f64.hypot(0.6 / (matched as f64).sqrt())))
            .to_vec();
        let found = Calibrated::of(&samples, 512, cost([20.0, 36.0])).unwrap();
        let c = found.calibration;
        let near = |found: f64, made: f64| assert!((found / made - 1.0).abs() < 1e-6, "{found} {made}");
        near(c.relative.load_s, 0.004);
        near(c.relative.seconds_per_descriptor, 3e-6);
        near(c.relative.pair_comparison_s, 5e-9);
        near(c.relative.threshold_s_per_descriptor, 2e-6);
        near(c.drift.pair_drift_px, 0.6);
        near(c.drift.floor_px, 0.02);
        near(found.keypoint_drift.pair_drift_px, 1.8);
        near(c.search.seconds_per_store_tile, 0.002);
        near(c.images.matched_count, 150.0);
        let read: Calibration = toml::from_str(&calibration_toml(&c)).unwrap();
        assert_eq!(read.check(), Ok(()));
        assert!((read.relative.load_s / c.relative.load_s - 1.0).abs() < 1e-3);
        assert!(toml::from_str::<Calibration>(&format!("{}more = 1\n", calibration_toml(&c))).is_err());
    }

    #[test]
    fn times_that_do_not_grow_give_no_negative_k1_and_no_pair_no_calibration() {
        let samples = [sample(600, 560.0, 150, 0.05)];
        let found = Calibrated::of(&samples, 512, cost([50.0, 36.0])).unwrap();
        assert!((found.calibration.search.seconds_per_store_tile - 0.004).abs() < 1e-12);
        assert_eq!(found.calibration.search.search_constant_s, 0.0);
        let lost = RelativeSample { drift_px: None, keypoint_drift_px: None, estimate_s: None, ..samples[0] };
        assert_eq!(Calibrated::of(&[lost], 512, cost([20.0, 36.0])).unwrap_err().code(), "bad_option");
        assert!(Calibrated::of(&[], 512, cost([20.0, 36.0])).is_err());
    }
}
