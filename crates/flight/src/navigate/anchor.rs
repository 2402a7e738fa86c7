//! `Anchors`: the images that the next one may be registered against.

use super::{Estimate, Image, NavigateError, SensorSigmas, Step};

/// An image and what was known there.
#[derive(Debug, Clone)]
struct Anchor {
    image: Image,
    estimate: Estimate,
}

/// The last image, and the last one that was registered, where that is another: an image of cloud is no link to the next,
/// the one before may be.
#[derive(Debug, Clone)]
pub struct Anchors {
    last: Anchor,
    /// The last that was registered, if the last was not.
    sound: Option<Anchor>,
    interval_s: Option<f64>,
}

/// How long an image is tried again, in intervals between images: beyond, the ground is another.
const KEPT_INTERVALS: f64 = 4.5;

impl Anchors {
    /// At the first image.
    pub fn new(image: Image, estimate: Estimate) -> Self {
        Self { last: Anchor { image, estimate }, sound: None, interval_s: None }
    }

    /// Time between the last two images.
    pub fn interval_s(&self) -> Option<f64> {
        self.interval_s
    }

    /// The step to an image from the last one, or from the sound one before it; with that one's estimate.
    ///
    /// # Errors
    /// Where the camera is none.
    pub fn step_to(
        &self,
        image: &Image,
        sensors: &SensorSigmas,
    ) -> Result<Option<(Step, Option<Estimate>)>, NavigateError> {
        // From the sound one first: its position is better.
        if let Some(sound) = &self.sound
            && let Some(step) = sound.image.step_to(image, sensors)?
        {
            return Ok(Some((step, Some(sound.estimate.clone()))));
        }
        Ok(self.last.image.step_to(image, sensors)?.map(|step| (step, None)))
    }

    /// Another image; `is_linked` where it was registered against one of these.
    pub fn add(&mut self, image: Image, estimate: Estimate, is_linked: bool) {
        let interval_s = image.time_s - self.last.image.time_s;
        let next = Anchor { image, estimate };
        let before = std::mem::replace(&mut self.last, next);
        self.sound = if is_linked { None } else { self.sound.take().or(Some(before)) };
        let is_stale = |a: &Anchor| self.last.image.time_s - a.image.time_s > KEPT_INTERVALS * interval_s;
        if self.sound.as_ref().is_some_and(is_stale) {
            self.sound = None;
        }
        self.interval_s = Some(interval_s);
    }

    /// The last image's estimate was corrected: what was known before it no longer counts.
    pub fn corrected(&mut self, estimate: &Estimate) {
        self.last.estimate = estimate.clone();
        self.sound = None;
    }
}
