//! Plane polygons: intersection with axis-aligned rectangles, clipping, weighted areas, convex hulls.

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

    /// The rectangle grown by `margin` on each side.
    pub(super) fn grown(self, margin: f64) -> Self {
        Self { min: [self.min[0] - margin, self.min[1] - margin], max: [self.max[0] + margin, self.max[1] + margin] }
    }

    /// The corners, counterclockwise from the smallest coordinates.
    pub(super) fn corners(self) -> [Vertex; 4] {
        [self.min, [self.max[0], self.min[1]], self.max, [self.min[0], self.max[1]]]
    }

    /// The centre.
    pub(super) fn middle(self) -> Vertex {
        [(self.min[0] + self.max[0]) / 2.0, (self.min[1] + self.max[1]) / 2.0]
    }

    /// The common part; `None` where the interiors do not overlap.
    pub(super) fn intersection(self, other: Self) -> Option<Self> {
        let shared = Self {
            min: [self.min[0].max(other.min[0]), self.min[1].max(other.min[1])],
            max: [self.max[0].min(other.max[0]), self.max[1].min(other.max[1])],
        };
        (shared.min[0] < shared.max[0] && shared.min[1] < shared.max[1]).then_some(shared)
    }
}

/// Clips a ring (not closed, of either orientation) to a rectangle; empty where they do not meet. The result of a concave
/// ring may contain coincident edges along the rectangle's sides, which have no area.
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

/// Whether a ring and a rectangle share a point, edges included. The ring may be concave.
pub(super) fn touches(ring: &[Vertex], rectangle: Rectangle) -> bool {
    let mut corner_inside = false;
    for (i, &end) in ring.iter().enumerate() {
        let start = ring[(i + ring.len() - 1) % ring.len()];
        if enters(start, end, rectangle) {
            return true;
        }
        // Where no edge enters, the rectangle lies wholly inside or outside the ring, as its corner does.
        let corner = rectangle.min;
        if (start[1] > corner[1]) != (end[1] > corner[1]) {
            let x = start[0] + (corner[1] - start[1]) / (end[1] - start[1]) * (end[0] - start[0]);
            corner_inside ^= corner[0] < x;
        }
    }
    corner_inside
}

/// Whether a straight line from `start` to `end` has a point in a rectangle.
fn enters(start: Vertex, end: Vertex, rectangle: Rectangle) -> bool {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let along = end[axis] - start[axis];
        let (low, high) = (rectangle.min[axis] - start[axis], rectangle.max[axis] - start[axis]);
        if along == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
        } else {
            let (a, b) = (low / along, high / along);
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        }
    }
    from <= to
}

/// The parts of a ring inside a rectangle, each a ring of the same orientation. Unlike the result of [`clip`] they contain
/// no coincident edges.
pub(super) fn parts_inside(ring: &[Vertex], to: Rectangle) -> Vec<Vec<Vertex>> {
    [(0, to.min[0], 1.0), (0, to.max[0], -1.0), (1, to.min[1], 1.0), (1, to.max[1], -1.0)]
        .into_iter()
        .fold(vec![ring.to_vec()], |parts, (axis, limit, sign)| {
            parts.iter().flat_map(|part| parts_beside(part, axis, limit, sign)).collect()
        })
}

/// The parts of a ring on the side of a line where `sign * (coordinate - limit)` is not negative.
fn parts_beside(ring: &[Vertex], axis: usize, limit: f64, sign: f64) -> Vec<Vec<Vertex>> {
    let inside = |v: &Vertex| (v[axis] - limit) * sign >= 0.0;
    let Some(first) = ring.iter().position(|v| !inside(v)) else { return vec![ring.to_vec()] };
    // Runs of vertices inside, from crossing to crossing, starting outside.
    let mut runs: Vec<Vec<Vertex>> = Vec::new();
    for k in 0..ring.len() {
        let (start, end) = (ring[(first + k) % ring.len()], ring[(first + k + 1) % ring.len()]);
        if inside(&start) != inside(&end) {
            let t = (limit - start[axis]) / (end[axis] - start[axis]);
            let mut crossing = [start[0] + t * (end[0] - start[0]), start[1] + t * (end[1] - start[1])];
            crossing[axis] = limit;
            if inside(&end) {
                runs.push(vec![crossing, end]);
            } else {
                runs.last_mut().expect("the walk starts outside").push(crossing);
            }
        } else if inside(&end) {
            runs.last_mut().expect("the walk starts outside").push(end);
        }
    }
    joined(runs, 1 - axis)
}

