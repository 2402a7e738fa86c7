//! `Region`: the ground to search, with tests of tiles against it.

use super::error::{MAX_REACH_M, RegionError, check};
use super::normal::{PlaneNormal, REACH_SIGMA, edge_probability};
use super::outline::{EdgePiece, dilated_ellipse, polygon, rectangle};
use super::polygon::{Rectangle, Vertex, clip, parts_inside, touches, weighted_area};
use super::reachable::reachable_outline;
use super::turns::TurningFlight;
use super::uncertainty::{ImageOnGround, Uncertainty};
use crate::coupling::{DriftGrowth, nominal_count_combined, nominal_count_sequential, region_edges_m};
use crate::geodesy::{
    Enu, Geodetic, LocalFrame, MercatorPoint, SEMI_MAJOR_M, WORLD_M, degrees_from_mercator, ground_scale,
};
use crate::tile::MercatorBounds;
use std::f64::consts::{PI, SQRT_2, TAU};

/// Standard deviations of the 99.7 % ellipse of a plane normal distribution: sqrt(-2 ln 0.003).
pub const SIGMAS: f64 = 3.408_560_690_471_574;

/// Pieces of the edge are halved until they are straight to this part of the region's extent, at most `MAX_HALVINGS` times.
const STRAIGHTNESS: f64 = 1e-4;
const MAX_HALVINGS: u32 = 6;

/// A region on the ground. In a sequential, parallel or combined region the image's centre is uniformly distributed. The
/// region of a covariance is the 99.7 % ellipse dilated by the image's footprint, and the image's centre is normally
/// distributed.
#[derive(Debug, Clone)]
pub struct Region {
    centre: MercatorPoint,
    frame: LocalFrame,
    /// The edge, counterclockwise, Mercator metres from `centre`; straight between vertices to within `margin_m`.
    ring: Vec<Vertex>,
    margin_m: f64,
    /// The middle of the region, Mercator metres from `centre`.
    middle: Vertex,
    nominal_count: f64,
    distribution: Distribution,
}

#[derive(Debug, Clone, Copy)]
enum Distribution {
    /// A uniform distribution over the region.
    Uniform {
        /// Area of the region on the ground, m^2.
        area_m2: f64,
    },
    /// A normal distribution, negligible outside `support` (Mercator metres from the centre).
    Normal { normal: PlaneNormal, support: Rectangle },
}

