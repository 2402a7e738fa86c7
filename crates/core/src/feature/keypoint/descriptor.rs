//! Orientation by intensity centroid, and BRIEF steered by it.
//!
//! # References
//! Rublee et al., ORB, ICCV 2011 (centroid, steering); Calonder et al., BRIEF, ECCV 2010 (Gaussian pattern).

use crate::pixels::Gray;

/// All pixels of a descriptor lie within this distance of the keypoint.
pub const PATCH_RADIUS_PX: usize = 20;
/// Radius of the disc whose centroid gives the orientation.
const CENTROID_RADIUS_PX: isize = 13;
/// Largest distance of a pattern point from the keypoint.
const PATTERN_RADIUS_PX: f32 = 15.0;
/// Standard deviation of the pattern's points.
const PATTERN_SIGMA_PX: f32 = 6.5;

/// The image smoothed for the comparison of single pixels: two passes of a 5 px box (sigma 2).
pub fn smoothed(gray: &Gray) -> Gray {
    let mut out = gray.clone();
    for _ in 0..2 {
        out = box_5(&out);
    }
    out
}

/// Direction from the keypoint to the centroid of brightness in a disc, radians from x towards y.
pub fn orientation(gray: &Gray, x_px: f32, y_px: f32) -> f32 {
    let (cx, cy) = (x_px as isize, y_px as isize);
    let (mut mx, mut my) = (0f32, 0f32);
    for dy in -CENTROID_RADIUS_PX..=CENTROID_RADIUS_PX {
        for dx in -CENTROID_RADIUS_PX..=CENTROID_RADIUS_PX {
            if dx * dx + dy * dy <= CENTROID_RADIUS_PX * CENTROID_RADIUS_PX {
                let value = gray.at((cx + dx) as usize, (cy + dy) as usize);
                mx += dx as f32 * value;
                my += dy as f32 * value;
            }
        }
    }
    my.atan2(mx)
}

/// The descriptor: 256 comparisons of the smoothed image at pattern points turned by the orientation. Bit i of byte i / 8 is
/// set where the first point is darker.
pub fn steered_brief(smooth: &Gray, pattern: &[[[f32; 2]; 2]], x_px: f32, y_px: f32, angle_rad: f32) -> [u8; 32] {
    let (sin, cos) = angle_rad.sin_cos();
    let value = |[px, py]: [f32; 2]| {
        let x = x_px + cos * px - sin * py;
        let y = y_px + sin * px + cos * py;
        smooth.at(x as usize, y as usize)
    };
    let mut bits = [0u8; 32];
    for (i, [a, b]) in pattern.iter().enumerate() {
        bits[i / 8] |= u8::from(value(*a) < value(*b)) << (i % 8);
    }
    bits
}

/// The 256 pairs of points to compare, pixels from the keypoint.
pub fn pattern() -> Vec<[[f32; 2]; 2]> {
    PatternGenerator::new().collect()
}

/// Generator of the pattern, which must never change: Gaussian by the sum of four uniforms of a linear congruential generator
/// (constants of Numerical Recipes), cut to the patch.
struct PatternGenerator {
    state: u32,
    left: usize,
}

impl PatternGenerator {
    fn new() -> Self {
        Self { state: 0x0f1e_2d3c, left: 256 }
    }

    fn uniform(&mut self) -> f32 {
        self.state = self.state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.state >> 8) as f32 / (1u32 << 24) as f32
    }

    fn gaussian(&mut self) -> f32 {
        let sum: f32 = (0..4).map(|_| self.uniform()).sum();
        // Four uniforms have variance 4 / 12.
        (sum - 2.0) * 3f32.sqrt() * PATTERN_SIGMA_PX
    }

    fn point(&mut self) -> [f32; 2] {
        loop {
            let p = [self.gaussian(), self.gaussian()];
            if p[0].hypot(p[1]) <= PATTERN_RADIUS_PX {
                return p;
            }
        }
    }
}

impl Iterator for PatternGenerator {
    type Item = [[f32; 2]; 2];

    fn next(&mut self) -> Option<Self::Item> {
        self.left = self.left.checked_sub(1)?;
        Some([self.point(), self.point()])
    }
}

fn box_5(gray: &Gray) -> Gray {
    gray.filtered_5(|[a, b, c, d, e]| (a + b + c + d + e) * 0.2)
}
