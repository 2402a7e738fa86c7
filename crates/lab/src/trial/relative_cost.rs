//! The cost and the drift of relative registration, step by step, against the number of descriptors: the measurement
//! behind `overfly calibrate` and `overfly experiment`.
//!
//! Images are cut from photos or orthophotos. Each is paired with views ahead of it, as in the paper (section V.D):
//! 95, 50, 35, 25 and 10 % overlap, here turned and made noisy, so that the motion between them is known exactly.
//! Each pair is registered with several numbers of descriptors, by the same calls that `registration::relative`
//! makes.

use super::error::TrialError;
use super::photo_cuts::{CutOptions, ImagePlacement, ViewPair};
use super::quantiles::Quantiles;
use super::relative_sample::{Drifts, RelativeSample, StepTimes};
use nalgebra::Vector2;
use overfly_core::feature::keypoint::{KeypointOptions, describe_frame, neighbours};
use overfly_core::pixels::Gray;
use overfly_core::registration::relative::alignment::align;
use overfly_core::registration::relative::consensus::{FrameSizes, find_consensus};
use overfly_core::registration::relative::{KeypointMatch, QUICK, RATIO, SCALE_BOUNDS, accepted};
use overfly_flight::frame::decode_frame;
use overfly_ingest::raster::{Imagery, OpenOptions};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;
use std::time::Instant;

/// The paper's overlaps, per cent.
pub const OVERLAPS_PERCENT: [f64; 5] = [95.0, 50.0, 35.0, 25.0, 10.0];

/// Most images of a trial. A picture of each stays in memory.
pub const MOST_IMAGES: usize = 2000;

/// The options of a measurement.
#[derive(Debug, Clone)]
pub struct RelativeTrial {
    /// Photos or orthophotos from which images are cut, each in turn.
    pub photos: Vec<PathBuf>,
    /// Source values shown as 0 and 255, for orthophotos of more than 8 bits.
    pub stretch: Option<(f64, f64)>,
    /// Number of images to cut, at most [`MOST_IMAGES`].
    pub images: usize,
    /// Number of pairs of each overlap, at most the number of images: an image gives at most one pair of each
    /// overlap.
    pub pairs: usize,
    /// Descriptor limits; one measurement for each.
    pub limits: Vec<usize>,
    /// Runs of each step; their median counts.
    pub repeats: usize,
    /// Edge of the square views, pixels.
    pub edge_px: usize,
    /// Seed of images and pairs.
    pub seed: u64,
}

/// The result of a measurement.
#[derive(Debug, Clone)]
pub struct RelativeMeasurement {
    /// The images.
    pub images: Vec<CutImage>,
    /// Every registration, sorted by overlap (greatest first), image and descriptor limit.
    pub samples: Vec<RelativeSample>,
}

/// An image cut from a photo.
#[derive(Debug, Clone)]
pub struct CutImage {
    /// Index of the photo.
    pub photo: usize,
    /// Place in the photo.
    pub place: ImagePlacement,
    /// The image itself, small.
    pub picture: Gray,
}

/// Runs of the shortest step that are timed together.
const SHORT_RUNS: usize = 64;
/// Edge of the pictures of images, pixels.
const PICTURE_PX: usize = 96;

impl RelativeTrial {
    /// Number of registrations.
    pub fn count(&self) -> usize {
        self.pairs * OVERLAPS_PERCENT.len() * self.limits.len()
    }

    /// Measures; calls `progress` after each registration. One photo is in memory at a time.
    ///
    /// # Errors
    /// If a photo cannot be read or is too small, no photo is given, or an option is out of range. All errors come
    /// before the first registration.
    pub fn run(&self, mut progress: impl FnMut(&RelativeSample)) -> Result<RelativeMeasurement, TrialError> {
        self.check()?;
        let places = self.places()?;
        let mut samples = Vec::with_capacity(self.count());
        let mut pictures = vec![None; self.images];
        for photo in 0..self.photos.len().min(self.images) {
            let imagery = self.open(photo)?;
            for image in (photo..self.images).step_by(self.photos.len()) {
                let Some(ground) = places[image].ground(&imagery, self.cut())? else {
                    return Err(self.no_place(photo, &imagery));
                };
                let a = ground.image(&mut self.dice(1, image));
                pictures[image] = Some(a.shrunk(PICTURE_PX, PICTURE_PX));
                for overlap in (0..OVERLAPS_PERCENT.len()).filter(|&overlap| self.has_pair(overlap, image)) {
                    let dice = &mut self.dice(2 + overlap as u64, image);
                    let pair = EncodedPair::new(ground.pair(&a, OVERLAPS_PERCENT[overlap] / 100.0, dice));
                    for &limit in &self.limits {
                        let sample = pair.measure(image + 1, OVERLAPS_PERCENT[overlap], limit, self.repeats)?;
                        progress(&sample);
                        samples.push(sample);
                    }
                }
            }
        }
        samples.sort_by(|a, b| {
            b.overlap_percent.total_cmp(&a.overlap_percent).then((a.image, a.limit).cmp(&(b.image, b.limit)))
        });
        let cut = |(image, (place, picture)): (usize, (ImagePlacement, Option<Gray>))| {
            let picture = picture.expect("every image was cut");
            CutImage { photo: image % self.photos.len(), place, picture }
        };
        Ok(RelativeMeasurement { images: places.into_iter().zip(pictures).enumerate().map(cut).collect(), samples })
    }

