//! `StillPixels`: the pixels of a frame that show something which stands still in the image, an overlay or a wing.

use crate::pixels::Gray;

/// Half edge of the square that is compared, px.
const HALF_PX: usize = 2;
/// Such a square differs from the same square of the other frame by at most this share of its own mean absolute deviation.
const MOST_SHARE: f32 = 0.35;
/// A square with a smaller mean absolute deviation shows nothing, gray levels.
const LEAST_DEVIATION: f32 = 2.0;

/// Two frames of one size, compared pixel by pixel where they are.
#[derive(Debug, Clone, Copy)]
pub struct StillPixels<'a> {
    a: &'a Gray,
    b: &'a Gray,
}

impl<'a> StillPixels<'a> {
    /// `None` where the frames differ in size.
    pub fn between(a: &'a Gray, b: &'a Gray) -> Option<Self> {
        let size = |g: &Gray| (g.width_px(), g.height_px());
        (size(a) == size(b)).then_some(Self { a, b })
    }

    /// Whether the square around a pixel shows the same in both frames, and shows something. Ground that moves does so only along edges
    /// that lie in its motion.
    pub fn holds(self, x: usize, y: usize) -> bool {
        let (columns, rows) = (self.b.width_px(), self.b.height_px());
        if x < HALF_PX || y < HALF_PX || x + HALF_PX >= columns || y + HALF_PX >= rows {
            return false;
        }
        let across = x - HALF_PX..x + HALF_PX + 1;
        let lines =
            || (y - HALF_PX..=y + HALF_PX).map(|y| (&self.a.row(y)[across.clone()], &self.b.row(y)[across.clone()]));
        let count = ((2 * HALF_PX + 1) * (2 * HALF_PX + 1)) as f32;
        let mean = lines().map(|(_, b)| b.iter().sum::<f32>()).sum::<f32>() / count;
        let (mut difference, mut deviation) = (0f32, 0f32);
        for (a, b) in lines() {
            for (p, q) in a.iter().zip(b) {
                difference += (p - q).abs();
                deviation += (q - mean).abs();
            }
        }
        deviation >= LEAST_DEVIATION * count && difference <= MOST_SHARE * deviation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ground(shift: usize) -> Gray {
        let value = |i: usize| {
            let (x, y) = ((i % 80 + shift) as f32, (i / 80) as f32);
            100.0 + 30.0 * (0.5 * x + 0.3 * y).sin() + 20.0 * (0.9 * y - 0.4 * x).cos()
        };
        Gray::from_values(80, 60, (0..80 * 60).map(value).collect()).unwrap()
    }

    #[test]
    fn a_mark_that_stands_still_is_told_from_ground_that_moves() {
        let marked = |shift| {
            let mut frame = ground(shift);
            for y in 20..40 {
                frame.values_mut()[y * 80 + 30..y * 80 + 33].fill(250.0);
            }
            frame
        };
        let (a, b) = (marked(0), marked(9));
        let still = StillPixels::between(&a, &b).unwrap();
        assert!((24..36).all(|y| still.holds(31, y)));
        let held = (3..57).flat_map(|y| (40..77).map(move |x| (x, y))).filter(|&(x, y)| still.holds(x, y)).count();
        assert!(held < 54 * 37 / 20, "{held}");
    }

    #[test]
    fn nothing_and_frames_of_other_sizes_hold_nothing() {
        let plain = Gray::filled(40, 30, 90.0);
        assert!(!StillPixels::between(&plain, &plain).unwrap().holds(20, 15));
        assert!(StillPixels::between(&plain, &Gray::filled(41, 30, 90.0)).is_none());
    }
}
