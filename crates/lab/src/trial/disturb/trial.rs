//! `DisturbedTrial`: locates disturbed frames of a flight, each on its own from a displaced prior.

use super::disturbed_frame::{DisturbedFrame, SourceFrame};
use super::kind::DisturbanceKind;
use crate::trial::error::TrialError;
use crate::trial::fixes::FixTrial;
use crate::trial::recorded_flight::{RecordedFlight, RecordedFrame};
use overfly_core::geodesy::{Enu, LocalFrame};
use overfly_flight::frame::read_frame;
use overfly_flight::locate::{Answer, FixRequest, HeadingPrior, PositionPrior, locate};
use overfly_store::Reader;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// A trial of disturbed frames.
#[derive(Debug, Clone)]
pub struct DisturbedTrial {
    /// What the search is told, as for undisturbed frames. Its threads are frames at a time; each search uses one.
    pub fixes: FixTrial,
    /// The kinds.
    pub kinds: Vec<DisturbanceKind>,
    /// Frames of each kind; the flight's frames take turns.
    pub frames: usize,
}

/// The result of one disturbed frame.
#[derive(Debug, Clone)]
pub struct DisturbedOutcome {
    /// The kind.
    pub kind: DisturbanceKind,
    /// How strongly the frame was disturbed, in the kind's own unit.
    pub size: f64,
    /// Name in `flight.csv` of the frame that was disturbed.
    pub image: String,
    /// The answer.
    pub answer: Answer,
    /// Fix minus truth at the nadir and at the image's centre; `None` without a fix.
    pub errors: Option<DisturbedErrors>,
}

/// Fix minus truth of a disturbed frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DisturbedErrors {
    /// At the nadir.
    pub nadir: Enu,
    /// At the ground under the image's centre.
    pub centre: Enu,
}

impl DisturbedTrial {
    /// Locates the frames of every kind; calls `progress` after each. A frame that cannot be disturbed in a way is left out.
    ///
    /// # Errors
    /// As [`FixTrial::run`].
    pub fn run(
        &self,
        store: &Reader,
        flight: &RecordedFlight,
        progress: impl Fn() + Sync,
    ) -> Result<Vec<DisturbedOutcome>, TrialError> {
        self.fixes.check()?;
        if let Some(frame) = flight.frames.iter().find(|f| f.true_position.is_none()) {
            return Err(TrialError::NoTruth { path: flight.path.clone(), line: frame.line });
        }
        let drawn: Vec<_> =
            (0..self.kinds.len()).flat_map(|kind| (0..self.frames).map(move |number| (kind, number))).collect();
        let one = |&(kind, number): &(usize, usize)| {
            let outcome = self.locate_one(store, flight, self.kinds[kind], number);
            progress();
            outcome.transpose()
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.fixes.threads).build();
        match pool {
            Ok(pool) => pool.install(|| drawn.par_iter().filter_map(one).collect()),
            Err(_) => drawn.iter().filter_map(one).collect(),
        }
    }

    fn locate_one(
        &self,
        store: &Reader,
        flight: &RecordedFlight,
        kind: DisturbanceKind,
        number: usize,
    ) -> Result<Option<DisturbedOutcome>, TrialError> {
        let frame = &flight.frames[number % flight.frames.len()];
        let failed = |cause| TrialError::Locate { image: frame.image.clone(), cause };
        // Each frame has its own stream, so that neither order nor threads matter.
        let mut rng = ChaCha8Rng::seed_from_u64(self.fixes.seed);
        rng.set_stream(((kind as u64 + 1) << 32) + number as u64);
        let gray = read_frame(&frame.path)?;
        let source = source(flight, frame, &gray);
        let Some(disturbed) = DisturbedFrame::draw(kind, number, &source, &mut rng).map_err(|e| failed(e.into()))?
        else {
            return Ok(None);
        };
        let request = self.request(frame, &disturbed, number);
        let answer = locate(store, &disturbed.gray, &request, 1).map_err(failed)?;
        let errors = match &answer {
            Answer::Fix(fix) => Some(DisturbedErrors {
                nadir: LocalFrame::at(disturbed.nadir).enu_from_geodetic(fix.position),
                centre: LocalFrame::at(disturbed.centre).enu_from_geodetic(fix.image_centre),
            }),
            Answer::NoFix(_) => None,
        };
        Ok(Some(DisturbedOutcome { kind, size: disturbed.size, image: frame.image.clone(), answer, errors }))
    }

    fn request(&self, frame: &RecordedFrame, disturbed: &DisturbedFrame, number: usize) -> FixRequest {
        let trial = &self.fixes;
        let square = PositionPrior::Square {
            centre: trial.displaced(disturbed.nadir, number),
            half_width_m: trial.prior_error_m * 1.001 + 1.0,
        };
        FixRequest {
            layer: trial.layer.clone(),
            position: if trial.unknown_position { PositionPrior::WholeLayer } else { square },
            heading: trial
                .heading_sigma_deg
                .map(|sigma| HeadingPrior { heading_rad: disturbed.heading_rad, sigma_rad: sigma.to_radians() }),
            view: disturbed.view.clone(),
            scale_sigma_ratio: trial.height_sigma_ratio,
            time_s: Some(frame.time_s),
        }
    }
}

fn source<'a>(
    flight: &'a RecordedFlight,
    frame: &'a RecordedFrame,
    gray: &'a overfly_core::pixels::Gray,
) -> SourceFrame<'a> {
    SourceFrame {
        gray,
        intrinsics: frame.camera(&flight.camera),
        height_agl_m: frame.height_agl_m,
        attitude: frame.attitude,
        nadir: frame.true_position.expect("checked by the caller"),
        true_heading_rad: frame.true_heading_rad.unwrap_or(frame.heading_rad),
        heading_rad: frame.heading_rad,
    }
}
