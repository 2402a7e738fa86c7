//! `NegativeRunner`: runs the trials, each from a random stream of its own.

use super::altered::{self, ShownFrame};
use super::drawn;
use super::kind::NegativeKind;
use super::outcome::NegativeOutcome;
use super::repeating::{RepeatingTrials, TRIALS_PER_WORLD, WorldTrial};
use super::search::StatedPrior;
use super::trial::NegativeTrial;
use crate::trial::error::TrialError;
use crate::trial::mapped_ground::MappedGround;
use crate::trial::recorded_flight::{RecordedFlight, RecordedFrame};
use overfly_core::camera::{Camera, CameraError};
use overfly_core::geodesy::Geodetic;
use overfly_core::pixels::Gray;
use overfly_flight::frame::read_frame;
use overfly_flight::locate::attitude_reach_m;
use overfly_store::Reader;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Trials of one frame that a thread makes in a row.
const CHUNK: usize = 32;
/// Longer side of drawn frames, pixels; larger frames show nothing more.
const DRAWN_EDGE_PX: usize = 512;

impl NegativeTrial {
    /// Makes all trials; calls `progress` after each. Without a `foreign` flight that kind is left out.
    ///
    /// # Errors
    /// If an option is out of range, a frame has no truth or cannot be decoded, or the store fails. "No fix" is an
    /// outcome, and the right one.
    pub fn run(
        &self,
        store: &Reader,
        flight: &RecordedFlight,
        foreign: Option<&RecordedFlight>,
        progress: impl Fn(&NegativeOutcome) + Sync,
    ) -> Result<Vec<NegativeOutcome>, TrialError> {
        self.check()?;
        if let Some(frame) = flight.frames.iter().find(|f| f.true_position.is_none()) {
            return Err(TrialError::NoTruth { path: flight.path.clone(), line: frame.line });
        }
        let runner = NegativeRunner::new(self, store, flight, foreign)?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build().map_err(|_| {
            let expected = "a number of threads that this machine can start";
            TrialError::Option { name: "threads", value: self.threads as f64, expected }
        })?;
        let jobs: Vec<Job> = runner.worlds().into_iter().chain(runner.chunks()).collect();
        let done: Result<Vec<Vec<NegativeOutcome>>, TrialError> =
            pool.install(|| jobs.par_iter().with_max_len(1).map(|job| runner.run(job, &progress)).collect());
        let mut outcomes: Vec<NegativeOutcome> = done?.into_iter().flatten().collect();
        outcomes.sort_by_key(|o| o.number);
        Ok(outcomes)
    }
}

/// Trials that a thread makes in a row.
enum Job {
    /// Trials of one frame.
    Chunk { frame: usize, numbers: Vec<usize> },
    /// Trials over one drawn world.
    World { kind: NegativeKind, world: usize, trials: Vec<WorldTrial> },
}

/// Everything that the trials have in common.
struct NegativeRunner<'a> {
    trial: &'a NegativeTrial,
    store: &'a Reader,
    ground: MappedGround,
    flight: &'a RecordedFlight,
    foreign: Option<&'a RecordedFlight>,
    kinds: Vec<NegativeKind>,
    repeating: RepeatingTrials<'a>,
}

impl<'a> NegativeRunner<'a> {
    /// Prepares a trial. Without a `foreign` flight that kind is left out.
    fn new(
        trial: &'a NegativeTrial,
        store: &'a Reader,
        flight: &'a RecordedFlight,
        foreign: Option<&'a RecordedFlight>,
    ) -> Result<Self, TrialError> {
        let ground = store.layer(&trial.layer).and_then(|layer| MappedGround::read(store, layer));
        let image = || flight.frames[0].image.clone();
        let ground = ground.map_err(|e| TrialError::Locate { image: image(), cause: e.into() })?;
        let kinds = trial.kinds.iter().copied().filter(|k| *k != NegativeKind::Foreign || foreign.is_some()).collect();
        let repeating = RepeatingTrials::new(trial, store, flight)?;
        Ok(Self { trial, store, ground, flight, foreign, kinds, repeating })
    }