impl Region {
    /// Makes the region about `centre`. Sizes are true metres. The region may cross the antimeridian, and it may reach beyond
    /// 85.05 degrees, where no tiles are.
    ///
    /// # Errors
    /// [`RegionError::Position`] for a centre beyond 85.05 degrees. [`RegionError::Parameter`] for a size, speed, time or
    /// turn radius that is not positive, a drift or inaccuracy that is negative, a correlation outside (-1, 1), and any
    /// value that is not finite. [`RegionError::Reach`] beyond [`MAX_REACH_M`].
    ///
    /// # References
    /// Equation 3 for the rectangle, and 17 for its drift in the parallel mode. The combined mode takes the set of figures 5
    /// to 7 at the end of the flight, by the boundary of the reachable set instead of equation 23 (see docs/equations.md).
    pub fn new(centre: Geodetic, image: ImageOnGround, uncertainty: Uncertainty) -> Result<Self, RegionError> {
        check(image, uncertainty)?;
        let mercator = MercatorPoint::from_geodetic(centre)?;
        let frame = LocalFrame::at(centre);
        let reach_m = reach_m(image, uncertainty);
        if reach_m.is_nan() || reach_m > MAX_REACH_M {
            return Err(RegionError::Reach { reach_m });
        }
        let (pieces, nominal_count) = edge(image, uncertainty);
        let (ring, margin_m) = ring(&frame, mercator, &pieces);
        let middle = match uncertainty {
            Uncertainty::Combined { .. } => Rectangle::around(&ring).expect("a ring has vertices").middle(),
            _ => [0.0, 0.0],
        };
        let distribution = match uncertainty {
            Uncertainty::Sequential { .. } | Uncertainty::Parallel { .. } | Uncertainty::Combined { .. } => {
                Distribution::Uniform { area_m2: weighted_area(&ring, |y| ground_area_scale(mercator.y_m + y)) }
            }
            Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation } => Distribution::Normal {
                normal: PlaneNormal::new(sigma_east_m, sigma_north_m, correlation),
                support: support(&frame, mercator, sigma_east_m, sigma_north_m),
            },
        };
        Ok(Self { centre: mercator, frame, ring, margin_m, middle, nominal_count, distribution })
    }

    /// The nominal count 𝒩 by the paper's formula: equation 3, equation 17 in the parallel mode, and equation 28 in the
    /// combined mode for flights of at most R_min. Otherwise the area of the region over the area of one image.
    pub fn nominal_count(&self) -> f64 {
        self.nominal_count
    }

    /// The smallest Mercator extent that contains the region up to 85.05 degrees. x may run past the antimeridian on either
    /// side.
    pub fn mercator_bounds(&self) -> MercatorBounds {
        let r = Rectangle::around(&self.ring).expect("a ring has vertices").grown(self.margin_m);
        let within = |y: f64| (self.centre.y_m + y).clamp(-WORLD_M / 2.0, WORLD_M / 2.0);
        MercatorBounds {
            min_x_m: self.centre.x_m + r.min[0],
            min_y_m: within(r.min[1]),
            max_x_m: self.centre.x_m + r.max[0],
            max_y_m: within(r.max[1]),
        }
    }

    /// Whether an extent, such as that of a tile, meets the region. Never misses an extent that does; may accept one that is
    /// off by less than 1 part in 1000 of the region's extent.
    pub fn meets(&self, bounds: &MercatorBounds) -> bool {
        self.copies(bounds).any(|r| touches(&self.ring, r.grown(self.margin_m)))
    }

    /// The probability in [0, 1] that the image's centre lies in an extent, correct to 1e-4. The sum over the plane is one.
    pub fn probability(&self, bounds: &MercatorBounds) -> f64 {
        let sum: f64 = match self.distribution {
            Distribution::Uniform { area_m2 } => self
                .copies(bounds)
                .map(|r| weighted_area(&clip(&self.ring, r), |y| ground_area_scale(self.centre.y_m + y)) / area_m2)
                .sum(),
            Distribution::Normal { normal, support } => self
                .copies(bounds)
                .filter_map(|r| r.intersection(support))
                .map(|r| self.normal_probability(normal, r))
                .sum(),
        };
        sum.clamp(0.0, 1.0)
    }

    /// The region as counterclockwise, closed rings of (longitude, latitude) in degrees. The region is cut at the antimeridian
    /// (RFC 7946, section 3.1.9) and at 85.05 degrees, so there may be several rings.
    pub fn rings_deg(&self) -> Vec<Vec<[f64; 2]>> {
        [-1.0, 0.0, 1.0]
            .into_iter()
            .flat_map(|world| {
                let (x, y) = (self.centre.x_m - world * WORLD_M, self.centre.y_m);
                let half = WORLD_M / 2.0;
                let world = Rectangle { min: [-half - x, -half - y], max: [half - x, half - y] };
                let parts = parts_inside(&self.ring, world).into_iter();
                parts.filter(|part| weighted_area(part, |_| 1.0) > 0.0).map(move |part| {
                    let mut degrees: Vec<[f64; 2]> =
                        part.iter().map(|v| degrees_from_mercator(v[0] + x, v[1] + y)).collect();
                    degrees.push(degrees[0]);
                    degrees
                })
            })
            .collect()
    }

    /// Distance of an extent's centre from the region's middle, true metres by the scale at the region's centre.
    pub fn distance_m(&self, bounds: &MercatorBounds) -> f64 {
        let scale = ground_scale(latitude_rad(self.centre.y_m));
        let x = (bounds.min_x_m + bounds.max_x_m) / 2.0 - self.centre.x_m - self.middle[0];
        let x = x - (x / WORLD_M).round() * WORLD_M;
        let y = (bounds.min_y_m + bounds.max_y_m) / 2.0 - self.centre.y_m - self.middle[1];
        (x * scale.east).hypot(y * scale.north)
    }

    /// The extent relative to the centre, once for each turn around the world on which it can be near.
    fn copies(&self, b: &MercatorBounds) -> impl Iterator<Item = Rectangle> + use<> {
        let (min, max) = (
            [b.min_x_m - self.centre.x_m, b.min_y_m - self.centre.y_m],
            [b.max_x_m - self.centre.x_m, b.max_y_m - self.centre.y_m],
        );
        [-1.0, 0.0, 1.0].into_iter().filter_map(move |world| {
            let x = world * WORLD_M;
            let copy = Rectangle { min: [min[0] + x, min[1]], max: [max[0] + x, max[1]] };
            // No region reaches half the world: one of 300 km at 85.05 degrees spans a fifth.
            (copy.max[0] > -WORLD_M / 2.0 && copy.min[0] < WORLD_M / 2.0).then_some(copy)
        })
    }

    fn normal_probability(&self, normal: PlaneNormal, r: Rectangle) -> f64 {
        let corners = r.corners();
        let whitened = |v: Vertex| {
            let (x_m, y_m) = (self.centre.x_m + v[0], self.centre.y_m + v[1]);
            let point = MercatorPoint { x_m, y_m }.to_geodetic().expect("finite coordinates have a position");
            let enu = self.frame.enu_from_geodetic(point);
            normal.whitened([enu.east_m, enu.north_m])
        };
        let bow = 1e-3 * normal.minor_sigma_m();
        (0..4)
            .map(|i| {
                let piece = EdgePiece::Straight { start: corners[i], end: corners[(i + 1) % 4] };
                let steps = steps_until_straight(piece, bow, |v| {
                    let w = whitened(v);
                    normal.offset(w[0], w[1])
                });
                let at = |step: usize| whitened(piece.at(step as f64 / steps as f64));
                let mut start = at(0);
                let mut sum = 0.0;
                for step in 1..=steps {
                    let end = at(step);
                    sum += edge_probability(start, end);
                    start = end;
                }
                sum
            })
            .sum()
    }
}

