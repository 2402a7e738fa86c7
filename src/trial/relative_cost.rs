//! What a relative registration costs and how far it drifts, step by step, against its descriptors: the measurement behind
//! `overfly calibrate`.
//!
//! Pairs are cut from photos as the paper did (section V.D): 95, 50, 35, 25 and 10 % overlap, here turned and made noisy,
//! so that the motion between them is known exactly. Each is registered with several numbers of descriptors, by the
//! calls that `registration::relative` makes itself.

use super::TrialError;
use crate::feature::keypoint::{FrameRecipe, describe_frame, match_mutual};
use crate::pixels::Gray;
use crate::raster::{decode_frame, read_frame};
use crate::registration::relative::alignment::align;
use crate::registration::relative::consensus::{Frames, estimate};
use crate::registration::relative::{QUICK, RATIO, SCALE_BOUNDS, accepted, pair};
use nalgebra::Vector2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// The paper's overlaps, per cent.
pub const OVERLAPS_PERCENT: [f64; 5] = [95.0, 50.0, 35.0, 25.0, 10.0];

/// What is measured.
#[derive(Debug, Clone)]
pub struct RelativeTrial {
    /// Photos to cut pairs from; each at least one and a half views wide and two high.
    pub photos: Vec<PathBuf>,
    /// Pairs of each overlap.
    pub pairs: usize,
    /// Descriptors at most, one measurement each.
    pub limits: Vec<usize>,
    /// Runs of each step, of which the median counts.
    pub repeats: usize,
    /// Edge of the square views, pixels.
    pub edge_px: usize,
    /// The same seed, the same pairs.
    pub seed: u64,
}

/// One pair registered with one number of descriptors. Times are medians, seconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RelativeSample {
    /// Ground that the views share.
    pub overlap_percent: f64,
    /// Descriptors at most.
    pub limit: usize,
    /// N: descriptors found, geometric mean of both views.
    pub descriptors: f64,
    /// Decoding the view, and describing it.
    pub loading_s: f64,
    /// All against all.
    pub matching_s: f64,
    /// Which correspondences agree.
    pub threshold_s: f64,
    /// Shift and turn from what both views show; absent where nothing agreed.
    pub estimate_s: Option<f64>,
    /// n: correspondences that agree.
    pub matched: usize,
    /// Distance between found and true displacement, pixels; absent where the program would not have accepted it.
    pub drift_px: Option<f64>,
    /// The same from the keypoints alone, as the paper does it.
    pub keypoint_drift_px: Option<f64>,
}

/// Noise added to the views, one standard deviation, gray levels.
const NOISE: f32 = 4.0;
/// Turn between the views of a pair, degrees, at most.
const MOST_TURN_DEG: f64 = 8.0;

impl RelativeTrial {
    /// Registrations to be made.
    pub fn count(&self) -> usize {
        self.pairs * OVERLAPS_PERCENT.len() * self.limits.len()
    }

    /// Measures; `progress` is called after each registration.
    ///
    /// # Errors
    /// Where a photo cannot be decoded or is too small, none is given, or an option is out of range.
    pub fn run(&self, mut progress: impl FnMut(&RelativeSample)) -> Result<Vec<RelativeSample>, TrialError> {
        let refuse = |name, value: usize, expected| Err(TrialError::Option { name, value: value as f64, expected });
        if self.photos.is_empty() {
            return refuse("photos", 0, "at least one photo");
        }
        if self.pairs == 0 || self.repeats == 0 || self.limits.is_empty() {
            return refuse("pairs", self.pairs, "at least one pair, one repetition and one number of descriptors");
        }
        if self.edge_px < 128 {
            return refuse("edge_px", self.edge_px, "at least 128");
        }
        let photos = self.photos.iter().map(|p| read_frame(p)).collect::<Result<Vec<_>, _>>()?;
        let needed = self.edge_px as f64 * 2.5;
        if let Some(small) = photos.iter().find(|p| (p.width_px().min(p.height_px()) as f64) < needed) {
            let edge = small.width_px().min(small.height_px());
            return refuse("photo's shorter edge, px", edge, "at least two and a half views (see --edge-px)");
        }
        let mut samples = Vec::new();
        for pair in 0..self.pairs {
            for (stream, &overlap_percent) in OVERLAPS_PERCENT.iter().enumerate() {
                let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
                rng.set_stream((pair * OVERLAPS_PERCENT.len() + stream) as u64);
                let photo = &photos[pair % photos.len()];
                let views = ViewPair::cut(photo, self.edge_px, overlap_percent / 100.0, &mut rng);
                for &limit in &self.limits {
                    let sample = views.measure(overlap_percent, limit, self.repeats)?;
                    progress(&sample);
                    samples.push(sample);
                }
            }
        }
        Ok(samples)
    }
}

