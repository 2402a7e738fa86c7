//! `RepeatingTrials`: draws worlds one by one, and searches for frames in each.

use super::look::PatternLook;
use super::real_map::RealMap;
use super::repeated_frame::{SceneFromBody, TruePose, repeated_frame};
use super::scene::{PatternBlock, SceneEpoch};
use super::scene_plan::{ScenePlan, Seat};
use super::world::{RepeatingWorld, WORLD_LAYER};
use crate::trial::error::TrialError;
use crate::trial::negatives::altered::ShownFrame;
use crate::trial::negatives::kind::NegativeKind;
use crate::trial::negatives::outcome::{DrawnPattern, NegativeOutcome, TruePlace};
use crate::trial::negatives::search::StatedPrior;
use crate::trial::negatives::trial::NegativeTrial;
use crate::trial::recorded_flight::{RecordedFlight, RecordedFrame};
use overfly_core::camera::{Camera, CameraError, Height, View};
use overfly_core::geodesy::{Geodetic, LocalFrame};
use overfly_core::pixels::Gray;
use overfly_flight::frame::read_frame;
use overfly_flight::locate::attitude_reach_m;
use overfly_store::Reader;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Trials over one world.
pub const TRIALS_PER_WORLD: usize = 10;
/// Longer side of a frame in which a pattern is drawn, pixels.
const FRAME_EDGE_PX: usize = 1024;
/// Shortest period, ground pixels of the map's source.
const LEAST_PERIOD_PX: f64 = 4.0;
/// Share of worlds whose frames show dark elements as light ones.
const INVERTED_SHARE: f64 = 0.15;
/// Heights of a flight that differ by at most this ratio are readings of one height.
const LEVEL_RATIO: f64 = 0.05;

/// One trial over a world.
#[derive(Debug, Clone)]
pub struct WorldTrial {
    /// Number of the trial.
    pub number: usize,
    /// Area to search, in usual squares.
    pub region: f64,
    /// The trial's random stream.
    pub rng: ChaCha8Rng,
}

/// Everything that trials over drawn worlds have in common.
pub struct RepeatingTrials<'a> {
    trial: &'a NegativeTrial,
    store: &'a Reader,
    flight: &'a RecordedFlight,
    /// Ground sample distance of the coarsest source, metres.
    source_gsd_m: f64,
    /// Median of the stated heights, if all frames were taken at one height.
    level_height_m: Option<f64>,
}

/// A world, and what its trials need.
struct DrawnWorld {
    world: RepeatingWorld,
    kind: NegativeKind,
    seats: Vec<Seat>,
    /// Whether elements are darker than the ground in the frames.
    is_dark: bool,
    frames: HashMap<usize, Gray>,
}

