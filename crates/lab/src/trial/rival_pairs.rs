//! Rival pairs: image pairs that more than one motion seems to explain.
//!
//! Ground that repeats itself, copies of an image where the camera has moved, and what stands still in the image. A motion is false
//! where it is off by more than [`RIGHT_PX`]; no motion is a good answer.

use super::error::TrialError;
use super::fly::Drawing;
use super::mirrored_pairs::poisson_bound;
use super::motions::{RIGHT_PX, thread_pool};
use super::negatives::{PatternKind, RepeatingPattern};
use overfly_core::pixels::Gray;
use overfly_core::registration::relative::{MotionAnswer, MotionPrior, register};
use overfly_flight::frame::read_frame;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use std::path::PathBuf;

/// The options of a trial.
#[derive(Debug, Clone)]
pub struct RivalPairTrial {
    /// Photos from which views are cut; at least one.
    pub photos: Vec<PathBuf>,
    /// Number of pairs, spread evenly over the kinds.
    pub trials: usize,
    /// Seed of the pairs.
    pub seed: u64,
}

/// A kind of rival pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RivalPairKind {
    /// A pattern over all the ground.
    Repeating,
    /// A pattern, mixed with a quarter or half of a photo.
    Mixed,
    /// A block of a pattern within a photo.
    Block,
    /// The very same image, although the camera has moved.
    Copy,
    /// Lines and letters that stand still over a photo that moves.
    Overlay,
    /// Dust that stands still over a photo that moves.
    Dust,
    /// A wing that stands still over a photo that moves.
    Wing,
}

impl RivalPairKind {
    /// All kinds.
    pub const ALL: [Self; 7] =
        [Self::Repeating, Self::Mixed, Self::Block, Self::Copy, Self::Overlay, Self::Dust, Self::Wing];

    /// The word in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Repeating => "repeating",
            Self::Mixed => "mixed",
            Self::Block => "block",
            Self::Copy => "copy",
            Self::Overlay => "overlay",
            Self::Dust => "dust",
            Self::Wing => "wing",
        }
    }
}

/// The score of one kind, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RivalPairScore {
    /// The kind.
    pub kind: &'static str,
    /// Number of pairs tried.
    pub pairs: usize,
    /// Registered pairs that are off by at most [`RIGHT_PX`].
    pub right: usize,
    /// Registered pairs that are off by more.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Upper bound on the probability of a false motion, with 95 % confidence.
    pub probability_below: f64,
    /// The false ones, as "trial 12: checkers, 43 px off".
    pub false_pairs: Vec<String>,
}

/// Edge of the frames, pixels.
const EDGE_PX: usize = 400;
/// Largest displacement of the second frame, share of the edge.
const MOST_SHIFT: f64 = 0.75;

impl RivalPairTrial {
    /// Tries all pairs, `threads` at the same time; calls `progress` after each.
    ///
    /// # Errors
    /// If a photo cannot be decoded, or none is given.
    pub fn run(&self, threads: usize, progress: impl Fn() + Sync) -> Result<Vec<RivalPairScore>, TrialError> {
        let photos = self.photos.iter().map(|p| read_frame(p)).collect::<Result<Vec<_>, _>>()?;
        if photos.is_empty() {
            return Err(TrialError::Option { name: "rivals", value: 0.0, expected: "at least one photo" });
        }
        let one = |trial: usize| {
            let pair = RivalPair::draw(RivalPairKind::ALL[trial % RivalPairKind::ALL.len()], self.seed, trial, &photos);
            let off_px = pair.off_px();
            progress();
            (trial, pair.kind, pair.name, off_px)
        };
        let outcomes: Vec<_> = thread_pool(threads)?.install(|| (0..self.trials).into_par_iter().map(one).collect());
        let score = |kind: RivalPairKind| {
            let these: Vec<_> = outcomes.iter().filter(|o| o.1 == kind).collect();
            let is_wrong = |off_px: &Option<f64>| off_px.is_some_and(|off_px| off_px > RIGHT_PX);
            let wrong: Vec<_> = these.iter().filter(|o| is_wrong(&o.3)).collect();
            RivalPairScore {
                kind: kind.word(),
                pairs: these.len(),
                right: these.iter().filter(|o| o.3.is_some_and(|off_px| off_px <= RIGHT_PX)).count(),
                wrong: wrong.len(),
                probability_below: poisson_bound(wrong.len()) / these.len().max(1) as f64,
                false_pairs: wrong
                    .iter()
                    .map(|(trial, _, name, off_px)| {
                        format!("trial {trial}: {name}, {:.0} px off", off_px.unwrap_or(0.0))
                    })
                    .collect(),
            }
        };
        Ok(RivalPairKind::ALL.map(score).into())
    }
}

/// A pair and its true motion.
struct RivalPair {
    kind: RivalPairKind,
    name: String,
    a: Gray,
    b: Gray,
    /// True displacement of b's centre from a's, pixels of a.
    truth_px: [f64; 2],
}

/// The ground of a pair: a photo, a pattern, or both.
struct Ground<'a> {
    photo: &'a Gray,
    /// Photo pixels per pixel of a frame, and the place of a's centre in the photo.
    zoom: f64,
    centre: [f64; 2],
    pattern: Option<RepeatingPattern>,
    /// Share of the photo where the pattern is.
    photo_share: f64,
    /// Half width of the block that has the pattern, pixels; infinite: everywhere.
    block_px: f64,
}

