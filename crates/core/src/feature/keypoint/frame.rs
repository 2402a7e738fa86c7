//! Keypoints of a camera frame, to be compared with the next frame. Unlike [`super::describe()`], whose keypoints stores keep,
//! this is faster, uses more scales, and reaches up to the frame's rim: two frames may share only a strip.

use super::descriptor;
use super::detector::{self, CornerQuota};
use super::keypoints::{Keypoint, Keypoints};
use super::patches::{BriefPattern, Patches};
use crate::pixels::Gray;
use std::borrow::Cow;

/// How many keypoints are described, and on which scales.
#[derive(Debug, Clone, Copy)]
pub struct KeypointOptions {
    /// Most keypoints.
    pub limit: usize,
    /// Levels per octave: 1 describes the frame and its half, 2 also the scales between and below.
    pub steps_per_octave: usize,
}

/// Octaves: the frame and its half.
const OCTAVES: usize = 2;
/// Least distance of corners from the rim: the tensor and the sub-pixel peak need it.
const MARGIN_PX: usize = 5;
/// Most corners of one cell of the detector's grid, as a multiple of an even share: two frames may share any strip.
const CELL_EXCESS: usize = 1;
/// Smaller levels are not described.
const LEAST_EDGE_PX: usize = 32;

/// Detects and describes at most `options.limit` keypoints, finer scales first, strongest first within each.
pub fn describe_frame(gray: &Gray, options: &KeypointOptions) -> Keypoints {
    let pattern = BriefPattern::new(&descriptor::pattern());
    let mut found = Keypoints::default();
    let levels = OCTAVES * options.steps_per_octave;
    let weight = |level: usize| 0.25f64.powf(level as f64 / options.steps_per_octave as f64).sqrt();
    let total: f64 = (0..levels).map(weight).sum();
    let half = gray.binned(2);
    for level in 0..levels {
        let octave = level / options.steps_per_octave;
        let base = if octave == 0 { gray } else { &half };
        let image = between(base, level % options.steps_per_octave, options.steps_per_octave);
        let limit = (options.limit as f64 * weight(level) / total) as usize;
        describe_level(&image, [gray.width_px(), gray.height_px()], limit, &pattern, &mut found);
    }
    found
}

/// The image, shrunk by a part of an octave.
fn between(base: &Gray, step: usize, steps_per_octave: usize) -> Cow<'_, Gray> {
    if step == 0 {
        return Cow::Borrowed(base);
    }
    let ratio = 0.5f64.powf(step as f64 / steps_per_octave as f64);
    let size = |n: usize| (n as f64 * ratio).round() as usize;
    Cow::Owned(base.shrunk(size(base.width_px()), size(base.height_px())))
}

fn describe_level(image: &Gray, frame_px: [usize; 2], limit: usize, pattern: &BriefPattern, found: &mut Keypoints) {
    let (width, height) = (image.width_px(), image.height_px());
    if width.min(height) < LEAST_EDGE_PX {
        return;
    }
    let inside = |v: usize, n: usize| v >= MARGIN_PX && v + MARGIN_PX < n;
    let quota = CornerQuota { limit, excess: CELL_EXCESS };
    let corners = detector::corners(image, quota, |x, y| inside(x, width) && inside(y, height));
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
    use super::super::matching::match_mutual;
    use super::super::test_images::blocks;
    use super::*;

    #[test]
    fn describes_up_to_the_rim_and_a_turned_frame_alike() {
        let gray = blocks(160, 160);
        let turned = Gray::from_values(160, 160, (0..25600).map(|i| gray.at(i / 160, 159 - i % 160)).collect());
        let options = KeypointOptions { limit: 300, steps_per_octave: 1 };
        let (a, b) = (describe_frame(&gray, &options), describe_frame(&turned.unwrap(), &options));
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
    fn finds_nothing_in_blank_and_tiny_frames() {
        let options = KeypointOptions { limit: 300, steps_per_octave: 2 };
        for (width, height) in [(0, 0), (1, 1), (16, 16), (40, 33), (90, 20), (200, 100)] {
            assert!(describe_frame(&Gray::filled(width, height, 7.0), &options).points.is_empty());
        }
    }

    #[test]
    fn finds_a_frame_shrunk_by_part_of_an_octave() {
        let gray = blocks(300, 300);
        let small = gray.shrunk(212, 212);
        let options = KeypointOptions { limit: 600, steps_per_octave: 2 };
        let (a, b) = (describe_frame(&gray, &options), describe_frame(&small, &options));
        let matches = match_mutual(&a, &b, 0.9);
        let right = matches.iter().filter(|m| {
            let (p, q) = (a.points[m.a], b.points[m.b]);
            (p.x_px - q.x_px * 300.0 / 212.0).hypot(p.y_px - q.y_px * 300.0 / 212.0) < 3.0
        });
        assert!(right.count() > 40, "of {}", matches.len());
    }
}