    /// The random stream of a trial. Each has its own, so that neither order nor threads matter.
    fn rng(&self, number: usize) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.trial.seed);
        rng.set_stream(number as u64);
        rng
    }

    /// Kind and region of a trial. They take turns; frames are random.
    fn cell(&self, number: usize) -> (NegativeKind, f64) {
        let (kinds, regions) = (&self.kinds, &self.trial.regions);
        (kinds[number % kinds.len()], regions[number / kinds.len() % regions.len()])
    }

    /// The trials without drawn worlds, in chunks that share a frame, so that a frame is decoded once for many trials.
    fn chunks(&self) -> Vec<Job> {
        let frames = self.flight.frames.len();
        let mut by_frame = vec![Vec::new(); frames];
        for number in self.numbers().filter(|&n| !self.cell(n).0.is_repeating()) {
            by_frame[self.rng(number).random_range(0..frames)].push(number);
        }
        let pieces = |(frame, numbers): (usize, Vec<usize>)| {
            numbers.chunks(CHUNK).map(|piece| Job::Chunk { frame, numbers: piece.to_vec() }).collect::<Vec<_>>()
        };
        by_frame.into_iter().enumerate().flat_map(pieces).collect()
    }

    /// The trials over drawn worlds, world by world.
    fn worlds(&self) -> Vec<Job> {
        let mut worlds = BTreeMap::<(usize, NegativeKind), Vec<WorldTrial>>::new();
        for number in self.numbers() {
            let (kind, region) = self.cell(number);
            if kind.is_repeating() {
                let world = number / self.kinds.len() / TRIALS_PER_WORLD;
                worlds.entry((world, kind)).or_default().push(WorldTrial { number, region, rng: self.rng(number) });
            }
        }
        worlds.into_iter().map(|((world, kind), trials)| Job::World { kind, world, trials }).collect()
    }

    /// Numbers of all trials; none without kinds.
    fn numbers(&self) -> std::ops::Range<usize> {
        0..if self.kinds.is_empty() { 0 } else { self.trial.trials }
    }

    fn run(
        &self,
        job: &Job,
        progress: &(impl Fn(&NegativeOutcome) + Sync),
    ) -> Result<Vec<NegativeOutcome>, TrialError> {
        match job {
            Job::Chunk { frame, numbers } => self.try_all(*frame, numbers, progress),
            Job::World { kind, world, trials } => self.repeating.try_world(*kind, *world, trials, progress),
        }
    }

    /// Makes some trials of one frame.
    fn try_all(
        &self,
        frame: usize,
        numbers: &[usize],
        progress: &(impl Fn(&NegativeOutcome) + Sync),
    ) -> Result<Vec<NegativeOutcome>, TrialError> {
        let frame = &self.flight.frames[frame];
        let gray = read_frame(&frame.path)?;
        let one = |&number: &usize| {
            let outcome = self.try_one(frame, &gray, number)?;
            progress(&outcome);
            Ok(outcome)
        };
        numbers.iter().map(one).collect()
    }

    fn try_one(&self, frame: &RecordedFrame, gray: &Gray, number: usize) -> Result<NegativeOutcome, TrialError> {
        let mut rng = self.rng(number);
        // `chunks` has drawn this number to choose the frame.
        let _ = rng.random_range(0..self.flight.frames.len());
        let (kind, region) = self.cell(number);
        let is_heading_known = kind == NegativeKind::Turned || !rng.random_bool(self.trial.unknown_heading_share);
        let half_width_m = self.trial.half_width_m(region);
        let search = match self.prior(frame, gray, kind, half_width_m, &mut rng)? {
            Some((prior, shared_m2)) => {
                let shown = self.shown(frame, gray, kind, &mut rng)?;
                let stated = StatedPrior { centre: prior, half_width_m, is_heading_known };
                Some(self.trial.search(self.store, &self.trial.layer, frame, &shown, &stated, shared_m2)?)
            }
            None => None,
        };
        Ok(NegativeOutcome {
            number,
            kind,
            region,
            image: frame.image.clone(),
            is_heading_known,
            place: None,
            pattern: None,
            search,
        })
    }

    /// Centre of the square to search, and the area of imagery in it, m^2.
    fn prior(
        &self,
        frame: &RecordedFrame,
        gray: &Gray,
        kind: NegativeKind,
        half_width_m: f64,
        rng: &mut ChaCha8Rng,
    ) -> Result<Option<(Geodetic, f64)>, TrialError> {
        let truth = frame.true_position.expect("checked by the caller");
        let prior = match kind {
            NegativeKind::Elsewhere => self.ground.elsewhere(truth, half_width_m + self.reach_m(frame, gray)?, rng),
            _ if kind.is_without_place() => self.ground.anywhere(rng),
            _ => Some(self.ground.displaced(truth, half_width_m, rng)),
        };
        Ok(prior.map(|p| (p, self.ground.shared_m2(p, half_width_m))))
    }

    /// Greatest distance from the nadir of ground that the frame shows, and how far the search reaches beyond its prior, metres.
    fn reach_m(&self, frame: &RecordedFrame, gray: &Gray) -> Result<f64, TrialError> {
        let view = frame.view(&self.flight.camera);
        let camera =
            Camera::new(&view, gray.width_px() as u32, gray.height_px() as u32).map_err(|e| unusable(frame, e))?;
        let corners = camera.footprint_in_body().unwrap_or_default();
        Ok(corners.iter().map(|corner| corner.length_m()).fold(0.0, f64::max) + attitude_reach_m(&view, &camera))
    }

    /// The altered or drawn frame.
    fn shown(
        &self,
        frame: &RecordedFrame,
        gray: &Gray,
        kind: NegativeKind,
        rng: &mut ChaCha8Rng,
    ) -> Result<ShownFrame, TrialError> {
        let view = frame.view(&self.flight.camera);
        let (width, height) = (gray.width_px(), gray.height_px());
        let shrink = (width.max(height) as f64 / DRAWN_EDGE_PX as f64).max(1.0);
        let side = |n: usize| (n as f64 / shrink).round().max(1.0) as usize;
        let drawn = match kind {
            NegativeKind::Elsewhere => gray.clone(),
            NegativeKind::Mirrored => return Ok(altered::mirrored(gray, &view)),
            NegativeKind::Turned => {
                let turned = altered::turned(gray, &view, rng.random_range(1..4));
                return turned.map_err(|e| unusable(frame, e));
            }
            NegativeKind::Scaled => altered::magnified(gray, rng.random_range(1.3..1.6)),
            NegativeKind::Noise => drawn::noise(side(width), side(height), rng),
            NegativeKind::Water => drawn::water(side(width), side(height), rng),
            NegativeKind::Blank => drawn::blank(side(width), side(height), rng),
            NegativeKind::Fields => drawn::fields(side(width), side(height), -frame.heading_rad, rng),
            NegativeKind::Foreign => {
                let frames = &self.foreign.expect("left out without such a flight").frames;
                let other = read_frame(&frames[rng.random_range(0..frames.len())].path)?;
                altered::fitted(&other, side(width), side(height))
            }
            _ => unreachable!("drawn with its world"),
        };
        Ok(ShownFrame { gray: drawn, view })
    }
}

fn unusable(frame: &RecordedFrame, cause: CameraError) -> TrialError {
    TrialError::Locate { image: frame.image.clone(), cause: cause.into() }
}