impl<'a> RepeatingTrials<'a> {
    /// Prepares trials over the layer of a trial.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn new(trial: &'a NegativeTrial, store: &'a Reader, flight: &'a RecordedFlight) -> Result<Self, TrialError> {
        let sources = store.sources(store.layer(&trial.layer)?)?;
        let source_gsd_m = sources.iter().map(|s| s.gsd_m_per_px).fold(0.0, f64::max);
        Ok(Self { trial, store, flight, source_gsd_m, level_height_m: level_height_m(flight) })
    }

    /// Draws a world and makes its trials.
    ///
    /// # Errors
    /// If the world cannot be drawn, a frame cannot be decoded, or a store fails.
    pub fn try_world(
        &self,
        kind: NegativeKind,
        world: usize,
        trials: &[WorldTrial],
        progress: &(impl Fn(&NegativeOutcome) + Sync),
    ) -> Result<Vec<NegativeOutcome>, TrialError> {
        let mut drawn = self.world(kind, world)?;
        let one = |trial: &WorldTrial| {
            let outcome = self.try_one(&mut drawn, trial)?;
            progress(&outcome);
            Ok(outcome)
        };
        trials.iter().map(one).collect()
    }

    fn world(&self, kind: NegativeKind, world: usize) -> Result<DrawnWorld, TrialError> {
        // The upper half of the streams; the lower half are the trials'.
        let mut rng = ChaCha8Rng::seed_from_u64(self.trial.seed);
        rng.set_stream(1 << 63 | (kind as u64) << 48 | world as u64);
        let frames = &self.flight.frames;
        let anchor = truth(&frames[rng.random_range(0..frames.len())]);
        let off = || TrialError::OffTheMap { path: self.flight.path.clone() };
        let map = RealMap::read(self.store, self.store.layer(&self.trial.layer)?, anchor)?.ok_or_else(off)?;
        let frame = map.frame().map_err(|_| off())?;
        let seats = self.seats(&map, &frame)?;
        if seats.is_empty() {
            return Err(off());
        }
        let plan = {
            let smallest = self.trial.regions.iter().copied().fold(f64::INFINITY, f64::min);
            let half_region_m = self.trial.half_width_m(smallest);
            ScenePlan::random(kind, &seats, LEAST_PERIOD_PX * self.source_gsd_m, half_region_m, &mut rng)
        };
        let is_dark_on_map = rng.random_bool(0.5);
        let period_m = plan.scene.blocks[0].pattern.period_m[0];
        let look = PatternLook::random(is_dark_on_map, period_m, &mut rng);
        let world = RepeatingWorld::build(&map, plan.scene, &look, self.source_gsd_m)?;
        let is_dark = is_dark_on_map != rng.random_bool(INVERTED_SHARE);
        Ok(DrawnWorld { world, kind, seats: plan.seats, is_dark, frames: HashMap::new() })
    }

    /// The ground of all frames whose nadir has imagery.
    fn seats(&self, map: &RealMap, frame: &LocalFrame) -> Result<Vec<Seat>, TrialError> {
        let mut seats = Vec::new();
        for (index, recorded) in self.flight.frames.iter().enumerate().filter(|(_, f)| map.holds(truth(f))) {
            let camera =
                Camera::new(&self.pose(recorded).view, self.flight.camera.width_px, self.flight.camera.height_px)
                    .map_err(|e| unusable(recorded, e))?;
            let Some(corners) = camera.footprint_in_body() else { continue };
            let twice_area_m2: f64 = (0..4)
                .map(|i| (corners[i], corners[(i + 1) % 4]))
                .map(|(a, b)| a.right_m * b.ahead_m - b.right_m * a.ahead_m)
                .sum();
            let nadir = frame.enu_from_geodetic(truth(recorded));
            seats.push(Seat {
                frame: index,
                nadir_m: [nadir.east_m, nadir.north_m],
                reach_m: corners.iter().map(|c| c.length_m()).fold(0.0, f64::max),
                edge_m: (0.5 * twice_area_m2.abs()).sqrt(),
            });
        }
        Ok(seats)
    }

    fn try_one(&self, drawn: &mut DrawnWorld, trial: &WorldTrial) -> Result<NegativeOutcome, TrialError> {
        let mut rng = trial.rng.clone();
        let kind = drawn.kind;
        let seat = drawn.seats[rng.random_range(0..drawn.seats.len())];
        let frame = &self.flight.frames[seat.frame];
        let is_heading_known = !rng.random_bool(self.trial.unknown_heading_share);
        let half_width_m = self.trial.half_width_m(trial.region);
        let ground = &drawn.world.ground;
        let is_apart = kind == NegativeKind::RepeatingAbsent && rng.random_bool(0.5);
        // Where the map has no room apart from the frame, the frame's ground is missing from the map nevertheless.
        let apart = if is_apart {
            let apart_m = half_width_m + seat.reach_m + self.attitude_reach_m(frame)?;
            ground.elsewhere(truth(frame), apart_m, &mut rng)
        } else {
            None
        };
        let centre = apart.unwrap_or_else(|| ground.displaced(truth(frame), half_width_m, &mut rng));
        let shared_m2 = ground.shared_m2(centre, half_width_m);
        let stated = StatedPrior { centre, half_width_m, is_heading_known };
        let (shown, pattern) = self.shown(drawn, &seat, &mut rng)?;
        let search = self.trial.search(&drawn.world.store, WORLD_LAYER, frame, &shown, &stated, shared_m2)?;
        let place = TruePlace { truth: truth(frame), right_m: self.trial.right_m };
        Ok(NegativeOutcome {
            number: trial.number,
            kind,
            region: trial.region,
            image: frame.image.clone(),
            is_heading_known,
            place: (kind != NegativeKind::RepeatingAbsent).then_some(place),
            pattern: Some(pattern),
            search: Some(search),
        })
    }

    /// How far a search for a frame reaches beyond its prior, metres.
    fn attitude_reach_m(&self, frame: &RecordedFrame) -> Result<f64, TrialError> {
        let view = frame.view(&self.flight.camera);
        let [width, height] = [self.flight.camera.width_px, self.flight.camera.height_px];
        let camera = Camera::new(&view, width, height).map_err(|e| unusable(frame, e))?;
        Ok(attitude_reach_m(&view, &camera))
    }

    /// The frame with the world's patterns in another epoch, and the pattern below it.
    fn shown(
        &self,
        drawn: &mut DrawnWorld,
        seat: &Seat,
        rng: &mut ChaCha8Rng,
    ) -> Result<(ShownFrame, DrawnPattern), TrialError> {
        let frame = &self.flight.frames[seat.frame];
        if let Entry::Vacant(entry) = drawn.frames.entry(seat.frame) {
            entry.insert(reduced(&read_frame(&frame.path)?));
        }
        let gray = &drawn.frames[&seat.frame];
        let scene = &drawn.world.scene;
        let epoch = SceneEpoch::Frame(rng.random_range(1..u32::MAX));
        let nearest =
            |a: &&PatternBlock, b: &&PatternBlock| a.depth_m(seat.nadir_m).total_cmp(&b.depth_m(seat.nadir_m));
        let pattern = &scene.blocks.iter().max_by(nearest).expect("a scene has a block").pattern;
        let [p, q] = pattern.period_m;
        let look = PatternLook::random(drawn.is_dark, p, rng);
        let pose = self.pose(frame);
        let camera =
            Camera::new(&pose.view, gray.width_px() as u32, gray.height_px() as u32).map_err(|e| unusable(frame, e))?;
        let scene_from_body = SceneFromBody::new(&pose, &drawn.world.frame);
        let gray = repeated_frame(gray, &camera, &scene_from_body, scene, &look, epoch);
        let pattern = DrawnPattern { kind: pattern.kind, period_m: p.min(q) };
        Ok((ShownFrame { gray, view: frame.view(&self.flight.camera) }, pattern))
    }

    /// The true pose of a frame. A flight does not record the true height: the median of the readings stands for it, or the
    /// frame's own reading where the height changes during the flight.
    fn pose(&self, frame: &RecordedFrame) -> TruePose {
        let view = View::Posed {
            intrinsics: self.flight.camera.clone(),
            height: Height::AboveGround(self.level_height_m.unwrap_or(frame.height_agl_m)),
            attitude: frame.attitude,
        };
        let heading_rad = frame.true_heading_rad.unwrap_or(frame.heading_rad);
        TruePose { nadir: truth(frame), heading_rad, view }
    }
}

