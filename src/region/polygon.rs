//! Plane polygons against axis-aligned rectangles: clipping and weighted area.

/// A point or offset of the plane, x east, y north.
pub(super) type Vertex = [f64; 2];

/// An axis-aligned rectangle of the same plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rectangle {
    pub(super) min: Vertex,
    pub(super) max: Vertex,
}

impl Rectangle {
    /// The smallest one around `points`; `None` without points.
    pub(super) fn around(points: &[Vertex]) -> Option<Self> {
        let first = *points.first()?;
        Some(points.iter().fold(Self { min: first, max: first }, |r, p| Self {
            min: [r.min[0].min(p[0]), r.min[1].min(p[1])],
            max: [r.max[0].max(p[0]), r.max[1].max(p[1])],
        }))
    }

    /// Grown by `margin` on each side.
    pub(super) fn grown(self, margin: f64) -> Self {
        Self { min: [self.min[0] - margin, self.min[1] - margin], max: [self.max[0] + margin, self.max[1] + margin] }
    }

    /// What both share; `None` where their interiors do not meet.
    pub(super) fn intersection(self, other: Self) -> Option<Self> {
        let shared = Self {
            min: [self.min[0].max(other.min[0]), self.min[1].max(other.min[1])],
            max: [self.max[0].min(other.max[0]), self.max[1].min(other.max[1])],
        };
        (shared.min[0] < shared.max[0] && shared.min[1] < shared.max[1]).then_some(shared)
    }
}

/// The part of a ring (not closed, either turn) inside a rectangle; empty where they do not meet. A concave ring may
/// come back with coincident edges along the rectangle's sides, which have no area.
///
/// # References
/// I. E. Sutherland, G. W. Hodgman, Reentrant polygon clipping, CACM 17 (1974).
pub(super) fn clip(ring: &[Vertex], to: Rectangle) -> Vec<Vertex> {
    let mut current = ring.to_vec();
    let mut next = Vec::with_capacity(ring.len() + 4);
    for (axis, limit, sign) in [(0, to.min[0], 1.0), (0, to.max[0], -1.0), (1, to.min[1], 1.0), (1, to.max[1], -1.0)] {
        next.clear();
        for (i, &end) in current.iter().enumerate() {
            let start = current[(i + current.len() - 1) % current.len()];
            let (from, at) = ((start[axis] - limit) * sign, (end[axis] - limit) * sign);
            if (from < 0.0) != (at < 0.0) {
                let t = from / (from - at);
                let mut crossing = [start[0] + t * (end[0] - start[0]), start[1] + t * (end[1] - start[1])];
                crossing[axis] = limit;
                next.push(crossing);
            }
            if at >= 0.0 {
                next.push(end);
            }
        }
        std::mem::swap(&mut current, &mut next);
    }
    current
}

/// Integral of `weight(y)` over the area of a ring, positive where it turns counterclockwise.
/// By Green's theorem, five Gauss points an edge: exact for weights of degree 8 in y.
pub(super) fn weighted_area(ring: &[Vertex], weight: impl Fn(f64) -> f64) -> f64 {
    let mut area = 0.0;
    for (i, &end) in ring.iter().enumerate() {
        let start = ring[(i + ring.len() - 1) % ring.len()];
        let dy = end[1] - start[1];
        if dy != 0.0 {
            let x_and_y = |s: f64| (start[0] + s * (end[0] - start[0]), start[1] + s * dy);
            area += dy
                * GAUSS_LEGENDRE
                    .iter()
                    .map(|&(s, w)| {
                        let (x, y) = x_and_y(s);
                        w * x * weight(y)
                    })
                    .sum::<f64>();
        }
    }
    area
}

/// Nodes and weights on [0, 1], five points (Abramowitz and Stegun, table 25.4).
pub(super) const GAUSS_LEGENDRE: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const UNIT: Rectangle = Rectangle { min: [0.0, 0.0], max: [1.0, 1.0] };

    #[test]
    fn clips_a_diamond_to_the_corner_it_shares() {
        let diamond = [[1.0, -1.0], [3.0, 1.0], [1.0, 3.0], [-1.0, 1.0]];
        let inside = clip(&diamond, UNIT);
        assert!((weighted_area(&inside, |_| 1.0) - 1.0).abs() < 1e-12);
        let away = Rectangle { min: [2.5, 2.5], max: [3.0, 3.0] };
        assert!(clip(&diamond, away).is_empty());
    }

    #[test]
    fn weighs_by_height() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert!((weighted_area(&square, |y| y) - 0.5).abs() < 1e-12);
        assert!((weighted_area(&square, |y| y.powi(7)) - 0.125).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn quarters_of_the_plane_share_out_a_triangle(p in prop::array::uniform6(-2.0..2.0f64)) {
            let ring = [[p[0], p[1]], [p[2], p[3]], [p[4], p[5]]];
            let whole = weighted_area(&ring, |_| 1.0);
            let parts: f64 = [([-9.0, -9.0], [0.0, 0.0]), ([0.0, -9.0], [9.0, 0.0]), ([-9.0, 0.0], [0.0, 9.0]), ([0.0, 0.0], [9.0, 9.0])]
                .map(|(min, max)| weighted_area(&clip(&ring, Rectangle { min, max }), |_| 1.0)).iter().sum();
            prop_assert!((whole - parts).abs() < 1e-9);
        }
    }
}
