//! `Keyframes`: the earlier images that the next one can be registered against.

use super::error::NavigateError;
use super::filter::NavigationFilter;
use super::flight_image::FlightImage;
use super::measurements::{OdometryStep, SensorSigmas};

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
    interval_s: Option<f64>,
}

/// How long an image remains a keyframe, in intervals between images. Later, the aircraft is over other ground.
const MAX_AGE_INTERVALS: f64 = 4.5;

impl Keyframes {
    /// Starts with the first image.
    pub fn new(image: FlightImage, filter: NavigationFilter) -> Self {
        Self { last: Keyframe { image, filter }, last_registered: None, interval_s: None }
    }

    /// Time between the last two images, seconds.
    pub fn interval_s(&self) -> Option<f64> {
        self.interval_s
    }

    /// The odometry step to an image. Where the step begins at an earlier image than the last, the filter at that image
    /// comes with it.
    ///
    /// # Errors
    /// Where the image's camera is invalid.
    pub fn step_to(
        &self,
        image: &FlightImage,
        sensors: &SensorSigmas,
    ) -> Result<Option<(OdometryStep, Option<NavigationFilter>)>, NavigateError> {
        // The registered image first: its position is better.
        if let Some(registered) = &self.last_registered
            && let Some(step) = registered.image.step_to(image, sensors)?
        {
            return Ok(Some((step, Some(registered.filter.clone()))));
        }
        Ok(self.last.image.step_to(image, sensors)?.map(|step| (step, None)))
    }

    /// Adds an image; `is_registered` where it was registered against a keyframe.
    pub fn add(&mut self, image: FlightImage, filter: NavigationFilter, is_registered: bool) {
        let interval_s = image.time_s - self.last.image.time_s;
        let before = std::mem::replace(&mut self.last, Keyframe { image, filter });
        self.last_registered = if is_registered { None } else { self.last_registered.take().or(Some(before)) };
        let is_stale = |k: &Keyframe| self.last.image.time_s - k.image.time_s > MAX_AGE_INTERVALS * interval_s;
        if self.last_registered.as_ref().is_some_and(is_stale) {
            self.last_registered = None;
        }
        self.interval_s = Some(interval_s);
    }

    /// Replaces the filter at the last image after a fix; filters at earlier images are outdated and dropped.
    pub fn set_filter(&mut self, filter: &NavigationFilter) {
        self.last.filter = filter.clone();
        self.last_registered = None;
    }
}