/// Joins runs that start and end on a line into rings. Inside and outside alternate along the line, so crossings belong
/// together in pairs: the ring continues from the end of one run at the other crossing of its pair.
fn joined(runs: Vec<Vec<Vertex>>, along: usize) -> Vec<Vec<Vertex>> {
    let mut crossings: Vec<(f64, usize, bool)> = Vec::with_capacity(2 * runs.len());
    for (i, run) in runs.iter().enumerate() {
        crossings.extend([(run[0][along], i, true), (run[run.len() - 1][along], i, false)]);
    }
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut next = vec![None; runs.len()];
    for pair in crossings.chunks_exact(2) {
        // One run starts and one ends. Both start or both end only where crossings coincide: then each closes on itself.
        match (pair[0], pair[1]) {
            ((_, to, true), (_, from, false)) | ((_, from, false), (_, to, true)) => next[from] = Some(to),
            _ => {}
        }
    }
    let mut taken = vec![false; runs.len()];
    let mut rings = Vec::new();
    for start in 0..runs.len() {
        let (mut ring, mut at) = (Vec::new(), start);
        while !taken[at] {
            taken[at] = true;
            ring.extend_from_slice(&runs[at]);
            at = next[at].unwrap_or(at);
        }
        if !ring.is_empty() {
            rings.push(ring);
        }
    }
    rings
}

/// Writes the convex hull of points into `hull`, counterclockwise, without points on its sides. Sorts the points.
///
/// # References
/// A. M. Andrew, Another efficient algorithm for convex hulls in two dimensions, Inf. Process. Lett. 9 (1979).
pub(super) fn convex_hull(points: &mut [Vertex], hull: &mut Vec<Vertex>) {
    points.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turns_left =
        |a: Vertex, b: Vertex, c: Vertex| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
    hull.clear();
    let extend = |hull: &mut Vec<Vertex>, base: usize, point: Vertex| {
        while hull.len() >= base + 2 && !turns_left(hull[hull.len() - 2], hull[hull.len() - 1], point) {
            hull.pop();
        }
        hull.push(point);
    };
    for &point in points.iter() {
        extend(hull, 0, point);
    }
    let base = hull.len() - 1;
    for &point in points.iter().rev().skip(1) {
        extend(hull, base, point);
    }
    hull.pop();
}