/// D_T of the parallel mode: the drift of t_exe / t0 relative registrations (17).
fn parallel_drift_m(unit_drift_m: f64, execution_s: f64, relative_s: f64) -> f64 {
    DriftGrowth::Linear.factor(execution_s / relative_s) * unit_drift_m
}

/// Distance from the centre within which the region lies, metres.
fn reach_m(image: ImageOnGround, uncertainty: Uncertainty) -> f64 {
    let ImageOnGround { across_m, along_m, .. } = image;
    let rectangle_m = |inaccuracy_m, drift_m| {
        let (width_m, length_m) = region_edges_m(across_m, along_m, inaccuracy_m, drift_m);
        width_m.hypot(length_m) / 2.0
    };
    match uncertainty {
        Uncertainty::Sequential { inaccuracy_m, drift_m } => rectangle_m(inaccuracy_m, drift_m),
        Uncertainty::Parallel { inaccuracy_m, unit_drift_m, execution_s, relative_s } => {
            rectangle_m(inaccuracy_m, parallel_drift_m(unit_drift_m, execution_s, relative_s))
        }
        Uncertainty::Combined { inaccuracy_m, speed_mps, execution_s, .. } => {
            speed_mps * execution_s + across_m.hypot(along_m) / 2.0 + inaccuracy_m / SQRT_2
        }
        Uncertainty::Covariance { sigma_east_m, sigma_north_m, .. } => {
            REACH_SIGMA * sigma_east_m.hypot(sigma_north_m) + across_m.hypot(along_m) / 2.0
        }
    }
}

/// The shortest flight: a shorter one shows the same ground to within the region's margin, but its course has no direction.
const LEAST_LENGTH_M: f64 = 1e-6;

/// The edge in the local plane, and the nominal count 𝒩.
fn edge(image: ImageOnGround, uncertainty: Uncertainty) -> (Vec<EdgePiece>, f64) {
    let ImageOnGround { across_m, along_m, heading_rad } = image;
    let drifted = |inaccuracy_m, drift_m| {
        let (width_m, length_m) = region_edges_m(across_m, along_m, inaccuracy_m, drift_m);
        let count = nominal_count_sequential(across_m, along_m, inaccuracy_m, drift_m);
        (rectangle(width_m, length_m, heading_rad), count)
    };
    match uncertainty {
        Uncertainty::Sequential { inaccuracy_m, drift_m } => drifted(inaccuracy_m, drift_m),
        Uncertainty::Parallel { inaccuracy_m, unit_drift_m, execution_s, relative_s } => {
            drifted(inaccuracy_m, parallel_drift_m(unit_drift_m, execution_s, relative_s))
        }
        Uncertainty::Combined { inaccuracy_m, speed_mps, execution_s, min_turn_radius_m: radius_m } => {
            let flown_m = speed_mps * execution_s;
            let length_m = flown_m.max(LEAST_LENGTH_M);
            let outline = reachable_outline(TurningFlight { length_m, radius_m, across_m, along_m }, inaccuracy_m);
            let area_m2 = weighted_area(&outline, |_| 1.0);
            // Also for a length outside the models' domain (1e-9 to 1e9).
            let by_paper = nominal_count_combined(across_m, along_m, flown_m, radius_m);
            let count = by_paper.ok().flatten().unwrap_or(area_m2 / (across_m * along_m));
            (polygon(&outline, heading_rad), count)
        }
        Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation } => {
            let normal = PlaneNormal::new(sigma_east_m, sigma_north_m, correlation);
            // Area of a Minkowski sum: both areas, and each side times the distance that the ellipse reaches beyond it.
            let beyond = |n: Vertex| {
                let w = normal.whitened_normal(n);
                SIGMAS * w[0].hypot(w[1])
            };
            let (sin, cos) = heading_rad.sin_cos();
            let area_m2 = PI * SIGMAS * SIGMAS * normal.axes_product_m2()
                + across_m * along_m
                + 2.0 * across_m * beyond([sin, cos])
                + 2.0 * along_m * beyond([cos, -sin]);
            let pieces = dilated_ellipse(normal, SIGMAS, across_m, along_m, heading_rad);
            (pieces, area_m2 / (across_m * along_m))
        }
    }
}

