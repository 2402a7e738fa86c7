//! Keypoints with 256-bit binary descriptors.

mod blob;
mod descriptor;
mod detector;
mod frame;
mod matching;
mod patches;
mod response;

pub use blob::{from_blob, to_blob};
pub use frame::{FrameRecipe, describe_frame};
pub use matching::{Correspondence, Neighbours, hamming, match_mutual, neighbours};

use crate::pixels::{Gray, Mask};
use detector::Share;

/// The version of everything in this module that changes a descriptor's bits. Stored in every store; a program with
/// another contract refuses the store.
pub const CONTRACT: &str = "overfly-keypoint-1: shi-tomasi 2 octaves, centroid orientation, steered brief 256";

/// Keypoints of one image, strongest first, with their descriptors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Keypoints {
    /// Position in pixels from the corner, and what else is known of each.
    pub points: Vec<Keypoint>,
    /// 256 bits each, same order as `points`.
    pub descriptors: Vec<[u8; 32]>,
}

/// One keypoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// Column, pixels from the left edge (0.5 is the first pixel's centre).
    pub x_px: f32,
    /// Row, pixels from the upper edge.
    pub y_px: f32,
    /// Corner strength: the structure tensor's smaller eigenvalue, (gray levels per pixel)^2.
    pub response: f32,
    /// Direction of the intensity centroid, radians from x towards y.
    pub angle_rad: f32,
    /// Scale of the octave it was found on, pixels of the image per pixel of the octave.
    pub scale: f32,
}

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
        let share = Share { limit: share, excess: CELL_EXCESS };
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

/// How unlike its keypoints are from each other, in [0, 1]: the mean over keypoints of the distance to the nearest
/// other descriptor, in bits of 128, clipped. 0 with fewer than two keypoints.
pub fn distinctiveness(keypoints: &Keypoints) -> f64 {
    let d = &keypoints.descriptors;
    if d.len() < 2 {
        return 0.0;
    }
    let nearest = |i: usize| (0..d.len()).filter(|&j| j != i).map(|j| hamming(&d[i], &d[j])).min().unwrap_or(0);
    let total: u32 = (0..d.len()).map(nearest).sum();
    (f64::from(total) / d.len() as f64 / 128.0).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rectangles of many sizes and brightnesses, by a small linear congruential generator.
    pub(super) fn blocks(width: usize, height: usize) -> Gray {
        let mut gray = Gray::filled(width, height, 100.0);
        let mut state = 12345u32;
        let mut next = |n: usize| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as usize % n
        };
        for _ in 0..width * height / 60 {
            let (x, y, w, h, v) = (next(width), next(height), 3 + next(12), 3 + next(12), next(256));
            for j in y..(y + h).min(height) {
                for i in x..(x + w).min(width) {
                    gray.values_mut()[j * width + i] = v as f32;
                }
            }
        }
        gray
    }

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
    fn keeps_off_masked_pixels_and_says_nothing_of_blank_images() {
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

    #[test]
    fn distinctiveness_is_zero_for_copies() {
        let twice = Keypoints { points: Vec::new(), descriptors: vec![[7; 32], [7; 32]] };
        assert_eq!(distinctiveness(&twice), 0.0);
        assert_eq!(distinctiveness(&Keypoints::default()), 0.0);
    }
}
