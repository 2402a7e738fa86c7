//! One search of a trial.

use super::altered::ShownFrame;
use super::outcome::NegativeSearch;
use super::trial::NegativeTrial;
use crate::trial::error::TrialError;
use crate::trial::recorded_flight::RecordedFrame;
use overfly_core::geodesy::Geodetic;
use overfly_flight::locate::{FixRequest, HeadingPrior, PositionPrior, locate_weighed};
use overfly_store::Reader;
use std::time::Instant;

/// What a search is told about position and heading.
#[derive(Debug, Clone, Copy)]
pub struct StatedPrior {
    /// Centre of the square to search.
    pub centre: Geodetic,
    /// Half width of the square, metres.
    pub half_width_m: f64,
    /// Whether the compass is read.
    pub is_heading_known: bool,
}

impl NegativeTrial {
    /// Half width of a square of some usual squares' area, metres. A thousandth and a metre more, because north at the prior
    /// is not exactly north at the truth.
    pub(super) fn half_width_m(&self, region: f64) -> f64 {
        self.prior_error_m * region.sqrt() * 1.001 + 1.0
    }

    /// Searches for a frame. `shared_m2` is the area of the imagery in the square.
    pub(super) fn search(
        &self,
        store: &Reader,
        layer: &str,
        frame: &RecordedFrame,
        shown: &ShownFrame,
        prior: &StatedPrior,
        shared_m2: f64,
    ) -> Result<NegativeSearch, TrialError> {
        let sigma_rad = self.heading_sigma_deg.to_radians();
        let request = FixRequest {
            layer: layer.to_owned(),
            position: PositionPrior::Square { centre: prior.centre, half_width_m: prior.half_width_m },
            heading: prior.is_heading_known.then_some(HeadingPrior { heading_rad: frame.heading_rad, sigma_rad }),
            view: shown.view.clone(),
            scale_sigma_ratio: self.height_sigma_ratio,
            time_s: None,
        };
        let asked = Instant::now();
        let (answer, best) = locate_weighed(store, &shown.gray, &request, 1)
            .map_err(|cause| TrialError::Locate { image: frame.image.clone(), cause })?;
        let elapsed_ms = asked.elapsed().as_micros() as f64 / 1e3;
        let searched_ratio = shared_m2 / (2.0 * self.prior_error_m).powi(2);
        Ok(NegativeSearch { prior: prior.centre, searched_ratio, answer, best, elapsed_ms })
    }
}
