//! `SearchWidening`: the region that an absolute registration searches, widened after every failure.

use super::filter::NavigationFilter;
use super::flight_image::FlightImage;
use crate::locate::{FixRequest, HeadingPrior, PositionPrior, Reason};
use overfly_core::geodesy::EnuCovariance;
use std::f64::consts::PI;

/// Factor by which each consecutive failure after the first widens the region.
const WIDENING: f64 = 2.0;
/// After this many consecutive failures the whole layer is searched.
const WHOLE_LAYER_FAILURES: u32 = 4;
/// Lower bounds on the standard deviations of position, heading and height that a search assumes.
const MIN_SIGMA_M: f64 = 15.0;
const MIN_HEADING_SIGMA_RAD: f64 = 0.02;
const MIN_HEIGHT_SIGMA_RATIO: f64 = 0.01;
/// Upper bound on the standard deviation of height that a search assumes: beyond, the scales to try are too many.
const MAX_HEIGHT_SIGMA_RATIO: f64 = 0.06;

/// Counts the consecutive failures since the last success.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SearchWidening {
    failures: u32,
}

impl SearchWidening {
    /// Resets the count after a fix.
    pub fn reset(&mut self) {
        self.failures = 0;
    }

    /// Counts a failure, except where the image shows too little structure: such an image says nothing about the region.
    pub fn record_failure(&mut self, reason: Reason) {
        if reason != Reason::TooLittleStructure {
            self.failures += 1;
        }
    }

    fn factor(self) -> f64 {
        WIDENING.powi(self.failures.saturating_sub(1).min(WHOLE_LAYER_FAILURES) as i32)
    }

    /// The request for an image, from the filter's state at that image.
    pub fn request(self, layer: &str, image: &FlightImage, at: &NavigationFilter) -> FixRequest {
        let widening = self.factor();
        let heading_sigma = widening * at.heading_sigma_rad().hypot(MIN_HEADING_SIGMA_RAD);
        FixRequest {
            layer: layer.to_owned(),
            position: if self.failures >= WHOLE_LAYER_FAILURES {
                PositionPrior::WholeLayer
            } else {
                around(at, widening)
            },
            heading: (3.0 * heading_sigma < PI)
                .then(|| HeadingPrior { heading_rad: at.heading().radians(), sigma_rad: heading_sigma }),
            view: image.view(at.height_m()),
            scale_sigma_ratio: (widening * at.height_sigma_ratio())
                .clamp(MIN_HEIGHT_SIGMA_RATIO, MAX_HEIGHT_SIGMA_RATIO),
            time_s: Some(image.time_s),
        }
    }
}

fn around(at: &NavigationFilter, widening: f64) -> PositionPrior {
    let EnuCovariance { ee_m2: ee, en_m2: en, nn_m2: nn } = at.position_covariance();
    let least = MIN_SIGMA_M.powi(2);
    let sigma = |variance: f64| widening * (variance + least).sqrt();
    PositionPrior::Gaussian {
        centre: at.position(),
        sigma_east_m: sigma(ee).min(1e6),
        sigma_north_m: sigma(nn).min(1e6),
        correlation: (en / ((ee + least) * (nn + least)).sqrt()).clamp(-0.99, 0.99),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_failures_with_structure_widen_the_search() {
        let mut widening = SearchWidening::default();
        widening.record_failure(Reason::TooLittleStructure);
        assert_eq!(widening, SearchWidening::default());
        let factors: Vec<f64> = (0..5)
            .map(|_| {
                widening.record_failure(Reason::TooFewAgreeingWindows);
                widening.factor()
            })
            .collect();
        assert_eq!(factors, [1.0, 2.0, 4.0, 8.0, 16.0]);
        widening.reset();
        assert_eq!(widening.factor(), 1.0);
    }
}