    fn check(&self) -> Result<(), TrialError> {
        let refuse = |name, value: usize, expected| Err(TrialError::Option { name, value: value as f64, expected });
        if self.photos.is_empty() {
            return refuse("photos", 0, "at least one photo");
        }
        if self.pairs == 0 || self.repeats == 0 || self.limits.is_empty() {
            return refuse("pairs", self.pairs, "at least one pair, one repetition and one number of descriptors");
        }
        if self.images < self.pairs {
            return refuse("images", self.images, "at least as many as pairs of each overlap");
        }
        if self.images > MOST_IMAGES {
            return refuse("images", self.images, "at most 2000");
        }
        if self.edge_px < 128 {
            return refuse("edge_px", self.edge_px, "at least 128");
        }
        Ok(())
    }

    /// Whether the image gives a pair of this overlap. The pairs of successive overlaps follow each other through the
    /// images, round and round, so that each image gives about as many.
    fn has_pair(&self, overlap: usize, image: usize) -> bool {
        let before = overlap * self.pairs % self.images;
        (image + self.images - before) % self.images < self.pairs
    }

    /// Chooses a place for every image.
    fn places(&self) -> Result<Vec<ImagePlacement>, TrialError> {
        let mut places: Vec<Option<ImagePlacement>> = vec![None; self.images];
        for photo in 0..self.photos.len().min(self.images) {
            let imagery = self.open(photo)?;
            let mut here = Vec::new();
            for image in (photo..self.images).step_by(self.photos.len()) {
                let path = &self.photos[photo];
                here.push(ImagePlacement::choose(&imagery, path, self.cut(), &here, &mut self.dice(0, image))?);
                places[image] = here.last().copied();
            }
        }
        Ok(places.into_iter().flatten().collect())
    }

    fn open(&self, photo: usize) -> Result<Imagery, TrialError> {
        let options = OpenOptions { stretch: self.stretch, ..OpenOptions::default() };
        Ok(Imagery::open(&self.photos[photo], &options)?)
    }

    fn cut(&self) -> CutOptions {
        CutOptions { edge_px: self.edge_px, least_overlap: OVERLAPS_PERCENT[4] / 100.0 }
    }

    fn no_place(&self, photo: usize, imagery: &Imagery) -> TrialError {
        let [width_px, height_px] = imagery.size_px();
        TrialError::NoPlace { path: self.photos[photo].clone(), width_px, height_px, edge_px: self.edge_px }
    }

    /// The random generator of one image and purpose.
    fn dice(&self, purpose: u64, image: usize) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(purpose << 32 | image as u64);
        rng
    }
}

/// Two views, and the second one as a camera would deliver it.
struct EncodedPair {
    views: ViewPair,
    encoded: Vec<u8>,
}

impl EncodedPair {
    fn new(views: ViewPair) -> Self {
        let encoded = encoded(&views.b);
        Self { views, encoded }
    }