impl Ground<'_> {
    fn at(&self, x: f64, y: f64) -> f32 {
        let photo = self.photo.sample(self.centre[0] + self.zoom * x, self.centre[1] + self.zoom * y);
        match &self.pattern {
            Some(pattern) if x.abs().max(y.abs()) < self.block_px => {
                let drawn = 170.0 - 120.0 * pattern.ink_at([x, -y], 0) as f32;
                drawn + self.photo_share as f32 * (photo - drawn)
            }
            _ => photo,
        }
    }

    /// A square frame with noise; its centre, turn and scale in the ground.
    fn frame(&self, centre: [f64; 2], turn_rad: f64, scale: f64, rng: &mut ChaCha8Rng) -> Gray {
        let (sin, cos) = turn_rad.sin_cos();
        let (gain, noise) = (rng.random_range(0.9f32..1.1), rng.random_range(1.0f32..6.0));
        let half = EDGE_PX as f64 / 2.0;
        let mut value = |i: usize| {
            // The mean of four points: edges of patterns are sharper than a pixel.
            let points = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]].map(|[dx, dy]| {
                let (x, y) = ((i % EDGE_PX) as f64 + dx - half, (i / EDGE_PX) as f64 + dy - half);
                let (x, y) = (scale * (cos * x - sin * y), scale * (sin * x + cos * y));
                self.at(centre[0] + x, centre[1] + y)
            });
            let mean = points.iter().sum::<f32>() / 4.0;
            (gain * mean + rng.random_range(-noise..noise)).round().clamp(0.0, 255.0)
        };
        let values = (0..EDGE_PX * EDGE_PX).map(&mut value).collect();
        Gray::from_values(EDGE_PX, EDGE_PX, values).expect("a value a pixel")
    }
}

impl RivalPair {
    fn draw(kind: RivalPairKind, seed: u64, trial: usize, photos: &[Gray]) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(trial as u64);
        let rng = &mut rng;
        let photo = &photos[rng.random_range(0..photos.len())];
        let has_pattern = matches!(kind, RivalPairKind::Repeating | RivalPairKind::Mixed | RivalPairKind::Block);
        let pattern_kind = PatternKind::ALL[rng.random_range(0..PatternKind::ALL.len())];
        let period_px = 8.0 * 20f64.powf(rng.random_range(0.0..1.0));
        let pattern = has_pattern.then(|| RepeatingPattern::random(pattern_kind, period_px, rng));
        let size = [photo.width_px() as f64, photo.height_px() as f64];
        let ground = Ground {
            photo,
            zoom: rng.random_range(0.6..2.0f64).min(size[0].min(size[1]) / (3.0 * EDGE_PX as f64)),
            centre: size.map(|n| n * rng.random_range(0.4..0.6)),
            pattern,
            photo_share: if kind == RivalPairKind::Mixed { [0.25, 0.5][rng.random_range(0..2)] } else { 0.0 },
            block_px: if kind == RivalPairKind::Block { rng.random_range(120.0..600.0) } else { f64::INFINITY },
        };
        let (length, bearing) =
            (EDGE_PX as f64 * rng.random_range(0.08..MOST_SHIFT), rng.random_range(0.0..std::f64::consts::TAU));
        let truth_px = [length * bearing.cos(), length * bearing.sin()];
        let turn_rad = rng.random_range(-0.3..0.3);
        let a = ground.frame([0.0, 0.0], 0.0, 1.0, rng);
        let b = if kind == RivalPairKind::Copy {
            a.clone()
        } else {
            ground.frame(truth_px, turn_rad, rng.random_range(0.97..1.03), rng)
        };
        let drawing = match kind {
            RivalPairKind::Overlay => Some(Drawing::Overlay(rng.random())),
            RivalPairKind::Dust => Some(Drawing::Dust(rng.random())),
            RivalPairKind::Wing => Some(Drawing::Wing(rng.random())),
            _ => None,
        };
        let [a, b] = [a, b].map(|mut frame| {
            if let Some(drawing) = drawing {
                drawing.draw(&mut frame);
            }
            frame
        });
        let name =
            if has_pattern { format!("{} of {period_px:.0} px", pattern_kind.word()) } else { kind.word().into() };
        Self { kind, name, a, b, truth_px }
    }

    /// Distance of the answer from the true displacement; `None` without a motion.
    fn off_px(&self) -> Option<f64> {
        match register(&self.a, &self.b, &MotionPrior::default()) {
            MotionAnswer::Motion(m) => {
                let [x, y] = m.displacement_px;
                Some((x - self.truth_px[0]).hypot(y - self.truth_px[1]))
            }
            MotionAnswer::NoMotion { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photo() -> Gray {
        let value = |i: usize| {
            let (x, y) = ((i % 1300) as f64, (i / 1300) as f64);
            let wave = (0.061 * x + 0.033 * y).sin() + (0.027 * x - 0.083 * y).cos() + (0.11 * x + 0.2 * y).sin();
            (128.0 + 30.0 * wave + 9.0 * ((x * 0.37).sin() * (y * 0.41).cos())) as f32
        };
        Gray::from_values(1300, 1250, (0..1300 * 1250).map(value).collect()).unwrap()
    }

    #[test]
    fn equal_seeds_give_equal_pairs_and_no_false_motion() {
        let photos = [photo()];
        for (trial, kind) in RivalPairKind::ALL.into_iter().enumerate() {
            let [one, two] = [0, 1].map(|_| RivalPair::draw(kind, 3, trial, &photos));
            assert!(one.a == two.a && one.b == two.b, "{kind:?}");
            assert_eq!(one.a == one.b, kind == RivalPairKind::Copy);
            assert!(one.off_px().is_none_or(|off_px| off_px <= RIGHT_PX), "{kind:?}: {:?}", one.off_px());
        }
    }
}
