//! Poses that an aircraft can reach after a flight of stated length with a smallest turn radius: the paths that bound the
//! reachable set, and a cover of their ends by convex polygons.
//!
//! Coordinates are right and ahead of the start, metres; headings are clockwise from the heading at the start.

use super::bearings::Bearings;
use super::polygon::{Rectangle, Vertex, convex_hull};
use std::f64::consts::{SQRT_2, TAU};

/// Position and heading of the aircraft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TurnPose {
    pub(super) right_m: f64,
    pub(super) ahead_m: f64,
    pub(super) heading_rad: f64,
}

impl TurnPose {
    /// The start of every flight.
    pub(super) const START: Self = Self { right_m: 0.0, ahead_m: 0.0, heading_rad: 0.0 };

    /// The pose after `length_m` at constant curvature: `turn` is 1 to the right or -1 to the left at `radius_m`, 0 straight.
    pub(super) fn after(self, turn: f64, length_m: f64, radius_m: f64) -> Self {
        let angle = if turn == 0.0 { 0.0 } else { turn * (length_m / radius_m) };
        // The chord, unlike R (1 - cos), keeps its digits where the radius is far larger than the length.
        let half = angle / 2.0;
        let chord_m = length_m * if half.abs() < 1e-5 { 1.0 - half * half / 6.0 } else { half.sin() / half };
        let (sin, cos) = (self.heading_rad + half).sin_cos();
        Self {
            right_m: self.right_m + chord_m * sin,
            ahead_m: self.ahead_m + chord_m * cos,
            heading_rad: self.heading_rad + angle,
        }
    }

    /// Corners of an image centred on this position with its length along the heading.
    pub(super) fn corners(self, across_m: f64, along_m: f64) -> [Vertex; 4] {
        let (sin, cos) = self.heading_rad.sin_cos();
        [(-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 1.0)].map(|(r, a)| {
            let (r, a) = (r * across_m / 2.0, a * along_m / 2.0);
            [self.right_m + r * cos + a * sin, self.ahead_m + a * cos - r * sin]
        })
    }
}

/// Three consecutive turns.
type Turns = [f64; 3];

