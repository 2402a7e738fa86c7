//! `Keyframes`: the earlier images that the next one can be registered against.

use super::error::NavigateError;
use super::filter::NavigationFilter;
use super::flight_image::FlightImage;
use super::flight_limits::Manoeuvre;
use super::measurements::{OdometryStep, SensorReading};
use super::options::NavigateOptions;
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
    /// Whether the last keyframe is the last image of the flight.
    is_current: bool,
    /// Whether a fix has moved the filter since the last keyframe, so that no step can begin there.
    is_outdated: bool,
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
        from: Option<Box<NavigationFilter>>,
        /// The sensors' reading without what the step contradicts.
        reading: SensorReading,
        /// Whether the compass contradicts the turn.
        is_doubtful: bool,
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
        Self { last: Keyframe { image, filter }, is_current: true, is_outdated: false, last_registered: None }
    }

    /// Registers an image. Where the step begins at an earlier image than the last, the filter at that image comes with it.
    /// `interval_s`: the time since the last image, whether that is a keyframe or not.
    ///
    /// # Errors
    /// Where the image's camera is invalid.
    pub fn step_to(
        &self,
        image: &FlightImage,
        interval_s: f64,
        velocity: Velocity,
        options: &NavigateOptions,
    ) -> Result<KeyframeStep, NavigateError> {
        let is_usable = self.is_current || !self.is_outdated && !self.last.is_stale(image.time_s, interval_s);
        let mut from_last = if is_usable { self.last.step_to(image, velocity, options)? } else { KeyframeStep::None };
        if let KeyframeStep::Motion { from, .. } = &mut from_last {
            *from = (!self.is_current).then(|| Box::new(self.last.filter.clone()));
        }
        // The registered image is better: its position is. But what contradicts the last image is no measurement.
        if let (Some(registered), KeyframeStep::Motion { .. } | KeyframeStep::None) =
            (&self.last_registered, &from_last)
            && let KeyframeStep::Motion { step, reading, is_doubtful, .. } =
                registered.step_to(image, velocity, options)?
        {
            let from = Some(Box::new(registered.filter.clone()));
            return Ok(KeyframeStep::Motion { step, from, reading, is_doubtful });
        }
        Ok(from_last)
    }

    /// Adds an image that follows the image before by `interval_s`; `is_registered` where it was registered against a keyframe.
    pub fn add(&mut self, image: FlightImage, filter: NavigationFilter, is_registered: bool, interval_s: f64) {
        let before = std::mem::replace(&mut self.last, Keyframe { image, filter });
        (self.is_current, self.is_outdated) = (true, false);
        self.last_registered = if is_registered { None } else { self.last_registered.take().or(Some(before)) };
        let now_s = self.last.image.time_s;
        if self.last_registered.as_ref().is_some_and(|k| k.is_stale(now_s, interval_s)) {
            self.last_registered = None;
        }
    }

    /// Passes over an image that is no keyframe.
    pub fn skip(&mut self) {
        self.is_current = false;
    }

    /// Replaces the filter at the last image after a fix; filters at earlier images are outdated.
    pub fn set_filter(&mut self, filter: &NavigationFilter) {
        self.is_outdated = !self.is_current;
        self.last.filter = filter.clone();
        self.last_registered = None;
    }
}

impl Keyframe {
    fn is_stale(&self, now_s: f64, interval_s: f64) -> bool {
        now_s - self.image.time_s > MAX_AGE_INTERVALS * interval_s
    }

    fn step_to(
        &self,
        image: &FlightImage,
        velocity: Velocity,
        options: &NavigateOptions,
    ) -> Result<KeyframeStep, NavigateError> {
        let Some(mut step) = self.image.step_to(image)? else { return Ok(KeyframeStep::None) };
        let elapsed_s = image.time_s - self.image.time_s;
        let mut reading = image.reading;
        let mut is_doubtful = false;
        if !self.image.agrees_with_compass(image, &step, &options.sensors) {
            let most = Manoeuvre::largest(options, velocity.speed_mps(), self.filter.height_m(), elapsed_s);
            if step.turn_rad.abs() > most.turn_rad {
                return Ok(KeyframeStep::None);
            }
            // The aircraft can fly this turn, and many keypoints show it: the compass is wrong, or the camera shows other images.
            let turned_rad = self.image.turn_by_compass_rad(image) - step.turn_rad;
            if turned_rad.is_finite() {
                step = step.doubted(turned_rad);
                is_doubtful = true;
            }
            reading.heading_rad = f64::NAN;
        }
        let sway_m = image.sway_sigma_ratio(elapsed_s, step.turn_rad) * self.filter.height_m();
        if let Some(off_m) = velocity.contradiction_m(&self.filter, &step, elapsed_s, sway_m) {
            return Ok(KeyframeStep::Unflyable { off_m });
        }
        if self.image.contradicts_altimeter(image, &step, &options.sensors) {
            reading.height_m = f64::NAN;
        }
        Ok(KeyframeStep::Motion { step, from: None, reading, is_doubtful })
    }
}