/// The integral of `weight(y)` over the area of a ring, positive for a counterclockwise ring. Uses Green's theorem with five
/// Gauss points per edge, which is exact for weights of degree 8 in y.
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
    fn integrates_a_weight_that_depends_on_y() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert!((weighted_area(&square, |y| y) - 0.5).abs() < 1e-12);
        assert!((weighted_area(&square, |y| y.powi(7)) - 0.125).abs() < 1e-12);
    }

    /// A U, open above.
    const CUP: [Vertex; 8] =
        [[0.0, 0.0], [6.0, 0.0], [6.0, 5.0], [4.0, 5.0], [4.0, 2.0], [2.0, 2.0], [2.0, 5.0], [0.0, 5.0]];

    fn rectangle(min: Vertex, max: Vertex) -> Rectangle {
        Rectangle { min, max }
    }

    #[test]
    fn the_hollow_of_a_ring_does_not_touch() {
        assert!(!touches(&CUP, rectangle([2.5, 2.5], [3.5, 4.0])));
        assert!(!touches(&CUP, rectangle([2.5, 2.5], [3.5, 9.0])));
        assert!(touches(&CUP, rectangle([2.5, 1.5], [3.5, 4.0])));
        assert!(touches(&CUP, rectangle([0.5, 0.5], [0.6, 0.6])), "inside");
        assert!(touches(&CUP, rectangle([-9.0, -9.0], [9.0, 9.0])), "around");
        assert!(touches(&CUP, rectangle([6.0, 5.0], [7.0, 7.0])), "a corner shared");
        assert!(!touches(&CUP, rectangle([6.1, 0.0], [7.0, 7.0])));
    }

    #[test]
    fn a_cup_cut_across_is_two_rings() {
        let parts = parts_inside(&CUP, rectangle([-1.0, 3.0], [9.0, 9.0]));
        let areas: Vec<f64> = parts.iter().map(|p| weighted_area(p, |_| 1.0)).collect();
        assert!(areas.len() == 2 && areas.iter().all(|a| (a - 4.0).abs() < 1e-12), "{areas:?}");
        assert_eq!(parts_inside(&CUP, rectangle([-1.0, -1.0], [9.0, 1.0])).len(), 1);
        assert!(parts_inside(&CUP, rectangle([2.5, 3.0], [3.5, 9.0])).is_empty());
        assert_eq!(parts_inside(&CUP, rectangle([-9.0, -9.0], [9.0, 9.0])), [CUP.to_vec()]);
    }

    #[test]
    fn a_hull_leaves_out_what_lies_inside_and_on_sides() {
        let mut points = vec![[0.0, 0.0], [2.0, 2.0], [1.0, 0.0], [2.0, 0.0], [1.0, 0.5], [0.0, 2.0], [0.0, 2.0]];
        let mut hull = Vec::new();
        convex_hull(&mut points, &mut hull);
        assert_eq!(hull, [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
    }

    /// A star about the origin: a ring that may be as concave as you like.
    fn stars() -> impl Strategy<Value = Vec<Vertex>> {
        prop::collection::vec(0.2..3.0f64, 3..30).prop_map(|radii| {
            let n = radii.len() as f64;
            let bearing = |i: usize| std::f64::consts::TAU * i as f64 / n;
            radii.iter().enumerate().map(|(i, r)| [r * bearing(i).cos(), r * bearing(i).sin()]).collect()
        })
    }

    proptest! {
        #[test]
        fn what_shares_area_touches_and_what_does_not_is_apart(
            ring in stars(), x in -3.0..3.0f64, y in -3.0..3.0f64, width in 0.01..2.0f64, height in 0.01..2.0f64,
        ) {
            let around = rectangle([x, y], [x + width, y + height]);
            let shared = weighted_area(&clip(&ring, around), |_| 1.0);
            if shared > 1e-9 {
                prop_assert!(touches(&ring, around));
            } else {
                prop_assert!(!touches(&ring, rectangle([x + 1e-4, y + 1e-4], [x + width - 1e-4, y + height - 1e-4])));
            }
        }

        #[test]
        fn parts_share_out_what_clipping_leaves(
            ring in stars(), x in -3.0..3.0f64, y in -3.0..3.0f64, width in 0.01..3.0f64, height in 0.01..3.0f64,
        ) {
            let around = rectangle([x, y], [x + width, y + height]);
            let parts = parts_inside(&ring, around);
            let areas: Vec<f64> = parts.iter().map(|p| weighted_area(p, |_| 1.0)).collect();
            prop_assert!(areas.iter().all(|a| *a > -1e-12), "{areas:?}");
            prop_assert!((areas.iter().sum::<f64>() - weighted_area(&clip(&ring, around), |_| 1.0)).abs() < 1e-9);
            // No part goes along the same stretch of a side there and back.
            for part in &parts {
                let on_left: Vec<usize> = (0..part.len()).filter(|&i| part[i][0] == x && part[(i + 1) % part.len()][0] == x).collect();
                prop_assert!(on_left.iter().all(|&i| part[(i + 1) % part.len()][1] <= part[i][1]), "{part:?}");
            }
        }

        #[test]
        fn a_hull_holds_its_points(xs in prop::collection::vec((-5i8..5, -5i8..5), 3..20)) {
            let mut points: Vec<Vertex> = xs.iter().map(|(x, y)| [f64::from(*x), f64::from(*y)]).collect();
            let mut hull = Vec::new();
            convex_hull(&mut points, &mut hull);
            prop_assume!(hull.len() > 2);
            for p in &points {
                for (i, a) in hull.iter().enumerate() {
                    let b = hull[(i + 1) % hull.len()];
                    prop_assert!((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= 0.0);
                }
            }
        }

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
