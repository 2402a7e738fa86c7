//! `Disturbances`: the disturbances of a replayed flight, to test how navigation copes with them.

use super::sequence_fault::SequenceFault;
use super::tape::TapeRow;
use crate::trial::recorded_flight::RecordedFrame;
use overfly_core::pixels::Gray;
use rand::seq::index::sample;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::HashSet;

/// The disturbances of one flight. The same seed gives the same disturbances.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Disturbances {
    /// Distance of the stated start from the true one, in a random direction, metres.
    pub start_error_m: f64,
    /// First black image (counted from 0) and number of black images.
    pub blackout: Option<(usize, usize)>,
    /// Share of images that show nothing but cloud.
    pub cloud_share: f64,
    /// Constant error of the compass, radians.
    pub heading_bias_rad: f64,
    /// What happens to a stretch of the flight.
    pub fault: Option<SequenceFault>,
    /// Seed of everything random.
    pub seed: u64,
}

/// Cell size of a cloud's grid, pixels.
const CLOUD_PX: usize = 48;

impl Disturbances {
    /// Direction of the error of the start, radians clockwise from north.
    pub fn start_bearing_rad(&self) -> f64 {
        ChaCha8Rng::seed_from_u64(self.seed).random_range(0.0..std::f64::consts::TAU)
    }

    /// What the navigator is told of each image.
    pub fn tape(&self, frames: &[RecordedFrame]) -> Vec<TapeRow> {
        let mut tape = frames.iter().enumerate().map(|(i, frame)| TapeRow::new(i, frame)).collect();
        if let Some(fault) = self.fault {
            fault.apply(&mut tape, self.seed);
        }
        tape
    }

    /// The numbers of the images that show cloud.
    pub fn clouded(&self, images: usize) -> HashSet<usize> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(1);
        let count = (self.cloud_share.clamp(0.0, 1.0) * images as f64).round() as usize;
        sample(&mut rng, images, count).into_iter().collect()
    }

    /// Whether an image shows nothing of the ground.
    pub fn hides(&self, number: usize, clouded: &HashSet<usize>) -> bool {
        clouded.contains(&number) || self.is_black(number)
    }

    fn is_black(&self, number: usize) -> bool {
        self.blackout.is_some_and(|(first, count)| (first..first.saturating_add(count)).contains(&number))
    }

    /// Returns the image as the camera sees it.
    pub fn seen(&self, number: usize, image: Gray, clouded: &HashSet<usize>) -> Gray {
        if self.is_black(number) {
            Gray::filled(image.width_px(), image.height_px(), 0.0)
        } else if clouded.contains(&number) {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(2 + number as u64);
            cloud(image.width_px(), image.height_px(), &mut rng)
        } else {
            image
        }
    }
}

/// Draws bright billows with the sensor's noise.
fn cloud(width_px: usize, height_px: usize, rng: &mut ChaCha8Rng) -> Gray {
    let columns = width_px / CLOUD_PX + 2;
    let knots: Vec<f32> = (0..columns * (height_px / CLOUD_PX + 2)).map(|_| rng.random_range(190.0..250.0)).collect();
    let values = (0..width_px * height_px).map(|i| {
        let (x, y) = (i % width_px, i / width_px);
        let (u, v) = ((x % CLOUD_PX) as f32 / CLOUD_PX as f32, (y % CLOUD_PX) as f32 / CLOUD_PX as f32);
        let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
        let (u, v) = (smooth(u), smooth(v));
        let at = |dx: usize, dy: usize| knots[(y / CLOUD_PX + dy) * columns + x / CLOUD_PX + dx];
        let above = at(0, 0) * (1.0 - u) + at(1, 0) * u;
        let below = at(0, 1) * (1.0 - u) + at(1, 1) * u;
        above * (1.0 - v) + below * v + rng.random_range(-2.0..2.0)
    });
    Gray::from_values(width_px, height_px, values.collect()).expect("a value a pixel")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clouds_the_stated_share_and_blacks_out_the_stated_images() {
        let troubles = Disturbances { cloud_share: 0.3, blackout: Some((4, 3)), seed: 5, ..Default::default() };
        let clouded = troubles.clouded(50);
        assert_eq!(clouded.len(), 15);
        assert_eq!(clouded, troubles.clouded(50));
        let image = Gray::filled(100, 70, 99.0);
        assert_eq!(troubles.seen(5, image.clone(), &clouded).at(3, 3), 0.0);
        let clear = (10..50).find(|n| !clouded.contains(n)).unwrap();
        assert_eq!(troubles.seen(clear, image.clone(), &clouded), image);
        let cloudy = troubles.seen(*clouded.iter().find(|n| **n > 7).unwrap(), image, &clouded);
        assert!(cloudy.values().iter().all(|v| (180.0..255.0).contains(v)));
    }
}
