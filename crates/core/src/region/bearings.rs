//! `Bearings`: a set of ground as a range of distances on each bearing from a point.
//!
//! Everything between the nearest and the farthest distance counts as covered. So the outline is never too small, and it is
//! always one simple polygon.

use super::polygon::Vertex;
use std::f64::consts::PI;

/// The right half, from straight ahead to straight behind, of a set that is symmetric about x = 0.
///
/// Between two steps the set reaches at least from the chord of the nearest to the chord of the farthest distances. The
/// covered bearings are contiguous and begin straight ahead. Distances are stored as inverses, because 1 / r along a
/// straight side is linear in the sine and cosine of the bearing.
#[derive(Debug, Clone)]
pub(super) struct Bearings {
    /// Sine and cosine of each step's bearing.
    sines: Vec<f64>,
    cosines: Vec<f64>,
    /// One over the nearest distance on each step's bearing, 0 on a bearing that is not covered.
    near: Vec<f64>,
    /// One over the farthest distance, infinite on a bearing that is not covered.
    far: Vec<f64>,
    /// Half of the steps lie up to this bearing.
    focus_rad: f64,
    /// Whether all nearer ground counts as covered: a set that goes all around encloses it.
    filled: bool,
}

/// A vertex of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OutlineVertex {
    pub(super) at: Vertex,
    /// Whether the vertex ends the covered bearings: the outline continues towards the origin, or away from it.
    pub(super) ends: bool,
}

impl Bearings {
    /// Number of steps on each side of the focus.
    const HALF: usize = 512;

    /// Makes an empty set. Half of the steps lie up to `focus_rad`, which should be about the bearing at which the set ends.
    pub(super) fn focused(focus_rad: f64) -> Self {
        let focus_rad = if focus_rad < PI { focus_rad } else { PI / 2.0 };
        let bearing_rad = |i: usize| match i.checked_sub(Self::HALF) {
            None => focus_rad * i as f64 / Self::HALF as f64,
            Some(k) => focus_rad + (PI - focus_rad) * k as f64 / Self::HALF as f64,
        };
        let (sines, cosines): (Vec<f64>, Vec<f64>) = (0..=2 * Self::HALF).map(|i| bearing_rad(i).sin_cos()).unzip();
        let (near, far) = (vec![0.0; sines.len()], vec![f64::INFINITY; sines.len()]);
        Self { sines, cosines, near, far, focus_rad, filled: false }
    }

    /// Adds a convex polygon and its mirror image.
    pub(super) fn add(&mut self, polygon: &[Vertex]) {
        let mut start = PolarPoint::from(polygon[polygon.len() - 1]);
        for &vertex in polygon {
            let end = PolarPoint::from(vertex);
            if start.at[0] * end.at[0] < 0.0 {
                let t = start.at[0] / (start.at[0] - end.at[0]);
                let cut = PolarPoint::from([0.0, start.at[1] + t * (end.at[1] - start.at[1])]);
                self.add_side(start, cut);
                self.add_side(cut, end);
            } else {
                self.add_side(start, end);
            }
            start = end;
        }
    }

    /// Counts all ground nearer than the farthest distances as covered.
    pub(super) fn fill(&mut self) {
        self.filled = true;
    }

    /// Whether the set already covers a disc.
    pub(super) fn has_disc(&self, centre: Vertex, radius: f64) -> bool {
        let PolarPoint { bearing_rad, inverse, .. } = PolarPoint::from(centre);
        let distance = inverse.recip();
        let (first, last) = if radius >= distance {
            (0, self.far.len() - 1)
        } else {
            let half_rad = (radius / distance).asin();
            (self.step_before((bearing_rad - half_rad).max(0.0)), self.step_before(bearing_rad + half_rad) + 1)
        };
        let last = last.min(self.far.len() - 1);
        let far = ((distance + radius) * CHORD).recip();
        let near = (distance - radius).recip();
        self.far[first..=last].iter().all(|&r| r <= far)
            && (self.filled || (near > 0.0 && self.near[first..=last].iter().all(|&r| r >= near)))
    }

    /// The smallest of the farthest distances over all bearings.
    pub(super) fn covered_radius(&self) -> f64 {
        self.far.iter().fold(0.0f64, |most, &r| most.max(r)).recip()
    }

