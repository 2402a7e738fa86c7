//! `evaluate fixes`: locates every frame of a flight on its own from a displaced prior, and scores it against the
//! truth.

use super::error::TrialError;
use super::recorded_flight::{RecordedFlight, RecordedFrame};
use overfly_core::geodesy::{Enu, EnuCovariance, Geodetic, LocalFrame};
use overfly_flight::frame::{ReducedFrame, read_large_frame};
use overfly_flight::locate::{Answer, Fix, FixRequest, HeadingPrior, Part, Parts, PositionPrior, locate_by_parts};
use overfly_store::Reader;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;

/// The options of a trial: what the search is told.
#[derive(Debug, Clone)]
pub struct FixTrial {
    /// Layer to search.
    pub layer: String,
    /// The prior is displaced by a uniform error of up to this on each axis. The search covers a square of this half
    /// width, metres.
    pub prior_error_m: f64,
    /// Seed of the displacements.
    pub seed: u64,
    /// One standard deviation stated for the heading, degrees; `None` leaves the heading unknown.
    pub heading_sigma_deg: Option<f64>,
    /// One standard deviation stated for the height, as a ratio.
    pub height_sigma_ratio: f64,
    /// Whether the whole layer is searched.
    pub unknown_position: bool,
    /// The point of the ground that the flight's truth is.
    pub truth: TruthPoint,
    /// The parts of the method that are used.
    pub parts: Parts,
    /// Threads of each search. Frames are located one after another, so that times are meaningful.
    pub threads: usize,
}

/// The point of the ground that a flight's true columns are, and at which fixes are judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TruthPoint {
    /// The point straight below the camera.
    #[default]
    Nadir,
    /// The ground under the image's centre.
    Centre,
}

impl TruthPoint {
    /// The point of a fix that is judged, and its covariance.
    pub fn judged(self, fix: &Fix) -> (Geodetic, EnuCovariance) {
        match self {
            Self::Nadir => (fix.position, fix.covariance),
            Self::Centre => (fix.image_centre, fix.image_centre_covariance),
        }
    }
}

/// The result of one frame.
#[derive(Debug, Clone)]
pub struct FixOutcome {
    /// Name in `flight.csv`.
    pub image: String,
    /// The true point.
    pub truth: Geodetic,
    /// The centre of the searched square.
    pub prior: Geodetic,
    /// The answer.
    pub answer: Answer,
    /// Fix minus truth; `None` without a fix.
    pub error: Option<Enu>,
    /// The fix's own covariance of the point that is judged.
    pub covariance: Option<EnuCovariance>,
    /// Duration from the decoded frame in memory to the answer, milliseconds.
    pub elapsed_ms: f64,
    /// Duration from the file to the decoded frame, milliseconds.
    pub decode_ms: f64,
}

impl FixTrial {
    pub(super) fn check(&self) -> Result<(), TrialError> {
        let positive = |name, value: f64, expected| {
            if value.is_finite() && value > 0.0 { Ok(()) } else { Err(TrialError::Option { name, value, expected }) }
        };
        positive("prior_error_m", self.prior_error_m, "a positive number of metres")?;
        positive("height_sigma_ratio", self.height_sigma_ratio, "a positive ratio")?;
        positive("heading_sigma_deg", self.heading_sigma_deg.unwrap_or(1.0), "a positive number of degrees")
    }

    /// Locates every frame; calls `progress` with the result of each.
    ///
    /// # Errors
    /// If an option is out of range, a frame has no truth or cannot be decoded, or the store fails. "No fix" is an
    /// outcome.
    pub fn run(
        &self,
        store: &Reader,
        flight: &RecordedFlight,
        mut progress: impl FnMut(&FixOutcome),
    ) -> Result<Vec<FixOutcome>, TrialError> {
        self.check()?;
        let no_truth = |f: &&RecordedFrame| f.true_position.is_none();
        if let Some(frame) = flight.frames.iter().find(no_truth) {
            return Err(TrialError::NoTruth { path: flight.path.clone(), line: frame.line });
        }
        let mut outcomes = Vec::with_capacity(flight.frames.len());
        for (index, frame) in flight.frames.iter().enumerate() {
            let outcome = self.locate_frame(store, flight, index, frame)?;
            progress(&outcome);
            outcomes.push(outcome);
        }
        Ok(outcomes)
    }

