//! How different the keypoints of one image are from each other.

use super::keypoints::Keypoints;
use super::matching::hamming;

/// The mean over keypoints of the Hamming distance to the nearest other descriptor, over 128 bits and at most 1; 0 with fewer
/// than two keypoints.
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

    #[test]
    fn distinctiveness_is_zero_for_copies() {
        let twice = Keypoints { points: Vec::new(), descriptors: vec![[7; 32], [7; 32]] };
        assert_eq!(distinctiveness(&twice), 0.0);
        assert_eq!(distinctiveness(&Keypoints::default()), 0.0);
    }
}