    /// The outline of both halves, counterclockwise.
    pub(super) fn outline(&self) -> Vec<OutlineVertex> {
        let last = self.far.iter().rposition(|r| r.is_finite()).unwrap_or(0);
        let filled = self.filled || last + 1 == self.far.len();
        let vertex = |i: usize, inverse: f64, side: f64| {
            let at = [side * self.sines[i] / inverse, self.cosines[i] / inverse];
            OutlineVertex { at, ends: !filled && i == last }
        };
        // Both halves share the vertex straight ahead, and in a filled set the one straight behind.
        let right = (0..=last).rev().map(|i| vertex(i, self.far[i], 1.0));
        let outer = right.chain((1..last + usize::from(!filled)).map(|i| vertex(i, self.far[i], -1.0)));
        if filled {
            return outer.collect();
        }
        let inner = (0..=last).rev().map(|i| vertex(i, self.near[i], -1.0));
        let inner = inner.chain((1..=last).map(|i| vertex(i, self.near[i], 1.0)));
        outer.chain(inner).collect()
    }

    /// The last step at or before a bearing in [0, pi].
    fn step_before(&self, bearing_rad: f64) -> usize {
        let half = Self::HALF as f64;
        let step = if bearing_rad < self.focus_rad {
            half * bearing_rad / self.focus_rad
        } else {
            half + half * (bearing_rad - self.focus_rad) / (PI - self.focus_rad)
        };
        (step as usize).min(self.far.len() - 1)
    }

    /// Adds a side that does not cross x = 0, mirrored to the right if it lies on the left.
    fn add_side(&mut self, start: PolarPoint, end: PolarPoint) {
        let (a, b) = if start.bearing_rad <= end.bearing_rad { (start, end) } else { (end, start) };
        // A side that reaches straight behind completes the circle, which encloses all nearer ground. The origin itself has
        // no bearing.
        self.filled |= b.bearing_rad == PI || !(start.inverse + end.inverse).is_finite();
        let (first, last) = (self.step_before(a.bearing_rad), self.step_before(b.bearing_rad));
        let (at_a, at_b) = (a.inverse, b.inverse);
        for (step, inverse) in [(first, at_a), (last, at_b)] {
            for i in [step, (step + 1).min(self.far.len() - 1)] {
                // A chord between two steps clears a vertex between them if its middle does.
                self.far[i] = self.far[i].min(inverse / CHORD);
                self.near[i] = self.near[i].max(inverse);
            }
        }
        let (a, b) = ([a.at[0].abs(), a.at[1]], [b.at[0].abs(), b.at[1]]);
        let doubled = a[0] * b[1] - a[1] * b[0];
        let (by_sine, by_cosine) = ((b[1] - a[1]) / doubled, (a[0] - b[0]) / doubled);
        // Of a side that points at the origin only the ends count.
        if first == last || !(by_sine.is_finite() && by_cosine.is_finite()) {
            return;
        }
        let farthest = at_a.min(at_b);
        let between = first + 1..=last;
        let steps = self.sines[between.clone()].iter().zip(&self.cosines[between.clone()]);
        let seen = self.near[between.clone()].iter_mut().zip(&mut self.far[between]);
        for ((sin, cos), (near, far)) in steps.zip(seen) {
            let inverse = by_sine * sin + by_cosine * cos;
            let bounded = if inverse > farthest { inverse } else { farthest };
            *far = if bounded < *far { bounded } else { *far };
            *near = if inverse > *near { inverse } else { *near };
        }
    }
}

/// Factor over a vertex's distance at which both ends of a chord around the vertex clear it: half a step is at most
/// pi / 1024, and its cosine is above 1 - 4.8e-6.
const CHORD: f64 = 1.0 + 5e-6;

/// A point in polar form about the origin.
#[derive(Debug, Clone, Copy)]
struct PolarPoint {
    at: Vertex,
    /// Angle from straight ahead to either side, in [0, pi].
    bearing_rad: f64,
    /// One over the distance.
    inverse: f64,
}

