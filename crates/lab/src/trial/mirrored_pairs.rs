//! Mirrored pairs: image pairs that relative registration must reject.
//!
//! The second view of every pair is mirrored. No camera sees mirrored ground, so every accepted motion is false, even
//! between overlapping photos or views of the same spot.

use super::error::TrialError;
use overfly_core::pixels::Gray;
use overfly_core::registration::relative::{MotionAnswer, MotionPrior, register};
use overfly_flight::frame::read_frame;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The options of a trial.
#[derive(Debug, Clone)]
pub struct MirroredPairTrial {
    /// Photos from which views are cut; at least one.
    pub photos: Vec<PathBuf>,
    /// Number of pairs.
    pub trials: usize,
    /// Seed of the views.
    pub seed: u64,
}

/// The summary of a trial, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MirroredPairScore {
    /// Number of pairs tried.
    pub trials: usize,
    /// Accepted pairs. Every one is false.
    #[serde(rename = "false")]
    pub accepted: usize,
    /// Upper bound on the probability of a false motion, with 95 % confidence (3 / trials if none was accepted).
    pub probability_below: f64,
    /// The accepted pairs, as "photo and photo".
    pub accepted_pairs: Vec<String>,
}

/// Edge of a view, pixels; smaller in a small photo.
const EDGE_PX: usize = 512;
/// Greatest number of photo pixels per pixel of a view.
const MOST_SHRINKING: f64 = 2.0;

impl MirroredPairTrial {
    /// Tries all pairs; calls `progress` after each.
    ///
    /// # Errors
    /// If a photo cannot be decoded, or none is given.
    pub fn run(&self, mut progress: impl FnMut()) -> Result<MirroredPairScore, TrialError> {
        let photos = self.photos.iter().map(|p| read_frame(p)).collect::<Result<Vec<_>, _>>()?;
        if photos.is_empty() || self.trials == 0 {
            let value = self.trials.min(photos.len()) as f64;
            return Err(TrialError::Option { name: "trials", value, expected: "at least one photo and one trial" });
        }
        let mut accepted_pairs = Vec::new();
        for trial in 0..self.trials {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(trial as u64);
            let [i, j] = [0, 1].map(|_| rng.random_range(0..photos.len()));
            let (a, b) = (view(&photos[i], &mut rng), mirrored(&view(&photos[j], &mut rng)));
            if let MotionAnswer::Motion(_) = register(&a, &b, &MotionPrior::default()) {
                let name = |i: usize| name(&self.photos[i]);
                accepted_pairs.push(format!("trial {trial}: {} and {}", name(i), name(j)));
            }
            progress();
        }
        Ok(MirroredPairScore {
            trials: self.trials,
            accepted: accepted_pairs.len(),
            probability_below: poisson_bound(accepted_pairs.len()) / self.trials as f64,
            accepted_pairs,
        })
    }
}

/// Cuts a square from the photo, turned by any angle and shrunk by up to two.
fn view(photo: &Gray, rng: &mut ChaCha8Rng) -> Gray {
    let (width, height) = (photo.width_px() as f64, photo.height_px() as f64);
    let shrinking = rng.random_range(1.0..MOST_SHRINKING);
    let half_diagonal = |edge: f64, step: f64| edge * step * std::f64::consts::SQRT_2 / 2.0;
    let room = width.min(height) / 2.0;
    let edge_px = (EDGE_PX as f64).min(room / half_diagonal(1.0, shrinking)).max(1.0).floor();
    let reach = half_diagonal(edge_px, shrinking);
    let mut middle = |n: f64| if n > 2.0 * reach { rng.random_range(reach..=n - reach) } else { n / 2.0 };
    let [x, y] = [middle(width), middle(height)];
    let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let edge = edge_px as usize;
    let value = |i: usize| {
        let (dx, dy) = ((i % edge) as f64 + 0.5 - edge_px / 2.0, (i / edge) as f64 + 0.5 - edge_px / 2.0);
        let (dx, dy) = (dx * shrinking, dy * shrinking);
        photo.sample(x + cos * dx - sin * dy, y + sin * dx + cos * dy)
    };
    Gray::from_values(edge, edge, (0..edge * edge).map(value).collect()).expect("one value for each pixel")
}

fn mirrored(gray: &Gray) -> Gray {
    let mut out = gray.clone();
    out.values_mut().chunks_exact_mut(gray.width_px()).for_each(<[f32]>::reverse);
    out
}

fn name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// The mean of the Poisson distribution under which `seen` or fewer events have a probability of 5 % (3.0 for none).
pub fn poisson_bound(seen: usize) -> f64 {
    let at_most = |mean: f64| {
        let mut term = (-mean).exp();
        let mut sum = term;
        for k in 1..=seen {
            term *= mean / k as f64;
            sum += term;
        }
        sum
    };
    let (mut low, mut high) = (0.0, 10.0 + 3.0 * seen as f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_most(middle) > 0.05 { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_poissons() {
        // -ln 0.05 = 2.9957; for one seen, 4.7439 (any table of Poisson limits).
        assert!((poisson_bound(0) - 2.9957).abs() < 1e-3 && (poisson_bound(1) - 4.7439).abs() < 1e-3);
    }

    #[test]
    fn the_same_seed_cuts_the_same_views_also_of_small_photos() {
        let photo = Gray::from_values(90, 70, (0..6300).map(|i| (i * i % 251) as f32).collect()).unwrap();
        let cut = |seed: u64| view(&photo, &mut ChaCha8Rng::seed_from_u64(seed));
        assert_eq!(cut(5), cut(5));
        assert_ne!(cut(5), cut(6));
        assert!(cut(5).width_px() <= 50);
        assert_eq!(mirrored(&mirrored(&photo)), photo);
    }
}
