//! Keypoint matches as the robust estimator takes them.

use super::keypoint_match::KeypointMatch;
use crate::registration::robust::{Observations, Score};
use crate::registration::similarity::Similarity;
use crate::simd::dispatch;
use nalgebra::{Matrix2, Vector2};

/// Keypoint matches, and the scales that a similarity between the frames may have.
pub struct KeypointObservations<'a> {
    matches: &'a [KeypointMatch],
    scale_bounds: (f64, f64),
    columns: Columns,
}

impl<'a> KeypointObservations<'a> {
    /// Makes observations of `matches`; scales are bounded inclusively.
    pub fn new(matches: &'a [KeypointMatch], scale_bounds: (f64, f64)) -> Self {
        Self { matches, scale_bounds, columns: Columns::new(matches) }
    }
}

impl Observations for KeypointObservations<'_> {
    fn count(&self) -> usize {
        self.matches.len()
    }

    fn point(&self, index: usize) -> Vector2<f64> {
        self.matches[index].b
    }

    fn observed(&self, index: usize) -> Vector2<f64> {
        self.matches[index].a
    }

    fn information(&self, _index: usize) -> Matrix2<f64> {
        Matrix2::identity()
    }

    fn residual(&self, index: usize, a_from_b: &Similarity) -> Vector2<f64> {
        self.matches[index].a - a_from_b.apply(self.matches[index].b)
    }

    fn is_admissible(&self, index: usize, a_from_b: &Similarity) -> bool {
        self.matches[index].agrees_in_kind(a_from_b)
    }

    fn is_plausible(&self, a_from_b: &Similarity) -> bool {
        (self.scale_bounds.0..=self.scale_bounds.1).contains(&a_from_b.scale())
    }

    /// Orientations and scales are left to the refinement: a hypothesis is tested thousands of times.
    fn score(&self, a_from_b: &Similarity, tolerance_px: f64) -> Score {
        Score { inliers: count_within(&self.columns, a_from_b, tolerance_px), cost: 0.0 }
    }
}

/// The coordinates of the matches as columns, so that counting runs in vector registers.
struct Columns {
    a: [Vec<f32>; 2],
    b: [Vec<f32>; 2],
}

impl Columns {
    fn new(matches: &[KeypointMatch]) -> Self {
        let column = |value: fn(&KeypointMatch) -> f64| matches.iter().map(|m| value(m) as f32).collect();
        Self { a: [column(|m| m.a.x), column(|m| m.a.y)], b: [column(|m| m.b.x), column(|m| m.b.y)] }
    }

    /// How many residuals are at most `tolerance_px`.
    #[inline(always)]
    fn within(&self, a_from_b: &Similarity, tolerance_px: f64) -> usize {
        let square = (tolerance_px * tolerance_px) as f32;
        let [c, sine, tx, ty] = [a_from_b.c, a_from_b.s, a_from_b.t.x, a_from_b.t.y].map(|v| v as f32);
        let count = self.a[0].len();
        let [ax, ay, bx, by] = [&self.a[0], &self.a[1], &self.b[0], &self.b[1]].map(|column| &column[..count]);
        let mut within = 0u32;
        for i in 0..count {
            let x = c * bx[i] - sine * by[i] + tx - ax[i];
            let y = sine * bx[i] + c * by[i] + ty - ay[i];
            within += u32::from(x * x + y * y <= square);
        }
        within as usize
    }
}

dispatch! {
    fn count_within(columns: &Columns, a_from_b: &Similarity, tolerance_px: f64) -> usize {
        columns.within(a_from_b, tolerance_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::robust::Xorshift;

    #[test]
    fn both_twins_count_alike() {
        let truth = Similarity::about(0.9, 0.5, Vector2::new(256.0, 256.0), Vector2::new(200.0, 300.0));
        let mut draw = Xorshift::new(99);
        let mut point = || Vector2::new(draw.below(51_200) as f64 / 100.0, draw.below(51_200) as f64 / 100.0);
        let one = |i: usize| {
            let b = point();
            let a = if i < 37 { truth.apply(b) } else { point() };
            KeypointMatch { a, b, turn_rad: truth.rotation_rad(), scale: 1.0 }
        };
        let matches: Vec<_> = (0..137).map(one).collect();
        let columns = Columns::new(&matches);
        assert_eq!(count_within(&columns, &truth, 2.5), columns.within(&truth, 2.5));
        assert!(columns.within(&truth, 2.5) >= 37);
    }
}