impl From<Vertex> for PolarPoint {
    fn from(at: Vertex) -> Self {
        Self { at, bearing_rad: at[0].abs().atan2(at[1]), inverse: at[0].hypot(at[1]).recip() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::polygon::{Rectangle, touches, weighted_area};
    use super::*;
    use proptest::prelude::*;

    fn outline(pieces: &[Vec<Vertex>]) -> Vec<Vertex> {
        let mut bearings = Bearings::focused(1.0);
        pieces.iter().for_each(|piece| bearings.add(piece));
        bearings.outline().iter().map(|v| v.at).collect()
    }

    fn square(x: f64, y: f64, half: f64) -> Vec<Vertex> {
        vec![[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]]
    }

    fn holds(outline: &[Vertex], x: f64, y: f64) -> bool {
        touches(outline, Rectangle { min: [x, y], max: [x, y] })
    }

    #[test]
    fn a_square_ahead_is_outlined_from_its_far_to_its_near_side() {
        let outline = outline(&[square(0.0, 10.0, 1.0)]);
        let area = weighted_area(&outline, |_| 1.0);
        // Within its bearings, atan(1 / 9) to either side, all between the near and the far side: the rays beside the
        // far corners (atan(1 / 11)) are cut short by the sides, which point away.
        assert!((4.0..4.03).contains(&area), "{area}");
        assert!(holds(&outline, 0.0, 9.0) && holds(&outline, 0.0, 11.0) && !holds(&outline, 0.0, 8.9));
        assert!(!holds(&outline, 0.0, 0.0));
    }

    #[test]
    fn what_goes_all_around_holds_what_it_encloses() {
        let around: Vec<Vec<Vertex>> = (0..=24)
            .map(|i| f64::from(i).to_radians() * 7.5)
            .map(|bearing| square(10.0 * bearing.sin(), 10.0 * bearing.cos(), 1.0))
            .collect();
        let outline = outline(&around);
        assert!(holds(&outline, 0.0, 0.0) && holds(&outline, 5.0, -5.0) && holds(&outline, -5.0, 5.0));
        assert!(weighted_area(&outline, |_| 1.0) > std::f64::consts::PI * 100.0);
        // One square less, and it is open behind.
        let mut bearings = Bearings::focused(3.0);
        around[..24].iter().for_each(|piece| bearings.add(piece));
        let open: Vec<Vertex> = bearings.outline().iter().map(|v| v.at).collect();
        assert!(!holds(&open, 0.0, 0.0) && !holds(&open, 0.0, -10.0) && holds(&open, 10.0, 0.0));
    }

    proptest! {
        #[test]
        fn an_outline_holds_each_piece_and_its_mirror_image(
            size in 1.0..40.0f64, far in 0.0..60.0f64, turns in prop::collection::vec(-0.4..0.4f64, 1..30), focus in 0.1..4.0f64,
            at in (-1.0..=1.0f64, -1.0..=1.0f64),
        ) {
            // Squares along a path that begins straight ahead, each overlapping the one before.
            let (mut middle, mut heading) = ([0.0, far], 0.0f64);
            let mut bearings = Bearings::focused(focus);
            let mut middles = vec![middle];
            for turn in turns {
                heading += turn;
                middle = [middle[0] + size / 2.0 * heading.sin(), middle[1] + size / 2.0 * heading.cos()];
                middles.push(middle);
            }
            for m in &middles {
                bearings.add(&square(m[0], m[1], size / 2.0));
            }
            let outline: Vec<Vertex> = bearings.outline().iter().map(|v| v.at).collect();
            prop_assert!(weighted_area(&outline, |_| 1.0) > 0.0, "not counterclockwise");
            for m in &middles {
                let (x, y) = (m[0] + at.0 * size / 2.0 * (1.0 - 1e-9), m[1] + at.1 * size / 2.0 * (1.0 - 1e-9));
                prop_assert!(holds(&outline, x, y) && holds(&outline, -x, y), "{x} {y}");
                prop_assert!(bearings.has_disc([x, y], 0.0) || !bearings.has_disc([x, y], size));
            }
        }

        #[test]
        fn a_disc_that_it_has_lies_inside(x in -30.0..30.0f64, y in -30.0..30.0f64, radius in 0.1..15.0f64, far in -4.0..30.0f64) {
            let mut bearings = Bearings::focused(1.5);
            bearings.add(&square(0.0, far, 12.0));
            if bearings.has_disc([x, y], radius) {
                let outline: Vec<Vertex> = bearings.outline().iter().map(|v| v.at).collect();
                for i in 0..64 {
                    let (sin, cos) = (f64::from(i) * 0.0981747).sin_cos();
                    prop_assert!(holds(&outline, x + radius * sin, y + radius * cos));
                }
            }
        }
    }
}
