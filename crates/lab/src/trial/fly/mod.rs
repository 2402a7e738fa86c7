//! `fly`: a flight replayed in a closed loop. Truth starts it and scores it, and is not looked at between.

mod disturbance;
mod scale;
mod score;
mod table;

pub use disturbance::Disturbances;
pub use scale::{FlightScale, ScaleSource};
pub use score::{FlyScore, RunScore};
pub use table::write_positions;

use super::{Flight, Frame, TrialError};
use overfly_core::coupling::Mode;
use overfly_core::geodesy::{Enu, Geodetic, LocalFrame};
use overfly_flight::frame::read_frame;
use overfly_flight::navigate::{FlightImage, NavigateError, NavigateOptions, Navigator, Position, SensorReading};
use overfly_store::Reader;
use std::sync::Arc;

/// A flight to replay.
#[derive(Debug, Clone)]
pub struct FlyTrial<'a> {
    /// Where frames are looked for.
    pub store: &'a Reader,
    /// The frames.
    pub flight: &'a Flight,
    /// What it is troubled with.
    pub disturbances: Disturbances,
}

/// One image of a replayed flight.
#[derive(Debug, Clone)]
pub struct FlyOutcome {
    /// As `flight.csv` names it.
    pub image: String,
    /// Where it was put.
    pub position: Position,
    /// Where it was.
    pub truth: Geodetic,
    /// Less truth, metres.
    pub error: Enu,
    /// How far the fix begun at this image is from its truth, metres; `None` without one.
    pub fix_error_m: Option<f64>,
    /// Whether the image showed nothing.
    pub is_hidden: bool,
}

impl FlyTrial<'_> {
    /// Flies; `progress` is called after each image.
    ///
    /// # Errors
    /// Where a frame has no truth, cannot be decoded, or the store fails.
    pub fn run(
        &self,
        options: &NavigateOptions,
        mut progress: impl FnMut(&FlyOutcome),
    ) -> Result<Vec<FlyOutcome>, TrialError> {
        self.fly(&self.flight.frames, options, &mut progress)
    }

    /// Dead reckoning: each run between pauses by relative registrations alone from its true start, untroubled.
    ///
    /// # Errors
    /// As [`FlyTrial::run`].
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
        frames: &[Frame],
        options: &NavigateOptions,
        progress: &mut impl FnMut(&FlyOutcome),
    ) -> Result<Vec<FlyOutcome>, TrialError> {
        let clouded = self.disturbances.clouded(frames.len());
        let mut navigator: Option<Navigator> = None;
        let mut outcomes = Vec::with_capacity(frames.len());
        for (number, frame) in frames.iter().enumerate() {
            let truth = self.truth(frame)?;
            let gray = self.disturbances.seen(number, read_frame(&frame.path)?, &clouded);
            let image = self.image(frame, gray);
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
            let outcome = outcome(frame, position, truth, is_hidden);
            progress(&outcome);
            outcomes.push(outcome);
        }
        Ok(outcomes)
    }

    fn truth(&self, frame: &Frame) -> Result<Geodetic, TrialError> {
        frame.true_position.ok_or(TrialError::NoTruth { path: self.flight.path.clone(), line: frame.line })
    }

    /// The stated start.
    fn start(&self, truth: Geodetic) -> Result<Geodetic, NavigateError> {
        let (sin, cos) = self.disturbances.start_bearing_rad().sin_cos();
        let length_m = self.disturbances.start_error_m;
        let off = Enu { east_m: length_m * sin, north_m: length_m * cos };
        Ok(LocalFrame::at(truth).geodetic_from_enu(off)?)
    }

    fn image(&self, frame: &Frame, gray: overfly_core::pixels::Gray) -> FlightImage {
        FlightImage {
            gray: Arc::new(gray),
            time_s: frame.time_s,
            reading: SensorReading {
                heading_rad: frame.heading_rad + self.disturbances.heading_bias_rad,
                height_m: frame.height_agl_m,
            },
            intrinsics: self.flight.camera.clone(),
            pitch_rad: frame.pitch_rad,
            roll_rad: frame.roll_rad,
        }
    }
}

/// A pause this many times as long as the median between images ends a run.
const PAUSE: f64 = 5.0;

/// Pieces of a flight without a pause.
fn runs(frames: &[Frame]) -> Vec<&[Frame]> {
    let mut gaps: Vec<f64> = frames.windows(2).map(|w| w[1].time_s - w[0].time_s).collect();
    gaps.sort_by(f64::total_cmp);
    let longest_s = gaps.get(gaps.len() / 2).map_or(0.0, |median| PAUSE * median);
    frames.chunk_by(|a, b| b.time_s - a.time_s <= longest_s).collect()
}

fn outcome(frame: &Frame, position: Position, truth: Geodetic, is_hidden: bool) -> FlyOutcome {
    let here = LocalFrame::at(truth);
    let error = here.enu_from_geodetic(position.position);
    let fix_error_m = position.fix.as_ref().and_then(|fix| {
        let at = Geodetic::from_degrees(fix.latitude_deg, fix.longitude_deg).ok()?;
        Some(here.enu_from_geodetic(at).length_m())
    });
    FlyOutcome { image: frame.image.clone(), position, truth, error, fix_error_m, is_hidden }
}