    fn measure(
        &self,
        image: usize,
        overlap_percent: f64,
        limit: usize,
        repeats: usize,
    ) -> Result<RelativeSample, TrialError> {
        let ViewPair { a, b, shift_px } = &self.views;
        let options = KeypointOptions { limit, ..QUICK };
        let (of_a, of_b) = (describe_frame(a, &options), describe_frame(b, &options));
        let load = || decode_frame(&self.encoded, "a view").map(|frame| describe_frame(&frame, &options));
        let (loaded, loading_s) = timed(repeats, 1, load);
        loaded?;
        let (near, matching_s) = timed(repeats, 1, || neighbours(&of_a, &of_b));
        let (matches, threshold_s) = timed(repeats, SHORT_RUNS, || near.ratio_test(RATIO));
        let pairs: Vec<_> = matches.iter().map(|m| KeypointMatch::new(&of_a, m.a, &of_b, m.b)).collect();
        let edge = a.width_px() as f64;
        let centre = Vector2::new(edge / 2.0, edge / 2.0);
        let frames = FrameSizes { size_of_a: 2.0 * centre, centre_of_b: centre };
        let (agreed, agreement_s) = timed(repeats, 1, || find_consensus(&pairs, &frames, SCALE_BOUNDS));
        let mut times = StepTimes { loading_s, matching_s, threshold_s, agreement_s, estimate_s: None };
        let mut drifts = Drifts { drift_px: None, keypoint_drift_px: None };
        if let Some(agreed) = &agreed {
            let (aligned, elapsed_s) = timed(repeats, 1, || align(a, b, &agreed.a_from_b, centre, false));
            let off = |found: Vector2<f64>| (found - centre - shift_px).norm();
            times.estimate_s = Some(elapsed_s);
            drifts.keypoint_drift_px = Some(off(agreed.a_from_b.apply(centre)));
            drifts.drift_px = accepted(agreed, aligned.as_ref()).map(|similarity| off(similarity.apply(centre)));
        }
        let descriptors = (of_a.points.len() as f64 * of_b.points.len() as f64).sqrt();
        let matched = agreed.map_or(0, |a| a.inliers);
        Ok(RelativeSample { image, overlap_percent, limit, descriptors, times, matched, drifts })
    }
}

/// Encodes the view as a JPEG of the quality that cameras deliver.
fn encoded(view: &Gray) -> Vec<u8> {
    let values: Vec<u8> = view.values().iter().map(|&v| v as u8).collect();
    let side = u16::try_from(view.width_px()).unwrap_or(u16::MAX);
    let mut bytes = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut bytes, 92);
    encoder.encode(&values, side, side, jpeg_encoder::ColorType::Luma).expect("writing to memory does not fail");
    bytes
}

/// Returns the last result of the work and the median of its times, seconds. Each time is the mean of `runs` runs.
fn timed<T>(repeats: usize, runs: usize, mut work: impl FnMut() -> T) -> (T, f64) {
    let mut times = Vec::with_capacity(repeats);
    let mut result = None;
    for _ in 0..repeats {
        let started = Instant::now();
        for _ in 0..runs {
            result = Some(std::hint::black_box(work()));
        }
        times.push(started.elapsed().as_secs_f64() / runs as f64);
    }
    let median_s = Quantiles::from_values(times).expect("at least one repetition").median;
    (result.expect("at least one run"), median_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(photos: Vec<PathBuf>) -> RelativeTrial {
        RelativeTrial {
            photos,
            stretch: None,
            images: 72,
            pairs: 64,
            limits: vec![100],
            repeats: 1,
            edge_px: 256,
            seed: 1,
        }
    }

    #[test]
    fn seventy_two_images_give_sixty_four_pairs_of_each_overlap_and_each_four_or_five() {
        let trial = trial(vec![]);
        let of_overlap = |overlap: usize| (0..72).filter(|&image| trial.has_pair(overlap, image)).count();
        assert!((0..5).all(|overlap| of_overlap(overlap) == 64));
        let of_image = |image: usize| (0..5).filter(|&overlap| trial.has_pair(overlap, image)).count();
        assert!((0..72).all(|image| (4..=5).contains(&of_image(image))));
        // As many images as pairs of all overlaps: one pair each.
        let spread = RelativeTrial { images: 15, pairs: 3, ..trial };
        assert!((0..15).all(|image| (0..5).filter(|&overlap| spread.has_pair(overlap, image)).count() == 1));
    }

    #[test]
    fn refuses_photos_without_room_and_nothing_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("small.jpg");
        std::fs::write(&path, encoded(&Gray::filled(200, 200, 90.0))).unwrap();
        let code = |t: RelativeTrial| t.run(|_| {}).unwrap_err().code();
        let small = trial(vec![path]);
        assert_eq!(code(small.clone()), "no_place_for_views");
        for option in [
            RelativeTrial { repeats: 0, ..small.clone() },
            RelativeTrial { images: 63, ..small.clone() },
            RelativeTrial { images: MOST_IMAGES + 1, ..small.clone() },
            RelativeTrial { edge_px: 127, ..small.clone() },
            RelativeTrial { photos: vec![], ..small },
        ] {
            assert_eq!(code(option), "bad_option");
        }
    }
}