/// The paths that bound the reachable set and turn right first. The other bounding paths are their mirror images.
///
/// # References
/// V. S. Patsko, S. G. Pyatko, A. A. Fedotov, Three-dimensional reachability set for a nonlinear control system, J.
/// Comput. Syst. Sci. Int. 42 (2003): every pose on the boundary of the set at a given time is reached with at most
/// two switches, by turn, straight, turn or by three turns to alternating sides. E. J. Cockayne, G. W. C. Hall, Plane motion
/// of a particle subject to curvature constraints, SIAM J. Control 13 (1975): the same for positions.
pub(super) const BOUNDING: [Turns; 3] = [[1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [1.0, -1.0, 1.0]];

/// Length in radii from which on the shortest path to every farther pose is a turn, a straight part and a turn, without a
/// full circle. A turn-straight-turn path to a pose within 6 R is at most 4 pi + 8 radii long; beyond 6 R the shortest path
/// has a straight part, and its length is continuous in the pose.
pub(super) const LONG: f64 = 2.0 * TAU + 8.0;

/// A flight and the image at its end.
#[derive(Debug, Clone, Copy)]
pub(super) struct TurningFlight {
    /// Length of the flight.
    pub(super) length_m: f64,
    /// Smallest turn radius.
    pub(super) radius_m: f64,
    /// Extent of the image across the heading at the end.
    pub(super) across_m: f64,
    /// Extent of the image along the heading at the end.
    pub(super) along_m: f64,
}

impl TurningFlight {
    /// Distance from the image's middle to its corners.
    pub(super) fn corner_m(self) -> f64 {
        self.across_m.hypot(self.along_m) / 2.0
    }

    /// Adds to `cover` the images at the ends of all paths of `turns` whose first and last turn are at most a circle, each
    /// grown by `border_m` on all four sides. Curves are followed to within `slack_m`, as far as 160 steps per circle
    /// allow.
    pub(super) fn add_to(self, cover: &mut Bearings, turns: Turns, border_m: f64, slack_m: f64) {
        let grid = Grid::new(self, turns, slack_m);
        let border_m = border_m + grid.slack_m;
        let (mut before, mut after) = (grid.row(self, turns, 0), Vec::new());
        let (mut points, mut hull) = (Vec::with_capacity(16), Vec::with_capacity(16));
        for i in 0..grid.cells {
            std::mem::swap(&mut before, &mut after);
            let (near, far) = (&after, grid.row(self, turns, i + 1));
            for j in 0..far.len().min(near.len() - 1) {
                // Where the whole flight is turning, the last cell of a row is the triangle left of the diagonal.
                let cell = [Some(&near[j]), Some(&near[j + 1]), Some(&far[j]), far.get(j + 1)];
                let middle = near[j].middle();
                let radius_m = cell.iter().flatten().map(|image| image.farthest_from(middle)).fold(0.0, f64::max);
                if !cover.has_disc(middle, radius_m + SQRT_2 * border_m) {
                    points.clear();
                    points.extend(cell.into_iter().flatten().flat_map(|image| image.corners));
                    convex_hull(&mut points, &mut hull);
                    cover.add(&grown(&hull, border_m));
                }
            }
            before = far;
        }
    }
}

/// The corners of an image on the ground.
#[derive(Debug, Clone, Copy)]
struct ImageCorners {
    corners: [Vertex; 4],
}

impl ImageCorners {
    fn middle(&self) -> Vertex {
        let [a, _, c, _] = self.corners;
        [(a[0] + c[0]) / 2.0, (a[1] + c[1]) / 2.0]
    }

    fn farthest_from(&self, point: Vertex) -> f64 {
        self.corners.iter().map(|c| (c[0] - point[0]).hypot(c[1] - point[1])).fold(0.0, f64::max)
    }
}

/// A grid over the lengths of the first and the last turn in equal steps.
#[derive(Debug, Clone, Copy)]
struct Grid {
    step_m: f64,
    /// Number of cells of either turn.
    cells: usize,
    /// Number of steps of the whole length, where first + last = whole length bounds the grid.
    diagonal: Option<usize>,
    /// Largest distance of a point of an image from the hull of that point's positions at the corners of the cell.
    slack_m: f64,
}

impl Grid {
    const MOST: f64 = 160.0;

    fn new(flight: TurningFlight, turns: Turns, slack_m: f64) -> Self {
        let TurningFlight { length_m, radius_m, .. } = flight;
        // Moving switch i by an angle d turns the rest of the path about it by k_i d, so q moves by k_i d |q - p_i|. The
        // second derivatives are at most k_i k_j |q - p_j| (+ k_i R for i = j, because p_i itself moves).
        let kinks = [(turns[0] - turns[1]).abs(), (turns[1] - turns[2]).abs()];
        let corner_m = flight.corner_m();
        let middle_m = if turns[1] == 0.0 { length_m } else { length_m.min(2.0 * radius_m) };
        let last_m = length_m.min(2.0 * radius_m) + corner_m;
        let first_m = (middle_m + last_m).min(length_m + corner_m);
        let bend_m = kinks[0] * (kinks[0] * first_m + radius_m)
            + 2.0 * kinks[0] * kinks[1] * last_m
            + kinks[1] * (kinks[1] * last_m + radius_m);
        // Linear interpolation on a cell of angle d errs by at most (M11 + 2 M12 + M22) d^2 / 8.
        let turn_rad = (length_m / radius_m).min(TAU);
        // Sides that turn about their middle span a wedge, and the hull of a cell makes a rectangle of the wedge. That shows
        // where the whole flight turns so little that the outline follows the sides of images. More than 64 steps gain
        // little.
        let wedges = (turn_rad * flight.corner_m() / (2.0 * slack_m)).min(64.0);
        let steps = (turn_rad / (8.0 * slack_m / bend_m).sqrt()).max(wedges).ceil().clamp(4.0, Self::MOST);
        if length_m >= LONG * radius_m {
            let (cells, angle_rad) = (steps as usize, TAU / steps);
            return Self {
                step_m: angle_rad * radius_m,
                cells,
                diagonal: None,
                slack_m: bend_m * angle_rad * angle_rad / 8.0,
            };
        }
        let circles = length_m / radius_m / TAU;
        let diagonal = if circles > 1.0 { (steps * circles).ceil() } else { steps };
        let step_m = length_m / diagonal;
        let cells = ((length_m.min(TAU * radius_m) / step_m) * (1.0 - 1e-12)).ceil();
        let angle_rad = step_m / radius_m;
        Self {
            step_m,
            cells: cells as usize,
            diagonal: Some(diagonal as usize),
            slack_m: bend_m * angle_rad * angle_rad / 8.0,
        }
    }

    /// The image's corners where the first turn has `i` steps, indexed by the steps of the last turn.
    fn row(self, flight: TurningFlight, turns: Turns, i: usize) -> Vec<ImageCorners> {
        let TurningFlight { length_m, radius_m, across_m, along_m } = flight;
        let last = self.diagonal.map_or(self.cells, |all| self.cells.min(all - i));
        let (step_m, first_m) = (self.step_m, i as f64 * self.step_m);
        let turned = TurnPose::START.after(turns[0], first_m, radius_m);
        (0..=last)
            .map(|j| {
                let last_m = j as f64 * step_m;
                let middle_m = (length_m - first_m - last_m).max(0.0);
                let end = turned.after(turns[1], middle_m, radius_m).after(turns[2], last_m, radius_m);
                ImageCorners { corners: end.corners(across_m, along_m) }
            })
            .collect()
    }
}

/// Dilates a convex, counterclockwise polygon by a square of edge 2 `border_m`: each vertex becomes the corners that lie
/// farthest out between the normals of its sides.
fn grown(polygon: &[Vertex], border_m: f64) -> Vec<Vertex> {
    const CORNERS: [Vertex; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    // The corner farthest along the outward normal (y, -x) of a side.
    let farthest = |start: Vertex, end: Vertex| match [end[1] - start[1], start[0] - end[0]] {
        [x, y] if x < 0.0 && y <= 0.0 => 0,
        [x, y] if x >= 0.0 && y < 0.0 => 1,
        [x, y] if x > 0.0 && y >= 0.0 => 2,
        _ => 3,
    };
    let n = polygon.len();
    if n < 3 {
        // Rounding has collapsed the image, and it has no sides.
        let around = Rectangle::around(polygon).expect("a hull has vertices").grown(border_m);
        return around.corners().to_vec();
    }
    let mut ring = Vec::with_capacity(n + 4);
    let mut corner = farthest(polygon[n - 1], polygon[0]);
    for i in 0..n {
        let v = polygon[i];
        let next = farthest(v, polygon[(i + 1) % n]);
        loop {
            let [x, y] = CORNERS[corner];
            ring.push([v[0] + x * border_m, v[1] + y * border_m]);
            if corner == next {
                break;
            }
            corner = (corner + 1) % 4;
        }
    }
    ring
}

#[cfg(test)]
mod tests {
    use super::super::reachable::tests::fly;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_pose_goes_round_a_circle(length_m in 0.0..1e4f64, radius_m in 10.0..1e4f64, first in -1i8..=1, second in -1i8..=1) {
            let turns = [f64::from(first), f64::from(second)];
            let end = turns.iter().fold(TurnPose::START, |pose, &turn| pose.after(turn, length_m / 2.0, radius_m));
            let flight = TurningFlight { length_m, radius_m, across_m: 1.0, along_m: 1.0 };
            let (at, heading_rad) = fly(&turns.map(|turn| (turn, 0.5)), flight);
            prop_assert!((end.right_m - at[0]).hypot(end.ahead_m - at[1]) < 1e-8 * (length_m + radius_m));
            prop_assert!((end.heading_rad - heading_rad).abs() < 1e-9);
        }

        #[test]
        fn a_grown_polygon_is_the_hull_of_squares_about_its_vertices(
            angles in prop::collection::btree_set(0u16..360, 3..12), border in 0.0..20.0f64,
        ) {
            let polygon: Vec<Vertex> =
                angles.iter().map(|a| f64::from(*a).to_radians().sin_cos()).map(|(sin, cos)| [9.0 * cos, 5.0 * sin]).collect();
            let mut corners: Vec<Vertex> = polygon
                .iter()
                .flat_map(|v| [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|c| [v[0] + c[0] * border, v[1] + c[1] * border]))
                .collect();
            let mut hull = Vec::new();
            convex_hull(&mut corners, &mut hull);
            let area = |ring: &[Vertex]| super::super::polygon::weighted_area(ring, |_| 1.0);
            let grown = grown(&polygon, border);
            prop_assert!((area(&grown) - area(&hull)).abs() < 1e-9 * (1.0 + area(&hull)));
            for v in &hull {
                let near = grown.iter().any(|g| (g[0] - v[0]).hypot(g[1] - v[1]) < 1e-9);
                prop_assert!(near, "{v:?} is missing");
            }
        }
    }

    #[test]
    fn a_half_circle_to_the_right_ends_two_radii_aside() {
        let end = TurnPose::START.after(1.0, 50.0 * std::f64::consts::PI, 50.0);
        assert!((end.right_m - 100.0).abs() < 1e-9 && end.ahead_m.abs() < 1e-9);
        let [front_left, ..] = end.corners(20.0, 30.0);
        // Flying back, the left is on the right of the start's heading.
        assert!((front_left[0] - 110.0).abs() < 1e-9 && (front_left[1] + 15.0).abs() < 1e-9);
    }
}
