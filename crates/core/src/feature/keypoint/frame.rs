//! Keypoints of a camera frame, to be compared with the next: as [`super::describe`], but quicker, on more scales, and
//! up to the frame's rim, for two frames may share no more than a strip of it. Not what stores keep.

use super::detector::{self, Share};
use super::patches::{Patches, Pattern};
use super::{Keypoint, Keypoints, descriptor};
use crate::pixels::Gray;
use std::borrow::Cow;

/// How much is described.
#[derive(Debug, Clone, Copy)]
pub struct FrameRecipe {
    /// Keypoints at most.
    pub limit: usize,
    /// Steps of the scale per octave: 1 describes the frame and its half, 2 also what lies between and below.
    pub steps_per_octave: usize,
}

/// Octaves: the frame and its half.
const OCTAVES: usize = 2;
/// Corners keep off the rim by this much: the tensor and the sub-pixel peak need it.
const MARGIN_PX: usize = 5;
/// A cell of the detector's grid may give this multiple of its fair share: what two frames share may be any strip.
const CELL_EXCESS: usize = 1;
/// Levels smaller than this are not described.
const LEAST_EDGE_PX: usize = 32;

/// Detects and describes at most `recipe.limit` keypoints, finer scales first, strongest first within each.
pub fn describe_frame(gray: &Gray, recipe: &FrameRecipe) -> Keypoints {
    let pattern = Pattern::new(&descriptor::pattern());
    let mut found = Keypoints::default();
    let levels = OCTAVES * recipe.steps_per_octave;
    let weight = |level: usize| 0.25f64.powf(level as f64 / recipe.steps_per_octave as f64).sqrt();
    let total: f64 = (0..levels).map(weight).sum();
    let half = gray.binned(2);
    for level in 0..levels {
        let octave = level / recipe.steps_per_octave;
        let base = if octave == 0 { gray } else { &half };
        let image = between(base, level % recipe.steps_per_octave, recipe.steps_per_octave);
        let limit = (recipe.limit as f64 * weight(level) / total) as usize;
        describe_level(&image, [gray.width_px(), gray.height_px()], limit, &pattern, &mut found);
    }
    found
}

/// The image shrunk by a part of an octave.
fn between(base: &Gray, step: usize, steps_per_octave: usize) -> Cow<'_, Gray> {
    if step == 0 {
        return Cow::Borrowed(base);
    }
    let ratio = 0.5f64.powf(step as f64 / steps_per_octave as f64);
    let size = |n: usize| (n as f64 * ratio).round() as usize;
    Cow::Owned(base.shrunk(size(base.width_px()), size(base.height_px())))
}

fn describe_level(image: &Gray, frame_px: [usize; 2], limit: usize, pattern: &Pattern, found: &mut Keypoints) {
    let (width, height) = (image.width_px(), image.height_px());
    if width.min(height) < LEAST_EDGE_PX {
        return;
    }
    let inside = |v: usize, n: usize| v >= MARGIN_PX && v + MARGIN_PX < n;
    let share = Share { limit, excess: CELL_EXCESS };
    let corners = detector::corners(image, share, |x, y| inside(x, width) && inside(y, height));
    let patches = Patches::new(image);
    let ratio = [frame_px[0] as f32 / width as f32, frame_px[1] as f32 / height as f32];
    for corner in corners {
        let (angle_rad, bits) = patches.describe(pattern, corner.x_px as usize, corner.y_px as usize);
        found.points.push(Keypoint {
            x_px: corner.x_px * ratio[0],
            y_px: corner.y_px * ratio[1],
            response: corner.response,
            angle_rad,
            scale: (ratio[0] * ratio[1]).sqrt(),
        });
        found.descriptors.push(bits);
    }
}

#[cfg(test)]
mod tests {
    use super::super::match_mutual;
    use super::super::tests::blocks;
    use super::*;

    #[test]
    fn describes_up_to_the_rim_and_a_turned_frame_alike() {
        let gray = blocks(160, 160);
        let turned = Gray::from_values(160, 160, (0..25600).map(|i| gray.at(i / 160, 159 - i % 160)).collect());
        let recipe = FrameRecipe { limit: 300, steps_per_octave: 1 };
        let (a, b) = (describe_frame(&gray, &recipe), describe_frame(&turned.unwrap(), &recipe));
        assert!(a.points.iter().any(|p| p.x_px < 10.0) && a.points.len() <= 300);
        let matches = match_mutual(&a, &b, 0.9);
        // turned(x, y) = gray(y, 159 - x): a point (x, y) of `turned` is (y, 160 - x) of `gray`.
        let right = matches.iter().filter(|m| {
            let (p, q) = (a.points[m.a], b.points[m.b]);
            (p.x_px - q.y_px).abs() < 1.5 && (p.y_px - (160.0 - q.x_px)).abs() < 1.5
        });
        assert!(right.count() * 10 > matches.len() * 9 && matches.len() > 80, "{}", matches.len());
    }

    #[test]
    fn says_nothing_of_blank_and_tiny_frames() {
        let recipe = FrameRecipe { limit: 300, steps_per_octave: 2 };
        for (width, height) in [(0, 0), (1, 1), (16, 16), (40, 33), (90, 20), (200, 100)] {
            assert!(describe_frame(&Gray::filled(width, height, 7.0), &recipe).points.is_empty());
        }
    }

    #[test]
    fn finds_a_frame_shrunk_by_part_of_an_octave() {
        let gray = blocks(300, 300);
        let small = gray.shrunk(212, 212);
        let recipe = FrameRecipe { limit: 600, steps_per_octave: 2 };
        let (a, b) = (describe_frame(&gray, &recipe), describe_frame(&small, &recipe));
        let matches = match_mutual(&a, &b, 0.9);
        let right = matches.iter().filter(|m| {
            let (p, q) = (a.points[m.a], b.points[m.b]);
            (p.x_px - q.x_px * 300.0 / 212.0).hypot(p.y_px - q.y_px * 300.0 / 212.0) < 3.0
        });
        assert!(right.count() > 40, "of {}", matches.len());
    }
}