/// Two views of one photo.
struct ViewPair {
    a: Gray,
    b: Gray,
    /// b as a camera would deliver it.
    encoded: Vec<u8>,
    /// True displacement of b's centre from a's, pixels of a.
    shift_px: Vector2<f64>,
}

impl ViewPair {
    /// Views of `edge` pixels that share the fraction `overlap`, the second further ahead and a little turned.
    fn cut(photo: &Gray, edge: usize, overlap: f64, rng: &mut ChaCha8Rng) -> Self {
        let reach = edge as f64 * std::f64::consts::FRAC_1_SQRT_2 + 1.0;
        let ahead_px = (1.0 - overlap) * edge as f64;
        let shift_px = Vector2::new(rng.random_range(-2.0..2.0), -ahead_px);
        let mut heading = rng.random_range(0.0..std::f64::consts::TAU);
        let (width, height) = (photo.width_px() as f64, photo.height_px() as f64);
        let inside = |[x, y]: [f64; 2]| x >= reach && y >= reach && x <= width - reach && y <= height - reach;
        let mut centre = [width / 2.0, height / 2.0];
        let mut other = turned(centre, shift_px, heading);
        // Most places fit; where none of a hundred does, the middle of the photo with the last heading is as good.
        for _ in 0..100 {
            heading = rng.random_range(0.0..std::f64::consts::TAU);
            let at = [rng.random_range(0.0..width), rng.random_range(0.0..height)];
            (centre, other) = (at, turned(at, shift_px, heading));
            if inside(centre) && inside(other) {
                break;
            }
        }
        let turn = rng.random_range(-MOST_TURN_DEG..MOST_TURN_DEG).to_radians();
        let a = view(photo, edge, centre, heading, rng);
        let b = view(photo, edge, other, heading + turn, rng);
        let encoded = encoded(&b);
        Self { a, b, encoded, shift_px }
    }

    fn measure(&self, overlap_percent: f64, limit: usize, repeats: usize) -> Result<RelativeSample, TrialError> {
        let recipe = FrameRecipe { limit, ..QUICK };
        let of_a = describe_frame(&self.a, &recipe);
        let (loaded, loading_s) =
            timed(repeats, || decode_frame(&self.encoded, "a view").map(|frame| describe_frame(&frame, &recipe)));
        loaded?;
        let of_b = describe_frame(&self.b, &recipe);
        let (matches, matching_s) = timed(repeats, || match_mutual(&of_a, &of_b, RATIO));
        let pairs: Vec<_> = matches.iter().map(|m| pair(&of_a, m.a, &of_b, m.b)).collect();
        let edge = self.a.width_px() as f64;
        let centre = Vector2::new(edge / 2.0, edge / 2.0);
        let frames = Frames { size_of_a: 2.0 * centre, centre_of_b: centre };
        let (agreed, threshold_s) = timed(repeats, || estimate(&pairs, &frames, SCALE_BOUNDS));
        let (mut estimate_s, mut drift_px, mut keypoint_drift_px) = (None, None, None);
        if let Some(agreed) = &agreed {
            let (aligned, elapsed_s) = timed(repeats, || align(&self.a, &self.b, &agreed.similarity, centre));
            let off = |found: Vector2<f64>| (found - centre - self.shift_px).norm();
            estimate_s = Some(elapsed_s);
            if let Some(similarity) = accepted(agreed, aligned.as_ref()) {
                drift_px = Some(off(similarity.apply(centre)));
                keypoint_drift_px = Some(off(agreed.similarity.apply(centre)));
            }
        }
        Ok(RelativeSample {
            overlap_percent,
            limit,
            descriptors: (of_a.points.len() as f64 * of_b.points.len() as f64).sqrt(),
            loading_s,
            matching_s,
            threshold_s,
            estimate_s,
            matched: agreed.map_or(0, |a| a.inliers),
            drift_px,
            keypoint_drift_px,
        })
    }
}