/// The edge as a ring of the Mercator plane about `centre`, and twice its largest distance from the chords.
fn ring(frame: &LocalFrame, centre: MercatorPoint, pieces: &[EdgePiece]) -> (Vec<Vertex>, f64) {
    let project = |v: Vertex| mercator_offset(frame, centre, v);
    let extent = pieces.iter().map(|p| project(p.at(0.0))).map(|v| v[0].hypot(v[1])).fold(0.0, f64::max);
    let mut ring = Vec::with_capacity(64);
    let mut bow_m: f64 = 0.0;
    for &piece in pieces {
        let steps = steps_until_straight(piece, STRAIGHTNESS * extent, project);
        ring.extend((0..steps).map(|step| project(piece.at(step as f64 / steps as f64))));
        bow_m = bow_m.max(largest_bow(piece, steps, project));
    }
    // A micrometre covers the rounding of Mercator coordinates (4 nm) and of the local frame.
    (ring, 2.0 * bow_m + 1e-6)
}

/// The number of equal parts of a piece that are each, projected, straight to within `tolerance`.
fn steps_until_straight(piece: EdgePiece, tolerance: f64, project: impl Fn(Vertex) -> Vertex) -> usize {
    (0..MAX_HALVINGS)
        .map(|halvings| 1 << halvings)
        .find(|&steps| largest_bow(piece, steps, &project) <= tolerance)
        .unwrap_or(1 << MAX_HALVINGS)
}

/// The largest distance between the middle of a part and the middle of its chord.
fn largest_bow(piece: EdgePiece, steps: usize, project: impl Fn(Vertex) -> Vertex) -> f64 {
    let at = |part: f64| project(piece.at(part / steps as f64));
    (0..steps)
        .map(|step| {
            let step = step as f64;
            let (start, middle, end) = (at(step), at(step + 0.5), at(step + 1.0));
            (middle[0] - (start[0] + end[0]) / 2.0).hypot(middle[1] - (start[1] + end[1]) / 2.0)
        })
        .fold(0.0, f64::max)
}

/// Projects an offset in the local plane to an offset in the Mercator plane, also beyond 85.05 degrees: the formula holds
/// up to the pole.
fn mercator_offset(frame: &LocalFrame, centre: MercatorPoint, offset: Vertex) -> Vertex {
    let point = frame
        .geodetic_from_enu(Enu { east_m: offset[0], north_m: offset[1] })
        .expect("a region's reach is far inside the horizon of its frame");
    let turn = point.longitude_rad() - frame.origin().longitude_rad();
    let turn = turn - (turn / TAU).round() * TAU;
    [SEMI_MAJOR_M * turn, SEMI_MAJOR_M * point.latitude_rad().tan().asinh() - centre.y_m]
}

/// The Mercator rectangle outside which a normal distribution is negligible.
fn support(frame: &LocalFrame, centre: MercatorPoint, sigma_east_m: f64, sigma_north_m: f64) -> Rectangle {
    let edge = rectangle(2.0 * REACH_SIGMA * sigma_east_m, 2.0 * REACH_SIGMA * sigma_north_m, 0.0);
    let (ring, margin_m) = ring(frame, centre, &edge);
    Rectangle::around(&ring).expect("a ring has vertices").grown(margin_m)
}

fn latitude_rad(y_m: f64) -> f64 {
    (y_m / SEMI_MAJOR_M).sinh().atan()
}

/// True square metres per square metre of the projection.
fn ground_area_scale(y_m: f64) -> f64 {
    let scale = ground_scale(latitude_rad(y_m));
    scale.east * scale.north
}

#[cfg(test)]
mod tests;
