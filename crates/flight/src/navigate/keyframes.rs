//! `Keyframes`: the earlier images that the next one can be registered against.

use super::error::NavigateError;
use super::filter::NavigationFilter;
use super::flight_image::FlightImage;
use super::measurements::{OdometryStep, SensorReading, SensorSigmas};
use super::velocity::Velocity;

/// An image and the filter at its time.
#[derive(Debug, Clone)]
struct Keyframe {
    image: FlightImage,
    filter: NavigationFilter,
}

/// The last image, and, where the last image could not be registered, the last one before it that could. An image of cloud
/// gives no odometry to the next image; the image before the cloud may.
#[derive(Debug, Clone)]
pub struct Keyframes {
    last: Keyframe,
    /// The last registered image, where the last image was not registered.
    last_registered: Option<Keyframe>,
}

/// The relative registration of an image against the keyframes.
#[derive(Debug, Clone)]
pub enum KeyframeStep {
    /// No keyframe can be registered.
    None,
    /// A motion that the aircraft can fly.
    Motion {
        /// The odometry step.
        step: OdometryStep,
        /// The filter at the image where the step begins, where this is not the last one.
        from: Option<NavigationFilter>,
        /// The sensors' reading without what the step contradicts.
        reading: SensorReading,
    },
    /// A motion that no aircraft can fly.
    Unflyable {
        /// How far it leads from where the last velocity leads, metres.
        off_m: f64,
    },
}

/// How long an image remains a keyframe, in intervals between images. Later, the aircraft is over other ground.
const MAX_AGE_INTERVALS: f64 = 4.5;

impl Keyframes {
    /// Starts with the first image.
    pub fn new(image: FlightImage, filter: NavigationFilter) -> Self {
        Self { last: Keyframe { image, filter }, last_registered: None }
    }

    /// Registers an image. Where the step begins at an earlier image than the last, the filter at that image comes with it.
    ///
    /// # Errors
    /// Where the image's camera is invalid.
    pub fn step_to(
        &self,
        image: &FlightImage,
        velocity: Velocity,
        sensors: &SensorSigmas,
    ) -> Result<KeyframeStep, NavigateError> {
        let from_last = self.last.step_to(image, velocity, sensors)?;
        // The registered image is better: its position is. But what contradicts the last image is no measurement.
        if let (Some(registered), KeyframeStep::Motion { .. } | KeyframeStep::None) =
            (&self.last_registered, &from_last)
            && let KeyframeStep::Motion { step, reading, .. } = registered.step_to(image, velocity, sensors)?
        {
            return Ok(KeyframeStep::Motion { step, from: Some(registered.filter.clone()), reading });
        }
        Ok(from_last)
    }

    /// Adds an image that follows the image before by `interval_s`; `is_registered` where it was registered against a keyframe.
    pub fn add(&mut self, image: FlightImage, filter: NavigationFilter, is_registered: bool, interval_s: f64) {
        let before = std::mem::replace(&mut self.last, Keyframe { image, filter });
        self.last_registered = if is_registered { None } else { self.last_registered.take().or(Some(before)) };
        let is_stale = |k: &Keyframe| self.last.image.time_s - k.image.time_s > MAX_AGE_INTERVALS * interval_s;
        if self.last_registered.as_ref().is_some_and(is_stale) {
            self.last_registered = None;
        }
    }

    /// Replaces the filter at the last image after a fix; filters at earlier images are outdated and dropped.
    pub fn set_filter(&mut self, filter: &NavigationFilter) {
        self.last.filter = filter.clone();
        self.last_registered = None;
    }
}

impl Keyframe {
    fn step_to(
        &self,
        image: &FlightImage,
        velocity: Velocity,
        sensors: &SensorSigmas,
    ) -> Result<KeyframeStep, NavigateError> {
        let Some(step) = self.image.step_to(image, sensors)? else { return Ok(KeyframeStep::None) };
        let elapsed_s = image.time_s - self.image.time_s;
        if let Some(off_m) = velocity.contradiction_m(&self.filter, &step, elapsed_s) {
            return Ok(KeyframeStep::Unflyable { off_m });
        }
        let mut reading = image.reading;
        if self.image.contradicts_altimeter(image, &step, sensors) {
            reading.height_m = f64::NAN;
        }
        Ok(KeyframeStep::Motion { step, from: None, reading })
    }
}