/// Where `shift_px` of a view with this heading leads on the photo.
fn turned([x, y]: [f64; 2], shift_px: Vector2<f64>, heading_rad: f64) -> [f64; 2] {
    let (sin, cos) = heading_rad.sin_cos();
    [x + cos * shift_px.x - sin * shift_px.y, y + sin * shift_px.x + cos * shift_px.y]
}

/// A square of the photo about `centre`, turned, with noise.
fn view(photo: &Gray, edge: usize, centre: [f64; 2], heading_rad: f64, rng: &mut ChaCha8Rng) -> Gray {
    let middle = edge as f64 / 2.0;
    let mut seen = Gray::filled(edge, edge, 0.0);
    for (i, value) in seen.values_mut().iter_mut().enumerate() {
        let from_centre = Vector2::new((i % edge) as f64 + 0.5 - middle, (i / edge) as f64 + 0.5 - middle);
        let [x, y] = turned(centre, from_centre, heading_rad);
        // Four uniform numbers, less their mean, over their standard deviation: near enough to normal.
        let noise = ((0..4).map(|_| rng.random::<f32>()).sum::<f32>() - 2.0) * 3f32.sqrt();
        *value = (photo.sample(x, y) + NOISE * noise).round().clamp(0.0, 255.0);
    }
    seen
}

/// The view as a JPEG of the quality that cameras deliver.
fn encoded(view: &Gray) -> Vec<u8> {
    let values: Vec<u8> = view.values().iter().map(|&v| v as u8).collect();
    let side = u16::try_from(view.width_px()).unwrap_or(u16::MAX);
    let mut bytes = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut bytes, 92);
    encoder.encode(&values, side, side, jpeg_encoder::ColorType::Luma).expect("writing to memory does not fail");
    bytes
}

/// The work's last result and the median of its times, seconds.
fn timed<T>(repeats: usize, mut work: impl FnMut() -> T) -> (T, f64) {
    let mut times = Vec::with_capacity(repeats);
    let mut run = || {
        let started = Instant::now();
        let result = work();
        times.push(started.elapsed().as_secs_f64());
        result
    };
    let mut result = run();
    for _ in 1..repeats {
        result = run();
    }
    (result, super::Spread::of(times).expect("at least one run").median)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stated_shift_is_where_the_other_views_centre_lies() {
        // A photo whose brightness says where one is: 0.1 per column, and rows alternate not at all.
        let (width, height) = (1400, 1400);
        let photo = Gray::from_values(width, height, (0..width * height).map(|i| (i % width) as f32 * 0.1).collect());
        let photo = photo.unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let views = ViewPair::cut(&photo, 256, 0.5, &mut rng);
        // On a plane the mean of a view is the brightness of its centre, and the slope of a tells that of its shift.
        let mean = |g: &Gray| g.values().iter().map(|&v| f64::from(v)).sum::<f64>() / (256.0 * 256.0);
        let slope = |at: fn(f64, f64) -> f64| {
            let weight = |i: usize| at((i % 256) as f64 - 127.5, (i / 256) as f64 - 127.5);
            let total: f64 = (0..65536).map(|i| weight(i).powi(2)).sum();
            views.a.values().iter().enumerate().map(|(i, &v)| f64::from(v) * weight(i)).sum::<f64>() / total
        };
        let expected = slope(|x, _| x) * views.shift_px.x + slope(|_, y| y) * views.shift_px.y;
        // Noise of 4 levels over 65536 pixels: 0.02 levels each; the slopes' error times 128 px: about 0.03.
        assert!((mean(&views.b) - mean(&views.a) - expected).abs() < 0.2, "{expected}");
        assert!((views.shift_px.norm() - 128.0).abs() < 0.1);
    }

    #[test]
    fn refuses_photos_smaller_than_the_views_need_and_nothing_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("small.jpg");
        std::fs::write(&path, encoded(&Gray::filled(200, 200, 90.0))).unwrap();
        let trial =
            RelativeTrial { photos: vec![path], pairs: 1, limits: vec![100], repeats: 1, edge_px: 256, seed: 1 };
        let code = |t: RelativeTrial| t.run(|_| {}).unwrap_err().code();
        assert_eq!(code(trial.clone()), "bad_option");
        assert_eq!(code(RelativeTrial { repeats: 0, edge_px: 128, ..trial.clone() }), "bad_option");
        assert_eq!(code(RelativeTrial { photos: vec![], ..trial }), "bad_option");
    }
}
