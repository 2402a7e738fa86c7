//! `TapeRow`: what camera, sensors and clock say at one frame of a replayed flight.

use crate::trial::recorded_flight::RecordedFrame;
use overfly_core::pixels::Gray;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// One image of a replayed flight, as the navigator is told of it.
#[derive(Debug, Clone)]
pub struct TapeRow {
    /// The frame whose truth holds.
    pub frame: usize,
    /// The frame that the camera shows.
    pub shown: usize,
    /// The frame that the upper half of the image shows, where this is another.
    pub upper_half: Option<usize>,
    /// Seed of noise in the image.
    pub noise: Option<u64>,
    /// What is drawn into the image.
    pub drawing: Option<Drawing>,
    /// What clock, compass, altimeter and attitude sensor say.
    pub stated: RecordedFrame,
}

/// What stands still in all images; its form and place are drawn by a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawing {
    /// Lines and letters as of an artificial horizon.
    Overlay(u64),
    /// Dark spots with soft edges.
    Dust(u64),
    /// A bright shape with a sharp edge over a corner.
    Wing(u64),
}

impl TapeRow {
    /// The row of an undisturbed flight.
    pub fn new(number: usize, frame: &RecordedFrame) -> Self {
        Self { frame: number, shown: number, upper_half: None, noise: None, drawing: None, stated: frame.clone() }
    }

    /// The image as the camera shows it. `upper`: the frame of [`TapeRow::upper_half`].
    pub fn altered(&self, mut image: Gray, upper: Option<&Gray>) -> Gray {
        if let Some(upper) = upper.filter(|u| u.values().len() == image.values().len()) {
            let half = image.width_px() * (image.height_px() / 2);
            image.values_mut()[..half].copy_from_slice(&upper.values()[..half]);
        }
        if let Some(seed) = self.noise {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let gain = rng.random_range(0.97f32..1.03);
            image
                .values_mut()
                .iter_mut()
                .for_each(|v| *v = (*v * gain + rng.random_range(-3.0..3.0)).clamp(0.0, 255.0));
        }
        if let Some(drawing) = self.drawing {
            drawing.draw(&mut image);
        }
        image
    }
}

impl Drawing {
    /// Draws into an image. The same drawing has the same form and place in all images of a size.
    pub fn draw(self, image: &mut Gray) {
        match self {
            Self::Overlay(seed) => draw_overlay(image, &mut ChaCha8Rng::seed_from_u64(seed)),
            Self::Dust(seed) => draw_dust(image, &mut ChaCha8Rng::seed_from_u64(seed)),
            Self::Wing(seed) => draw_wing(image, &mut ChaCha8Rng::seed_from_u64(seed)),
        }
    }
}

/// A cross, a frame of corner marks, and lines of letters: small random patterns.
fn draw_overlay(image: &mut Gray, rng: &mut ChaCha8Rng) {
    let (width, height) = (image.width_px(), image.height_px());
    let unit = (width / 128).max(1);
    let mut mark = |x: usize, y: usize, w: usize, h: usize| {
        for row in y..(y + h).min(height) {
            let from = row * width;
            image.values_mut()[from + x.min(width)..from + (x + w).min(width)].fill(250.0);
        }
    };
    mark(width / 2 - 12 * unit, height / 2, 24 * unit, unit);
    mark(width / 2, height / 2 - 9 * unit, unit, 18 * unit);
    for (x, y) in [(width / 8, height / 8), (7 * width / 8, height / 8), (width / 8, 7 * height / 8)] {
        mark(x, y, 10 * unit, unit);
        mark(x, y, unit, 10 * unit);
    }
    for _ in 0..4 {
        let (left, top) = (rng.random_range(0..width * 3 / 5), rng.random_range(0..height * 9 / 10));
        for letter in 0..9 {
            for bit in 0..15 {
                if rng.random_bool(0.5) {
                    mark(left + letter * 4 * unit + bit % 3 * unit, top + bit / 3 * unit, unit, unit);
                }
            }
        }
    }
}

fn draw_dust(image: &mut Gray, rng: &mut ChaCha8Rng) {
    let (width, height) = (image.width_px() as f64, image.height_px() as f64);
    for _ in 0..12 {
        let (x, y) = (rng.random_range(0.0..width), rng.random_range(0.0..height));
        let (radius, depth) = (width * rng.random_range(0.01..0.06), rng.random_range(0.3..0.9));
        let columns = image.width_px();
        for (i, v) in image.values_mut().iter_mut().enumerate() {
            let off = ((i % columns) as f64 + 0.5 - x).hypot((i / columns) as f64 + 0.5 - y) / radius;
            *v *= 1.0 - (depth * (-off.powi(4)).exp()) as f32;
        }
    }
}

/// A half plane over up to a third of the image, its surface with rivets.
fn draw_wing(image: &mut Gray, rng: &mut ChaCha8Rng) {
    let (width, height) = (image.width_px() as f64, image.height_px() as f64);
    let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let far = rng.random_range(0.15..0.35) * width;
    let columns = image.width_px();
    for (i, v) in image.values_mut().iter_mut().enumerate() {
        let (x, y) = ((i % columns) as f64 - width / 2.0, (i / columns) as f64 - height / 2.0);
        let (along, across) = (x * cos + y * sin - far, y * cos - x * sin);
        if along > 0.0 {
            let rivet = (along / 6.0).fract() < 0.2 && (across / 9.0).rem_euclid(1.0) < 0.2;
            *v = if rivet { 110.0 } else { 205.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_drawn_is_the_same_in_every_image() {
        for drawing in [Drawing::Overlay(3), Drawing::Dust(3), Drawing::Wing(3)] {
            let [mut dark, mut bright] = [Gray::filled(160, 120, 40.0), Gray::filled(160, 120, 80.0)];
            drawing.draw(&mut dark);
            drawing.draw(&mut bright);
            let pairs = || dark.values().iter().zip(bright.values());
            let drawn = pairs().filter(|(a, _)| (**a - 40.0).abs() > 1.0).count();
            assert!((200..9000).contains(&drawn), "{drawing:?}: {drawn}");
            assert!(pairs().all(|(a, b)| ((*a - 40.0).abs() > 1.0) == ((*b - 80.0).abs() > 1.0) || *a < 80.0));
        }
    }
}
