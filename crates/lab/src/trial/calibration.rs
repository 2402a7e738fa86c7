//! `Calibrated`: the constants that measurements give, and the text of `calibration.toml`.

use super::cost::Cost;
use super::error::TrialError;
use super::relative_laws::RelativeLaws;
use overfly_core::coupling::{CalibratedImages, Calibration, SearchCost};
use overfly_core::registration::relative::MOST_EDGE_PX;
use overfly_core::tile::TILE_SIZE_PX;
use serde::Serialize;

/// The result of a calibration, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibrated {
    /// The constants.
    #[serde(flatten)]
    pub calibration: Calibration,
    /// The laws of relative registration, and the registrations they were fitted to.
    pub laws: RelativeLaws,
    /// The time of a search against the area it searches.
    pub cost: Cost,
}

impl Calibrated {
    /// Takes the constants from the laws, and K1 from `cost`. If the measured time of a search does not grow with its
    /// area (few tiles, a busy machine), K1 is the time of the largest area over its tiles and the constant is 0, so
    /// that K1 is never too small.
    ///
    /// # Errors
    /// [`TrialError::Option`] if no drift is known or no area was searched.
    pub fn from_measurements(laws: RelativeLaws, edge_px: usize, cost: Cost) -> Result<Self, TrialError> {
        let nothing = |name, expected| TrialError::Option { name, value: 0.0, expected };
        let calibration = Calibration {
            images: CalibratedImages {
                edge_px: edge_px as f64,
                most_compared_edge_px: MOST_EDGE_PX,
                descriptor_count: laws.descriptor_count,
                matched_count: laws.matched_count,
            },
            relative: laws.relative,
            drift: laws.program.law.ok_or_else(|| nothing("registered pairs", "at least one"))?,
            search: search_cost(&cost).ok_or_else(|| nothing("areas searched", "at least one that the map fills"))?,
        };
        Ok(Self { calibration, laws, cost })
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

/// The text of a `calibration.toml`: every field with its unit. The text does not depend on time or place.
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

#[cfg(test)]
mod tests {
    use super::super::drift_curve::tests::sample;
    use super::*;
    use crate::trial::cost::CostStep;
    use crate::trial::quantiles::Quantiles;

    fn cost(medians_ms: [f64; 2]) -> Cost {
        let step = |tiles: f64, median: f64| CostStep {
            tiles,
            half_width_m: 100.0,
            tiles_searched: 4,
            nominal_count: 4.0,
            right: 5,
            repeats: 6,
            first_ms: 90.0,
            elapsed_ms: Quantiles { median, p95: median, max: median },
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

    fn laws() -> RelativeLaws {
        let samples = [(100, 90.0, 20), (600, 560.0, 150), (2400, 2100.0, 700)];
        RelativeLaws::fit(&samples.map(|(limit, n, matched)| sample(limit, n, matched, 0.05))).unwrap()
    }

    #[test]
    fn writes_what_plan_reads() {
        let c = Calibrated::from_measurements(laws(), 512, cost([20.0, 36.0])).unwrap().calibration;
        assert!((c.search.seconds_per_store_tile - 0.002).abs() < 1e-12);
        let read: Calibration = toml::from_str(&calibration_toml(&c)).unwrap();
        assert_eq!(read.check(), Ok(()));
        assert!((read.relative.load_s / c.relative.load_s - 1.0).abs() < 1e-3);
        assert!((read.images.matched_count - 150.0).abs() < 0.06);
        assert!(toml::from_str::<Calibration>(&format!("{}more = 1\n", calibration_toml(&c))).is_err());
    }

    #[test]
    fn times_that_do_not_grow_give_no_negative_k1() {
        let found = Calibrated::from_measurements(laws(), 512, cost([50.0, 36.0])).unwrap();
        assert!((found.calibration.search.seconds_per_store_tile - 0.004).abs() < 1e-12);
        assert_eq!(found.calibration.search.search_constant_s, 0.0);
    }
}
