//! `FlyTrial`: replays a recorded flight in a closed loop.

use super::disturbance::Disturbances;
use super::outcome::FlyOutcome;
use crate::trial::error::TrialError;
use crate::trial::recorded_flight::{RecordedFlight, RecordedFrame, runs};
use overfly_core::camera::Intrinsics;
use overfly_core::coupling::Mode;
use overfly_core::geodesy::{Enu, Geodetic, LocalFrame};
use overfly_core::pixels::Gray;
use overfly_flight::frame::read_frame;
use overfly_flight::navigate::{FlightImage, NavigateError, NavigateOptions, Navigator, SensorReading};
use overfly_store::Reader;
use std::sync::Arc;

/// A flight to replay.
#[derive(Debug, Clone)]
pub struct FlyTrial<'a> {
    /// The store in which frames are searched.
    pub store: &'a Reader,
    /// The recorded flight.
    pub flight: &'a RecordedFlight,
    /// The disturbances.
    pub disturbances: Disturbances,
}

impl FlyTrial<'_> {
    /// Replays the flight; calls `progress` after each image.
    ///
    /// # Errors
    /// If a frame has no truth or cannot be decoded, or the store fails.
    pub fn run(
        &self,
        options: &NavigateOptions,
        mut progress: impl FnMut(&FlyOutcome),
    ) -> Result<Vec<FlyOutcome>, TrialError> {
        self.fly(&self.flight.frames, options, &mut progress)
    }

    /// Dead reckoning: replays each run between pauses by relative registrations alone, from its true start and
    /// without disturbances.
    ///
    /// # Errors
    /// Like [`FlyTrial::run`].
    pub fn reckon(
        &self,
        options: &NavigateOptions,
        mut progress: impl FnMut(&FlyOutcome),
    ) -> Result<Vec<Vec<FlyOutcome>>, TrialError> {
        let options = NavigateOptions { mode: Mode::RelativeOnly, ..options.clone() };
        let untroubled = Self { disturbances: Disturbances::default(), ..self.clone() };
        let runs = runs(&self.flight.frames);
        runs.into_iter().map(|run| untroubled.fly(run, &options, &mut progress)).collect()
    }

    fn fly(
        &self,
        frames: &[RecordedFrame],
        options: &NavigateOptions,
        progress: &mut impl FnMut(&FlyOutcome),
    ) -> Result<Vec<FlyOutcome>, TrialError> {
        let clouded = self.disturbances.clouded(frames.len());
        let tape = self.disturbances.tape(frames);
        let mut navigator: Option<Navigator> = None;
        let mut outcomes = Vec::with_capacity(tape.len());
        for row in &tape {
            let (number, frame) = (row.frame, &frames[row.frame]);
            let truth = self.truth(frame)?;
            let upper = row.upper_half.map(|i| self.seen(&frames[i]));
            let gray = row.altered(self.seen(&frames[row.shown]), upper.as_ref());
            let gray = self.disturbances.seen(number, gray, &clouded);
            let image = self.image(&row.stated, gray);
            let failed = |cause| TrialError::Navigate { image: frame.image.clone(), cause };
            let position = match &mut navigator {
                Some(navigator) => navigator.process_image(image).map_err(failed)?,
                none => {
                    let start = self.start(truth).map_err(failed)?;
                    let (begun, position) = Navigator::start(self.store, options, start, image).map_err(failed)?;
                    *none = Some(begun);
                    position
                }
            };
            let is_hidden = self.disturbances.hides(number, &clouded);
            let outcome = FlyOutcome::new(frame, position, truth, is_hidden);
            progress(&outcome);
            outcomes.push(outcome);
        }
        Ok(outcomes)
    }

    /// What the camera saw; black where the file cannot be read, because a flight goes on without an image.
    fn seen(&self, frame: &RecordedFrame) -> Gray {
        let Intrinsics { width_px, height_px, .. } = self.flight.camera;
        read_frame(&frame.path).unwrap_or_else(|_| Gray::filled(width_px as usize, height_px as usize, 0.0))
    }

    fn truth(&self, frame: &RecordedFrame) -> Result<Geodetic, TrialError> {
        frame.true_position.ok_or(TrialError::NoTruth { path: self.flight.path.clone(), line: frame.line })
    }

    /// The stated start of the flight.
    fn start(&self, truth: Geodetic) -> Result<Geodetic, NavigateError> {
        let (sin, cos) = self.disturbances.start_bearing_rad().sin_cos();
        let length_m = self.disturbances.start_error_m;
        let off = Enu { east_m: length_m * sin, north_m: length_m * cos };
        Ok(LocalFrame::at(truth).geodetic_from_enu(off)?)
    }

    fn image(&self, frame: &RecordedFrame, gray: Gray) -> FlightImage {
        FlightImage {
            gray: Arc::new(gray),
            time_s: frame.time_s,
            reading: SensorReading {
                heading_rad: frame.heading_rad + self.disturbances.heading_bias_rad,
                height_m: frame.height_agl_m,
            },
            intrinsics: frame.camera(&self.flight.camera).clone(),
            attitude: frame.attitude,
        }
    }
}