/// The true nadir.
fn truth(frame: &RecordedFrame) -> Geodetic {
    frame.true_position.expect("checked before the trials")
}

/// Median of the stated heights; `None` if one differs from it by more than a twentieth.
fn level_height_m(flight: &RecordedFlight) -> Option<f64> {
    let mut heights: Vec<f64> = flight.frames.iter().map(|f| f.height_agl_m).collect();
    heights.sort_by(f64::total_cmp);
    let median = heights[heights.len() / 2];
    heights.iter().all(|h| (h / median - 1.0).abs() <= LEVEL_RATIO).then_some(median)
}

/// A frame of at most [`FRAME_EDGE_PX`].
fn reduced(gray: &Gray) -> Gray {
    let (width, height) = (gray.width_px(), gray.height_px());
    let shrink = width.max(height) as f64 / FRAME_EDGE_PX as f64;
    if shrink <= 1.0 {
        return gray.clone();
    }
    let side = |n: usize| (n as f64 / shrink).round().max(1.0) as usize;
    gray.shrunk(side(width), side(height))
}

fn unusable(frame: &RecordedFrame, cause: CameraError) -> TrialError {
    TrialError::Locate { image: frame.image.clone(), cause: cause.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::{Attitude, Intrinsics};
    use std::path::PathBuf;

    fn flight(heights_m: &[f64]) -> RecordedFlight {
        let frame = |(i, &height_agl_m): (usize, &f64)| RecordedFrame {
            line: i as u64 + 2,
            image: format!("{i}.png"),
            path: PathBuf::new(),
            time_s: i as f64,
            true_position: None,
            true_heading_rad: None,
            height_agl_m,
            height_msl_m: None,
            camera: None,
            heading_rad: 0.0,
            attitude: Attitude::exact(0.0, 0.0),
        };
        let frames = heights_m.iter().enumerate().map(frame).collect();
        RecordedFlight { path: PathBuf::new(), camera: Intrinsics::centred(8, 6, 10.0), frames }
    }

    #[test]
    fn readings_of_one_height_are_averaged_and_others_are_not() {
        assert_eq!(level_height_m(&flight(&[99.0, 101.5, 100.0])), Some(100.0));
        assert_eq!(level_height_m(&flight(&[90.0, 101.5, 100.0])), None);
    }
}
