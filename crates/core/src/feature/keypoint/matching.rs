//! Matching of descriptors by brute force: nearest, clearly nearer than the second, and mutually so.

#![allow(unsafe_code)]

use super::keypoints::Keypoints;

/// A keypoint of image a and the most similar keypoint of image b.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Correspondence {
    /// Index into a's keypoints.
    pub a: usize,
    /// Index into b's keypoints.
    pub b: usize,
    /// Hamming distance of the descriptors.
    pub distance: u32,
}

/// The Hamming distance: the number of bits that differ.
#[inline(always)]
pub fn hamming(a: &[u8; 32], b: &[u8; 32]) -> u32 {
    words(a).iter().zip(words(b)).map(|(a, b)| (a ^ b).count_ones()).sum()
}

#[inline(always)]
fn words(d: &[u8; 32]) -> [u64; 4] {
    std::array::from_fn(|i| u64::from_le_bytes(d[i * 8..i * 8 + 8].try_into().expect("eight bytes")))
}

/// Matches every keypoint of b with its nearest of a, where the distance is below `ratio` times that of the second nearest
/// (the ratio test, the paper's threshold step) and the match is mutual. In order of b; of equals the first is the nearest.
/// The time is |a| |b| (equation 43). The two steps are [`neighbours`] and [`Neighbours::ratio_test`].
pub fn match_mutual(a: &Keypoints, b: &Keypoints, ratio: f32) -> Vec<Correspondence> {
    neighbours(a, b).ratio_test(ratio)
}

/// The nearest neighbours of every keypoint in the other image, all descriptors compared with all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Neighbours {
    // One word holds a neighbour, its distance above its index: the least word is the first of the nearest.
    /// For each keypoint of b the nearest and second nearest of a.
    of_b: Vec<[u64; 2]>,
    /// For each keypoint of a the nearest of b.
    of_a: Vec<u64>,
}

/// Compares all descriptors of a with all of b.
///
/// # References
/// Equation 43: the time is |a| |b|.
pub fn neighbours(a: &Keypoints, b: &Keypoints) -> Neighbours {
    nearest(&a.descriptors, &b.descriptors)
}

impl Neighbours {
    /// The mutual matches that pass the ratio test.
    ///
    /// # References
    /// The paper's threshold step, equation 44: the time is |b|.
    pub fn ratio_test(&self, ratio: f32) -> Vec<Correspondence> {
        let pairs = self.of_b.iter().enumerate().filter_map(|(j, &[best, second])| {
            let found = best != u64::MAX && (distance(best) as f32) < ratio * distance(second) as f32;
            found.then(|| Correspondence { a: index(best), b: j, distance: distance(best) })
        });
        // Room for all at once: growing takes longer than filtering.
        let mut kept = Vec::with_capacity(self.of_b.len());
        kept.extend(pairs.filter(|m| index(self.of_a[m.a]) == m.b));
        kept
    }
}

fn word(distance: u32, index: usize) -> u64 {
    u64::from(distance) << 32 | index as u64
}

fn distance(word: u64) -> u32 {
    (word >> 32) as u32
}

fn index(word: u64) -> usize {
    word as u32 as usize
}

fn nearest(a: &[[u8; 32]], b: &[[u8; 32]]) -> Neighbours {
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    if is_x86_feature_detected!("popcnt") {
        // SAFETY: the processor has POPCNT.
        return unsafe { nearest_popcnt(a, b) };
    }
    nearest_plain(a, b)
}

/// [`nearest_plain`] with the processor's own count of bits.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "popcnt")]
fn nearest_popcnt(a: &[[u8; 32]], b: &[[u8; 32]]) -> Neighbours {
    nearest_plain(a, b)
}

#[inline(always)]
fn nearest_plain(a: &[[u8; 32]], b: &[[u8; 32]]) -> Neighbours {
    let mut of_a = vec![u64::MAX; a.len()];
    let one = |(j, of_b): (usize, &[u8; 32])| {
        let (mut best, mut second) = (u64::MAX, u64::MAX);
        for (i, (descriptor, nearest)) in a.iter().zip(&mut of_a).enumerate() {
            let distance = hamming(descriptor, of_b);
            *nearest = (*nearest).min(word(distance, j));
            let here = word(distance, i);
            second = second.min(best.max(here));
            best = best.min(here);
        }
        [best, second]
    };
    Neighbours { of_b: b.iter().enumerate().map(one).collect(), of_a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn matches_are_the_mutual_nearest_by_definition(
            a in proptest::collection::vec(any::<[u8; 32]>(), 0..12),
            b in proptest::collection::vec(any::<[u8; 32]>(), 0..12),
            ratio in 0.5f32..1.1,
        ) {
            let closest = |of: &[u8; 32], among: &[[u8; 32]]| (0..among.len()).min_by_key(|&i| hamming(of, &among[i]));
            let expected: Vec<_> = (0..b.len()).filter_map(|j| {
                let i = closest(&b[j], &a)?;
                let best = hamming(&a[i], &b[j]);
                let second = (0..a.len()).filter(|&k| k != i).map(|k| hamming(&a[k], &b[j])).min().unwrap_or(u32::MAX);
                let is_match = (best as f32) < ratio * second as f32 && closest(&a[i], &b) == Some(j);
                is_match.then_some(Correspondence { a: i, b: j, distance: best })
            }).collect();
            let of = |descriptors: Vec<[u8; 32]>| Keypoints { points: Vec::new(), descriptors };
            prop_assert_eq!(match_mutual(&of(a.clone()), &of(b.clone()), ratio), expected);
            let (either, plain) = (nearest(&a, &b), nearest_plain(&a, &b));
            prop_assert_eq!(either, plain);
        }
    }
}
