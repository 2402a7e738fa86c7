//! Matching of descriptors by brute force: nearest, clearly nearer than the second, and mutually so.

use super::Keypoints;

/// A keypoint of image a and the one of image b that looks most alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Correspondence {
    /// Index into a's keypoints.
    pub a: usize,
    /// Index into b's keypoints.
    pub b: usize,
    /// Bits that differ.
    pub distance: u32,
}

/// Bits that differ.
pub fn hamming(a: &[u8; 32], b: &[u8; 32]) -> u32 {
    let word = |d: &[u8; 32], i: usize| u64::from_le_bytes(d[i * 8..i * 8 + 8].try_into().expect("eight bytes"));
    (0..4).map(|i| (word(a, i) ^ word(b, i)).count_ones()).sum()
}

/// For every keypoint of b its nearest of a, where the second nearest is farther by `ratio` (the paper's threshold
/// step) and a's nearest of b is the same keypoint. In order of b. Time is |a| |b| (equation 43).
pub fn match_mutual(a: &Keypoints, b: &Keypoints, ratio: f32) -> Vec<Correspondence> {
    let mut nearest_of_a = vec![(u32::MAX, usize::MAX); a.descriptors.len()];
    let mut matches = Vec::new();
    for (j, of_b) in b.descriptors.iter().enumerate() {
        let (mut best, mut second, mut at) = (u32::MAX, u32::MAX, 0);
        for (i, of_a) in a.descriptors.iter().enumerate() {
            let distance = hamming(of_a, of_b);
            if distance < nearest_of_a[i].0 {
                nearest_of_a[i] = (distance, j);
            }
            if distance < best {
                (second, best, at) = (best, distance, i);
            } else if distance < second {
                second = distance;
            }
        }
        if best != u32::MAX && (best as f32) < ratio * second as f32 {
            matches.push(Correspondence { a: at, b: j, distance: best });
        }
    }
    matches.retain(|m| nearest_of_a[m.a].1 == m.b);
    matches
}
