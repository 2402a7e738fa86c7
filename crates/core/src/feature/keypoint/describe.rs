//! Keypoints of an image, as stores keep them.

use super::descriptor;
use super::detector::{self, CornerQuota};
use super::keypoints::{Keypoint, Keypoints};
use crate::pixels::{Gray, Mask};

/// The version of keypoints and descriptors. Every store carries the version; a program with another version refuses the
/// store.
pub const CONTRACT: &str = "overfly-keypoint-1: shi-tomasi 2 octaves, centroid orientation, steered brief 256";

/// Octaves: the image and its half.
const OCTAVES: usize = 2;
/// A cell of the detector's grid may give this multiple of its fair share.
const CELL_EXCESS: usize = 3;

/// Detects and describes at most `limit` keypoints, all whose descriptor's patch lies where `mask` is valid.
pub fn describe(gray: &Gray, mask: &Mask, limit: usize) -> Keypoints {
    let pattern = descriptor::pattern();
    let mut found = Vec::new();
    let mut level = (gray.clone(), mask.clone());
    for octave in 0..OCTAVES {
        let share = if octave == 0 { limit * 3 / 4 } else { limit - limit * 3 / 4 };
        let smooth = descriptor::smoothed(&level.0);
        let allowed = level.1.eroded(descriptor::PATCH_RADIUS_PX);
        let share = CornerQuota { limit: share, excess: CELL_EXCESS };
        for corner in detector::corners(&level.0, share, |x, y| allowed.at(x, y)) {
            let angle_rad = descriptor::orientation(&level.0, corner.x_px, corner.y_px);
            let bits = descriptor::steered_brief(&smooth, &pattern, corner.x_px, corner.y_px, angle_rad);
            let scale = (1 << octave) as f32;
            let point = Keypoint {
                x_px: corner.x_px * scale,
                y_px: corner.y_px * scale,
                response: corner.response,
                angle_rad,
                scale,
            };
            found.push((point, bits));
        }
        level = level.0.halved(&level.1);
    }
    found.sort_by(|a, b| b.0.response.total_cmp(&a.0.response));
    let (points, descriptors) = found.into_iter().unzip();
    Keypoints { points, descriptors }
}

#[cfg(test)]
mod tests {
    use super::super::matching::match_mutual;
    use super::super::test_images::blocks;
    use super::*;

    #[test]
    fn describes_a_turned_image_alike() {
        let gray = blocks(160, 160);
        let turned = Gray::from_values(160, 160, (0..25600).map(|i| gray.at(i / 160, 159 - i % 160)).collect());
        let mask = Mask::filled(160, 160, true);
        let (a, b) = (describe(&gray, &mask, 200), describe(&turned.unwrap(), &mask, 200));
        let matches = match_mutual(&a, &b, 0.8);
        // turned(x, y) = gray(y, 159 - x): a point (x, y) of `turned` is (y, 160 - x) of `gray`.
        let right = matches.iter().filter(|m| {
            let (p, q) = (a.points[m.a], b.points[m.b]);
            (p.x_px - q.y_px).abs() < 1.5 && (p.y_px - (160.0 - q.x_px)).abs() < 1.5
        });
        assert!(right.count() * 10 > matches.len() * 9 && matches.len() > 60, "{}", matches.len());
    }

    #[test]
    fn avoids_masked_pixels_and_finds_nothing_in_blank_images() {
        let gray = blocks(200, 100);
        let mut mask = Mask::filled(200, 100, true);
        for y in 0..100 {
            for x in 100..200 {
                mask.set(x, y, false);
            }
        }
        let radius = descriptor::PATCH_RADIUS_PX as f32;
        let found = describe(&gray, &mask, 300);
        assert!(!found.points.is_empty() && found.points.iter().all(|p| p.x_px <= 100.0 - radius));
        assert!(describe(&Gray::filled(90, 90, 7.0), &Mask::filled(90, 90, true), 300).points.is_empty());
        assert!(describe(&Gray::filled(3, 2, 7.0), &Mask::filled(3, 2, true), 300).points.is_empty());
    }
}
