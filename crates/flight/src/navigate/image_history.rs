//! `ImageHistory`: whether the camera shows the ground of now. A frozen or replayed video does not.

use super::flight_image::FlightImage;
use overfly_core::pixels::Gray;
use overfly_core::registration::stationary::{StationaryMask, StillBlocks};
use std::collections::HashSet;
use std::sync::Arc;

/// Images between which the ground moves by less than this cannot be told from frozen ones, pixels.
const LEAST_MOTION_PX: f64 = 2.0;
/// Where a larger share of the image stands still, beyond what always does, the camera shows an old image or a part of one.
const MOST_STILL_SHARE: f64 = 0.15;
/// Where a larger share stands still, the whole image does: the video is frozen, or the aircraft does not move.
const FROZEN_SHARE: f64 = 0.5;

/// What an image is good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageUse {
    /// Relative and absolute registration.
    All,
    /// Only the next image is compared with it: its motion is not what the aircraft flies.
    Comparison,
    /// Nothing: it does not show what a valid camera sees now.
    Nothing,
}

/// The images of a flight, as far as the next one is compared with them.
#[derive(Debug, Clone)]
pub struct ImageHistory {
    /// The hashes of all images that show something.
    hashes: HashSet<u64>,
    last: Arc<Gray>,
    mask: StationaryMask,
}

impl ImageHistory {
    /// Starts with the first image.
    pub fn new(first: Arc<Gray>) -> Self {
        Self { hashes: hash(&first).into_iter().collect(), last: first, mask: StationaryMask::default() }
    }

    /// What stands still in all images.
    pub fn mask(&self) -> &StationaryMask {
        &self.mask
    }

    /// Adds an image that was taken from a height, metres, and returns what it is good for. `least_motion_m`: how far the aircraft
    /// has moved at least since the last image.
    pub fn add(&mut self, image: &FlightImage, height_m: f64, least_motion_m: f64) -> ImageUse {
        let Ok(camera) = image.camera(height_m) else { return ImageUse::Nothing };
        let shows_now = self.add_pixels(&image.gray, least_motion_m / camera.gsd_m_per_px());
        if shows_now { ImageUse::All } else { ImageUse::Nothing }
    }

    /// Whether the pixels show what the camera sees now. `least_motion_px`: how far the ground has moved in the image at least
    /// since the last one. An image with the very pixels of an earlier one is a copy at any speed: a sensor has noise.
    fn add_pixels(&mut self, image: &Arc<Gray>, least_motion_px: f64) -> bool {
        let is_copy = hash(image).is_some_and(|hash| !self.hashes.insert(hash));
        let last = std::mem::replace(&mut self.last, image.clone());
        if is_copy {
            return false;
        }
        let Some(compared) = StillBlocks::compare(&last, image) else { return true };
        let share = compared.still_share(&self.mask.masked());
        if share > FROZEN_SHARE {
            return least_motion_px < LEAST_MOTION_PX;
        }
        // A part moves and a part stands still, which no motion of the camera explains.
        self.mask.add(&compared);
        share <= MOST_STILL_SHARE
    }
}

/// A hash of the pixels (FNV-1a over 32-bit words); `None` for an image of one value.
fn hash(image: &Gray) -> Option<u64> {
    let values = image.values();
    if values.iter().all(|v| *v == values[0]) {
        return None;
    }
    let step = |hash: u64, value: &f32| (hash ^ u64::from(value.to_bits())).wrapping_mul(0x0100_0000_01b3);
    Some(values.iter().fold(0xcbf2_9ce4_8422_2325, step))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(number: usize) -> Arc<Gray> {
        let value = |i: usize| {
            let (x, y) = ((i % 240) as f64 + 37.0 * number as f64, (i / 240) as f64);
            let wave = (0.31 * x + 0.11 * y).sin() + (0.17 * x - 0.23 * y).cos() + (0.05 * x + 0.4 * y).sin();
            128.0 + 20.0 * wave as f32
        };
        Arc::new(Gray::from_values(240, 180, (0..240 * 180).map(value).collect()).unwrap())
    }

    fn brighter(image: &Gray) -> Arc<Gray> {
        let mut copy = image.clone();
        copy.values_mut().iter_mut().for_each(|v| *v = *v * 1.02 + 1.0);
        Arc::new(copy)
    }

    #[test]
    fn a_copy_of_any_earlier_image_is_no_view_of_the_ground() {
        let mut history = ImageHistory::new(image(0));
        assert!(history.add_pixels(&image(1), 0.0) && history.add_pixels(&image(2), 37.0));
        assert!(!history.add_pixels(&image(2), 0.0) && !history.add_pixels(&image(0), 37.0));
        assert!(history.add_pixels(&image(3), 37.0));
    }

    #[test]
    fn a_nearly_equal_image_is_a_fault_where_the_aircraft_moves() {
        let mut history = ImageHistory::new(image(0));
        assert!(!history.add_pixels(&brighter(&image(0)), 30.0));
        let mut hovering = ImageHistory::new(image(0));
        assert!(hovering.add_pixels(&brighter(&image(0)), 0.0));
    }

    #[test]
    fn black_images_are_not_copies() {
        let black = Arc::new(Gray::filled(240, 180, 0.0));
        let mut history = ImageHistory::new(black.clone());
        assert!(history.add_pixels(&black, 30.0) && history.add_pixels(&black, 30.0));
    }
}
