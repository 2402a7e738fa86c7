//! `Position`: the navigator's output for one image.

use super::hypotheses::Hypotheses;
use crate::locate::Fix;
use overfly_core::geodesy::{EnuCovariance, Geodetic};
use overfly_core::integrity::ErrorMixture;
use serde::Serialize;

/// Where a position comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionSource {
    /// An absolute registration of this very image.
    Absolute,
    /// An absolute registration of an earlier image, or the start, carried forward.
    Propagated,
    /// The position is in doubt: fixes, motion and sensors contradict each other, or the image's time is wrong. The covariance
    /// holds every place that they leave open.
    Lost,
}

impl PositionSource {
    /// The word in files: `absolute`, `propagated` or `lost`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Absolute => "absolute",
            Self::Propagated => "propagated",
            Self::Lost => "lost",
        }
    }
}

/// Position and heading of the aircraft when an image was taken, with their uncertainty.
#[derive(Debug, Clone)]
pub struct Position {
    /// When the image was taken, seconds.
    pub time_s: f64,
    /// Where the position comes from.
    pub source: PositionSource,
    /// The point straight below the camera.
    pub position: Geodetic,
    /// Heading, radians clockwise from true north in [0, 2 pi).
    pub heading_rad: f64,
    /// One standard deviation of the heading, radians.
    pub heading_sigma_rad: f64,
    /// Covariance of the position.
    pub covariance: EnuCovariance,
    /// How the position may err, false fixes included.
    pub errors: ErrorMixture,
    /// True height over the altimeter's reading, as estimated from fixes; the error of the nominal focal length is included.
    pub height_scale: f64,
    /// One standard deviation of [`Position::height_scale`], as a ratio.
    pub height_scale_sigma_ratio: f64,
    /// Time since the image of the last fix, seconds; `None` before the first.
    pub fix_age_s: Option<f64>,
    /// Tiles searched by the absolute registration that began at this image; 0 without one.
    pub tiles_searched: usize,
    /// 𝒩: nominal count of that search; 0 without one.
    pub nominal_count: f64,
    /// Relative registrations tried at this image.
    pub relative_count: usize,
    /// Absolute registrations begun at this image.
    pub absolute_count: usize,
    /// The fix of the absolute registration that began at this image, whether the filter accepts it or not.
    pub fix: Option<Fix>,
}

impl Position {
    /// The position by the filters of a flight, without the registrations of an image. `tilt_sigma_ratio`: one standard deviation
    /// per axis of the point that the stated attitude puts straight below the camera, as a ratio of the height.
    pub(super) fn of_filters(
        hypotheses: &Hypotheses,
        tilt_sigma_ratio: f64,
        time_s: f64,
        source: PositionSource,
        fix_age_s: Option<f64>,
    ) -> Self {
        let filter = hypotheses.filter();
        let unwidened = Self {
            time_s,
            source,
            position: filter.position(),
            heading_rad: filter.heading().radians(),
            heading_sigma_rad: filter.heading_sigma_rad(),
            covariance: hypotheses.position_covariance(),
            errors: if source == PositionSource::Lost { ErrorMixture::default() } else { hypotheses.errors() },
            height_scale: filter.height_scale(),
            height_scale_sigma_ratio: filter.height_scale_sigma_ratio(),
            fix_age_s,
            tiles_searched: 0,
            nominal_count: 0.0,
            relative_count: 0,
            absolute_count: 0,
            fix: None,
        };
        unwidened.widened(tilt_sigma_ratio * filter.height_m())
    }

    /// The radius around the position that its error exceeds without warning at most at an integrity risk, metres; `None` where there
    /// is no such radius: in doubt, or where a false fix alone is likelier than that.
    pub fn protection_level_m(&self, integrity_risk: f64) -> Option<f64> {
        self.errors.protection_level_m(integrity_risk)
    }

    /// The position with another source of error, one standard deviation per axis, metres.
    pub(super) fn widened(mut self, by_m: f64) -> Self {
        self.covariance.ee_m2 += by_m.powi(2);
        self.covariance.nn_m2 += by_m.powi(2);
        self.errors = self.errors.widened(by_m);
        self
    }
}
