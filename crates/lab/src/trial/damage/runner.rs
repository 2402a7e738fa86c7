//! Runs the trials of damaged frames.

use super::change::FileChange;
use super::format::FrameFormat;
use super::outcome::{DamageOutcome, DamageResult};
use super::trial::DamageTrial;
use crate::trial::error::TrialError;
use crate::trial::recorded_flight::{RecordedFlight, RecordedFrame};
use overfly_core::pixels::{Colour, Gray};
use overfly_flight::frame::{FrameError, ReducedFrame, decode_frame, read_colour_frame};
use overfly_store::Reader;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Levels by which a pixel counts as changed.
const CHANGED_LEVELS: f32 = 8.0;

impl DamageTrial {
    /// Makes all trials; calls `progress` after each. The same seed gives the same trials with any number of threads.
    ///
    /// # Errors
    /// [`TrialError`] if a frame has no truth, cannot be read or written, or the store fails. A damaged frame that is refused is an
    /// outcome.
    pub fn run(
        &self,
        store: &Reader,
        flight: &RecordedFlight,
        progress: impl Fn(&DamageOutcome) + Sync,
    ) -> Result<Vec<DamageOutcome>, TrialError> {
        self.fixes.check()?;
        if let Some(frame) = flight.frames.iter().find(|f| f.true_position.is_none()) {
            return Err(TrialError::NoTruth { path: flight.path.clone(), line: frame.line });
        }
        let threads = self.threads;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|_| {
            let expected = "a number of threads that this machine can start";
            TrialError::Option { name: "threads", value: threads as f64, expected }
        })?;
        let frames: Vec<(usize, &RecordedFrame)> = flight.frames.iter().enumerate().collect();
        let one = |&(index, frame): &(usize, &RecordedFrame)| {
            let sound = SoundFrame::read(frame)?;
            let mut outcomes = Vec::new();
            for &format in &self.formats {
                outcomes.extend(self.of_frame(store, flight, index, &sound, format, &progress)?);
            }
            Ok(outcomes)
        };
        let done: Result<Vec<Vec<DamageOutcome>>, TrialError> = pool.install(|| frames.par_iter().map(one).collect());
        let mut outcomes: Vec<DamageOutcome> = done?.into_iter().flatten().collect();
        outcomes.sort_by_key(|o| (o.format, o.number));
        Ok(outcomes)
    }

    /// Makes the trials of one frame in one format; frames take turns.
    fn of_frame(
        &self,
        store: &Reader,
        flight: &RecordedFlight,
        index: usize,
        sound: &SoundFrame,
        format: FrameFormat,
        progress: &(impl Fn(&DamageOutcome) + Sync),
    ) -> Result<Vec<DamageOutcome>, TrialError> {
        let changes: Vec<FileChange> = self.changes.iter().copied().filter(|&c| format.takes(c)).collect();
        if changes.is_empty() || index >= self.trials {
            return Ok(Vec::new());
        }
        let file = format.encoded(&sound.colour, &sound.own)?;
        let before = decode_frame(&file, &sound.frame.image)?;
        let one = |number: usize| {
            let change = changes[number / flight.frames.len() % changes.len()];
            let mut rng = self.rng(format, number);
            let decoded = decode_frame(&change.applied(&file, &mut rng), &sound.frame.image);
            let (result, changed_share) = self.result(store, flight, index, &before, decoded)?;
            let image = sound.frame.image.clone();
            let outcome = DamageOutcome { number, format, change, image, result, changed_share };
            progress(&outcome);
            Ok(outcome)
        };
        (index..self.trials).step_by(flight.frames.len()).map(one).collect()
    }

    /// The random stream of a trial. Each has its own, so that neither order nor threads matter.
    fn rng(&self, format: FrameFormat, number: usize) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.fixes.seed);
        rng.set_stream((format as u64) << 32 | number as u64);
        // Numbers that the displacement of the prior does not use.
        let _ = rng.random::<u64>();
        rng
    }

    fn result(
        &self,
        store: &Reader,
        flight: &RecordedFlight,
        index: usize,
        before: &Gray,
        decoded: Result<Gray, FrameError>,
    ) -> Result<(DamageResult, f64), TrialError> {
        let after = match decoded {
            Ok(after) => after,
            Err(refused) => return Ok((DamageResult::Refused(refused.code()), 0.0)),
        };
        if after == *before {
            return Ok((DamageResult::Unchanged, 0.0));
        }
        let changed_share = changed_share(before, &after);
        let after = ReducedFrame { gray: after, reduction: 1 };
        let located = self.fixes.locate_pixels(store, flight, index, &after)?;
        let result = match (located.error, located.covariance) {
            (Some(error), Some(covariance)) => DamageResult::Fix {
                error_m: error.length_m(),
                squared_mahalanobis: covariance.squared_mahalanobis(error),
            },
            _ => DamageResult::NoFix,
        };
        Ok((result, changed_share))
    }
}

/// Share of the pixels that differ; all, where the sizes do.
fn changed_share(before: &Gray, after: &Gray) -> f64 {
    if (before.width_px(), before.height_px()) != (after.width_px(), after.height_px()) {
        return 1.0;
    }
    let changed = before.values().iter().zip(after.values()).filter(|(a, b)| (*a - *b).abs() > CHANGED_LEVELS).count();
    changed as f64 / before.values().len().max(1) as f64
}

/// A frame before it is changed.
struct SoundFrame<'a> {
    frame: &'a RecordedFrame,
    own: Vec<u8>,
    colour: Colour,
}

impl<'a> SoundFrame<'a> {
    fn read(frame: &'a RecordedFrame) -> Result<Self, TrialError> {
        let colour = read_colour_frame(&frame.path)?;
        let own =
            std::fs::read(&frame.path).map_err(|cause| FrameError::Unreadable { path: frame.path.clone(), cause })?;
        Ok(Self { frame, own, colour })
    }
}
