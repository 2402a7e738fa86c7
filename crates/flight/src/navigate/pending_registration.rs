//! `PendingRegistration`: an absolute registration that began at an image, and whose result comes later.

use super::error::NavigateError;
use super::flight_image::FlightImage;
use super::hypotheses::{Hypotheses, ImageUpdate};
use super::measurements::{FixMeasurement, SensorSigmas};
use super::options::NavigateOptions;
use super::track::PlaceEvidence;
use crate::locate::{Answer, Fix, FixRequest, LocateError, TrackedPlace, locate_places};
use overfly_core::camera::CameraError;
use overfly_store::Reader;

/// A fix outside the gate starts an alternative filter only where it is at least this sure.
const SURE_LOG10_FALSE_ALARMS: f64 = -9.0;

/// An absolute registration that began at an image: a delayed measurement.
#[derive(Clone)]
pub struct PendingRegistration {
    /// When the result is due, seconds.
    pub done_s: f64,
    /// The result.
    pub answer: Answer,
    /// Without a fix: the places that a track may decide on.
    pub places: Vec<TrackedPlace>,
    /// The image.
    pub image: FlightImage,
    /// The filters at that image.
    pub hypotheses: Hypotheses,
    /// The time updates since that image.
    pub updates: Vec<ImageUpdate>,
}

/// What an absolute registration searched and found.
pub struct Searched {
    /// Base tiles searched.
    pub tiles: usize,
    /// Nominal count of the search.
    pub nominal_count: f64,
    /// The fix, if there is one.
    pub fix: Option<Fix>,
}

impl PendingRegistration {
    /// Registers an image. `None` where the region is too large to search or the camera is tilted too far: the flight goes on.
    ///
    /// # Errors
    /// Where the store cannot be searched.
    pub fn begin(
        store: &Reader,
        options: &NavigateOptions,
        image: &FlightImage,
        request: &FixRequest,
        hypotheses: Hypotheses,
    ) -> Result<Option<Self>, NavigateError> {
        let (answer, places) = match locate_places(store, &image.gray, request, options.threads) {
            Err(
                LocateError::TooWide { .. }
                | LocateError::MemoryLimit { .. }
                | LocateError::Camera(CameraError::TooFarOffNadir { .. }),
            ) => return Ok(None),
            answer => answer?,
        };
        let places = if options.tracks { places } else { Vec::new() };
        let (done_s, image, updates) = (image.time_s, image.clone(), Vec::new());
        let mut pending = Self { done_s, answer, places, image, hypotheses, updates };
        pending.done_s += options.execution_times.absolute_s(pending.searched().tiles);
        Ok(Some(pending))
    }

    /// What was searched and found.
    pub fn searched(&self) -> Searched {
        match &self.answer {
            Answer::Fix(fix) => {
                Searched { tiles: fix.tiles_searched, nominal_count: fix.nominal_count, fix: Some(fix.clone()) }
            }
            Answer::NoFix(no_fix) => {
                Searched { tiles: no_fix.tiles_searched, nominal_count: no_fix.nominal_count, fix: None }
            }
        }
    }

    /// The filters at the image, updated with its fix, and whether the fix was accepted.
    ///
    /// # Errors
    /// Where the image's camera is invalid or covariances are singular.
    pub fn updated(&self, fix: &Fix, sensors: &SensorSigmas) -> Result<(Hypotheses, bool), NavigateError> {
        let measurement = measurement(fix, &self.image)?;
        let is_sure = fix.log10_false_alarms.is_some_and(|l| l <= SURE_LOG10_FALSE_ALARMS);
        let mut hypotheses = self.hypotheses.clone();
        let is_accepted = hypotheses.update_fix(&measurement, is_sure, self.image.reading, sensors)?;
        Ok((hypotheses, is_accepted))
    }

    /// The filters at the image, updated with the first of its places that the track decides on, and whether it decides on one.
    ///
    /// # Errors
    /// As [`PendingRegistration::updated`].
    pub fn tracked(&self, sensors: &SensorSigmas) -> Result<(Hypotheses, bool), NavigateError> {
        let mut hypotheses = self.hypotheses.clone();
        for place in &self.places {
            let measurement = measurement(&place.fix, &self.image)?;
            let evidence = PlaceEvidence { log10_false_alarms: place.log10_false_alarms, rival_m: place.rival_m };
            if hypotheses.update_place(&measurement, evidence, self.image.reading, sensors)? {
                return Ok((hypotheses, true));
            }
        }
        Ok((hypotheses, false))
    }
}

/// The fix as the filter takes it: the point that the stated attitude puts straight below the camera, without the attitude's
/// error, which the fixes have in common. The fix's ground sample distance is a height through the image's own camera.
fn measurement(fix: &Fix, image: &FlightImage) -> Result<FixMeasurement, CameraError> {
    let gsd_per_height = image.camera(1.0)?.gsd_m_per_px();
    Ok(FixMeasurement {
        position: fix.position,
        covariance: fix.image_centre_covariance,
        false_probability: fix.false_fix_probability,
        heading: fix.heading,
        heading_sigma_rad: fix.heading_sigma_rad,
        log_height: (fix.gsd_m_per_px / gsd_per_height).ln(),
        log_height_sigma: fix.scale_sigma_ratio,
    })
}
