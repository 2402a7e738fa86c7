//! Where an absolute registration searches, and how that widens while none succeeds.

use super::{Estimate, Image};
use crate::locate::{FixRequest, HeadingPrior, PositionPrior, Reason};
use std::f64::consts::PI;

/// Each failure in a row beyond the first widens the region this much.
const WIDENING: f64 = 2.0;
/// After so many failures in a row the whole layer is searched.
const WHOLE_AFTER: u32 = 4;
/// Position, heading and height are never taken to be known better than this.
const LEAST_SIGMA_M: f64 = 15.0;
const LEAST_HEADING_SIGMA_RAD: f64 = 0.02;
const LEAST_HEIGHT_SIGMA: f64 = 0.01;
/// A height off by more is no prior that a registration could use.
const MOST_HEIGHT_SIGMA: f64 = 0.06;

/// Failures since the last success.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Patience {
    failures: u32,
}

impl Patience {
    /// Begins anew.
    pub fn succeeded(&mut self) {
        self.failures = 0;
    }

    /// An image that shows nothing says nothing about where it is not.
    pub fn failed(&mut self, reason: Reason) {
        if reason != Reason::TooLittleStructure {
            self.failures += 1;
        }
    }

    fn widening(self) -> f64 {
        WIDENING.powi(self.failures.saturating_sub(1).min(WHOLE_AFTER) as i32)
    }

    /// What to ask for an image taken at an estimated place.
    pub fn request(self, layer: &str, image: &Image, at: &Estimate) -> FixRequest {
        let widening = self.widening();
        let heading_sigma = widening * at.heading_sigma_rad().hypot(LEAST_HEADING_SIGMA_RAD);
        FixRequest {
            layer: layer.to_owned(),
            position: if self.failures >= WHOLE_AFTER { PositionPrior::WholeLayer } else { around(at, widening) },
            heading: (3.0 * heading_sigma < PI)
                .then(|| HeadingPrior { heading_rad: at.heading_rad(), sigma_rad: heading_sigma }),
            view: image.view(at.height_m()),
            scale_sigma_ratio: (widening * at.height_sigma_ratio()).clamp(LEAST_HEIGHT_SIGMA, MOST_HEIGHT_SIGMA),
            time_s: Some(image.time_s),
        }
    }
}

fn around(at: &Estimate, widening: f64) -> PositionPrior {
    let [[ee, en], [_, nn]] = at.position_covariance_m2();
    let least = LEAST_SIGMA_M.powi(2);
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
    fn widens_by_failures_and_not_by_blindness() {
        let mut patience = Patience::default();
        patience.failed(Reason::TooLittleStructure);
        assert_eq!(patience, Patience::default());
        let widenings: Vec<f64> = (0..5)
            .map(|_| {
                patience.failed(Reason::TooFewAgreeingWindows);
                patience.widening()
            })
            .collect();
        assert_eq!(widenings, [1.0, 2.0, 4.0, 8.0, 16.0]);
        patience.succeeded();
        assert_eq!(patience.widening(), 1.0);
    }
}
