//! The edge of a region in the local plane, as pieces of curves.

use super::normal::PlaneNormal;
use super::polygon::Vertex;
use crate::geodesy::{BodyFrame, BodyOffset, Enu};
use std::f64::consts::TAU;

/// One piece of a closed, counterclockwise edge. Points are offsets east and north, metres.
#[derive(Debug, Clone, Copy)]
pub(super) enum EdgePiece {
    /// A straight side.
    Straight {
        /// Its start.
        start: Vertex,
        /// Its end.
        end: Vertex,
    },
    /// An arc, between two whitened angles, of the ellipse of `sigmas` standard deviations of `normal` about `centre`.
    Arc { centre: Vertex, normal: PlaneNormal, sigmas: f64, from_rad: f64, to_rad: f64 },
}

impl EdgePiece {
    /// The point at `s` in [0, 1].
    pub(super) fn at(self, s: f64) -> Vertex {
        match self {
            Self::Straight { start, end } => [start[0] + s * (end[0] - start[0]), start[1] + s * (end[1] - start[1])],
            Self::Arc { centre, normal, sigmas, from_rad, to_rad } => {
                let (sin, cos) = (from_rad + s * (to_rad - from_rad)).sin_cos();
                let offset = normal.offset(sigmas * cos, sigmas * sin);
                [centre[0] + offset[0], centre[1] + offset[1]]
            }
        }
    }
}

/// Corners of a rectangle about the origin, counterclockwise: front left, back left, back right, front right. Its length
/// points along `heading_rad`, clockwise from north.
pub(super) fn corners(width_m: f64, length_m: f64, heading_rad: f64) -> [Vertex; 4] {
    let frame = BodyFrame::from_heading_rad(heading_rad);
    let at = |right: f64, ahead: f64| turned(frame, [right * width_m / 2.0, ahead * length_m / 2.0]);
    [at(-1.0, 1.0), at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0)]
}

/// The edge of a rectangle.
pub(super) fn rectangle(width_m: f64, length_m: f64, heading_rad: f64) -> Vec<EdgePiece> {
    let corners = corners(width_m, length_m, heading_rad);
    (0..4).map(|i| EdgePiece::Straight { start: corners[i], end: corners[(i + 1) % 4] }).collect()
}

/// The edge of a polygon whose vertices are offsets right and ahead of the centre under a heading.
pub(super) fn polygon(vertices: &[Vertex], heading_rad: f64) -> Vec<EdgePiece> {
    let frame = BodyFrame::from_heading_rad(heading_rad);
    let corner = |i: usize| turned(frame, vertices[i % vertices.len()]);
    (0..vertices.len()).map(|i| EdgePiece::Straight { start: corner(i), end: corner(i + 1) }).collect()
}

/// Rotates an offset right and ahead to east and north.
fn turned(frame: BodyFrame, [right_m, ahead_m]: Vertex) -> Vertex {
    let Enu { east_m, north_m } = frame.enu_from_body(BodyOffset { right_m, ahead_m });
    [east_m, north_m]
}

/// The edge of the ellipse of `sigmas` standard deviations dilated by a rectangle: four arcs about the rectangle's
/// corners, joined by its sides.
pub(super) fn dilated_ellipse(
    normal: PlaneNormal,
    sigmas: f64,
    width_m: f64,
    length_m: f64,
    heading_rad: f64,
) -> Vec<EdgePiece> {
    let corners = corners(width_m, length_m, heading_rad);
    let (sin, cos) = heading_rad.sin_cos();
    // Outward normals of the sides, in the order in which they start at each corner: left, back, right, front.
    let normals = [[-cos, sin], [-sin, -cos], [cos, -sin], [sin, cos]];
    let angles = normals.map(|n| {
        let w = normal.whitened_normal(n);
        w[1].atan2(w[0])
    });
    let mut pieces = Vec::with_capacity(8);
    for i in 0..4 {
        // At corner i the normal turns from the side before to the side after.
        let from_rad = angles[(i + 3) % 4];
        let to_rad = from_rad + (angles[i] - from_rad).rem_euclid(TAU);
        let arc = |centre| EdgePiece::Arc { centre, normal, sigmas, from_rad, to_rad };
        let next_start = {
            let (sin, cos) = to_rad.sin_cos();
            let offset = normal.offset(sigmas * cos, sigmas * sin);
            let next = corners[(i + 1) % 4];
            [next[0] + offset[0], next[1] + offset[1]]
        };
        let here = arc(corners[i]);
        pieces.push(here);
        pieces.push(EdgePiece::Straight { start: here.at(1.0), end: next_start });
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::super::polygon::weighted_area;
    use super::*;

    fn area(pieces: &[EdgePiece]) -> f64 {
        let ring: Vec<Vertex> = pieces.iter().flat_map(|p| (0..200).map(move |i| p.at(f64::from(i) / 200.0))).collect();
        weighted_area(&ring, |_| 1.0)
    }

    #[test]
    fn the_front_edge_lies_ahead() {
        let [front_left, ..] = corners(2.0, 4.0, std::f64::consts::FRAC_PI_2);
        // Heading east: the front is east, the left is north.
        assert!((front_left[0] - 2.0).abs() < 1e-12 && (front_left[1] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn areas_are_those_of_minkowski_sums() {
        assert!((area(&rectangle(3.0, 5.0, 0.7)) - 15.0).abs() < 1e-9);
        // A disc of radius 2 and a 3 x 5 rectangle: 4 pi + 15 + 2 * 2 * (3 + 5).
        let disc = dilated_ellipse(PlaneNormal::new(1.0, 1.0, 0.0), 2.0, 3.0, 5.0, 0.7);
        assert!((area(&disc) - (4.0 * std::f64::consts::PI + 15.0 + 32.0)).abs() < 1e-2);
    }

    #[test]
    fn a_closed_edge_has_no_gaps() {
        let pieces = dilated_ellipse(PlaneNormal::new(30.0, 5.0, -0.9), 3.0, 3.0, 5.0, 4.0);
        for i in 0..pieces.len() {
            let (end, start) = (pieces[i].at(1.0), pieces[(i + 1) % pieces.len()].at(0.0));
            assert!((end[0] - start[0]).hypot(end[1] - start[1]) < 1e-9);
        }
    }
}