    fn locate_frame(
        &self,
        store: &Reader,
        flight: &RecordedFlight,
        index: usize,
        frame: &RecordedFrame,
    ) -> Result<FixOutcome, TrialError> {
        let opened = Instant::now();
        let pixels = read_large_frame(&frame.path)?;
        let decode_ms = milliseconds(opened);
        Ok(FixOutcome { decode_ms, ..self.locate_pixels(store, flight, index, &pixels)? })
    }

    /// Locates pixels as those of one frame of a flight, which must have a truth.
    pub(super) fn locate_pixels(
        &self,
        store: &Reader,
        flight: &RecordedFlight,
        index: usize,
        ReducedFrame { gray: pixels, reduction }: &ReducedFrame,
    ) -> Result<FixOutcome, TrialError> {
        let frame = &flight.frames[index];
        let truth = frame.true_position.expect("checked by the caller");
        let prior = self.displaced(truth, index);
        let request = self.request(store, flight, frame, prior);
        let asked = Instant::now();
        let answer = locate_by_parts(store, pixels, &request, self.threads, self.parts)
            .map_err(|cause| TrialError::Locate { image: frame.image.clone(), cause })?
            .for_original(*reduction);
        let elapsed_ms = milliseconds(asked);
        let judged = match &answer {
            Answer::Fix(fix) => Some(self.truth.judged(fix)),
            Answer::NoFix(_) => None,
        };
        let error = judged.map(|(point, _)| LocalFrame::at(truth).enu_from_geodetic(point));
        let covariance = judged.map(|(_, covariance)| covariance);
        let image = frame.image.clone();
        Ok(FixOutcome { image, truth, prior, answer, error, covariance, elapsed_ms, decode_ms: 0.0 })
    }

    /// The prior of one frame. Each frame has its own random stream, so that neither order nor threads matter.
    pub(super) fn displaced(&self, truth: Geodetic, index: usize) -> Geodetic {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(index as u64);
        let mut axis = || rng.random_range(-self.prior_error_m..=self.prior_error_m);
        let error = Enu { east_m: axis(), north_m: axis() };
        LocalFrame::at(truth).geodetic_from_enu(error).unwrap_or(truth)
    }

    fn request(&self, store: &Reader, flight: &RecordedFlight, frame: &RecordedFrame, prior: Geodetic) -> FixRequest {
        let on_terrain = store.terrain().is_some() && self.parts.has(Part::Terrain);
        // A metre and a thousandth more, because north at the prior is not exactly north at the truth.
        let square = PositionPrior::Square { centre: prior, half_width_m: self.prior_error_m * 1.001 + 1.0 };
        FixRequest {
            layer: self.layer.clone(),
            position: if self.unknown_position { PositionPrior::WholeLayer } else { square },
            heading: self
                .heading_sigma_deg
                .map(|sigma| HeadingPrior { heading_rad: frame.heading_rad, sigma_rad: sigma.to_radians() }),
            view: if on_terrain { frame.view_over_terrain(&flight.camera) } else { frame.view(&flight.camera) },
            scale_sigma_ratio: self.height_sigma_ratio,
            time_s: Some(frame.time_s),
        }
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_micros() as f64 / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(seed: u64) -> FixTrial {
        FixTrial {
            layer: "ortho".into(),
            prior_error_m: 500.0,
            seed,
            heading_sigma_deg: Some(3.0),
            height_sigma_ratio: 0.03,
            unknown_position: false,
            truth: TruthPoint::Nadir,
            parts: Parts::ALL,
            threads: 1,
        }
    }

    #[test]
    fn displaces_the_prior_evenly_within_the_square_and_by_seed_alone() {
        let truth = Geodetic::from_degrees(60.0, 10.0).unwrap();
        let frame = LocalFrame::at(truth);
        let offsets: Vec<_> = (0..400).map(|i| frame.enu_from_geodetic(trial(3).displaced(truth, i))).collect();
        assert!(offsets.iter().all(|o| o.east_m.abs() <= 500.001 && o.north_m.abs() <= 500.001));
        // A uniform distribution over 1000 m has a deviation of 289 m; its mean over 400 lies within 3 * 14.4 m.
        let mean = offsets.iter().map(|o| o.east_m).sum::<f64>() / 400.0;
        let deviation = (offsets.iter().map(|o| (o.north_m).powi(2)).sum::<f64>() / 400.0).sqrt();
        assert!(mean.abs() < 43.0 && (deviation - 289.0).abs() < 25.0, "{mean} {deviation}");
        assert_eq!(trial(3).displaced(truth, 7), trial(3).displaced(truth, 7));
        assert_ne!(trial(3).displaced(truth, 7), trial(4).displaced(truth, 7));
    }
}
