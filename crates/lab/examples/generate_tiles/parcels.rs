//! `Parcels`: the land cut into fields by a tree of straight cuts, bent a little by a smooth warp.

use crate::noise::{chance, smooth};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

type PlanePoint = [f64; 2];

enum Node {
    Cut { normal: PlanePoint, offset_m: f64, depth: u32, low: usize, high: usize },
    Parcel(usize),
}

/// One owner's land, which can be farmed as two fields.
pub struct Parcel {
    /// Middle, metres.
    pub centre: PlanePoint,
    /// Unit direction of ploughing.
    pub along: PlanePoint,
    /// A cut across it, present in some epochs: normal and offset.
    divide: (PlanePoint, f64),
    /// In which epochs it is farmed as two.
    divided: [bool; 2],
}

/// The whole partition.
pub struct Parcels {
    nodes: Vec<Node>,
    /// All parcels; `ParcelPlace::parcel` is an index here.
    pub parcels: Vec<Parcel>,
    seed: u32,
}

/// The place of a point in the partition.
pub struct ParcelPlace {
    /// Index of the parcel.
    pub parcel: usize,
    /// Which of its fields: 0, or 1 where it is divided.
    pub half: u32,
    /// Distance to the nearest boundary of the field, metres.
    pub edge_m: f64,
    /// Distance to the nearest boundary of the parcel, metres.
    pub boundary_m: f64,
    /// The cut that makes the parcel's nearest boundary, and how deep in the tree (0 is the oldest).
    pub boundary: (usize, u32),
    /// Coordinates along and across the ploughing, metres.
    pub along_m: f64,
    /// See `along_m`.
    pub across_m: f64,
}

impl Parcels {
    /// Cuts the rectangle (0, 0) to `size_m`, and some land around it.
    pub fn cut(size_m: PlanePoint, rng: &mut ChaCha8Rng, seed: u32) -> Self {
        let (w, h) = (size_m[0], size_m[1]);
        let border = 300.0;
        let outline = vec![[-border, -border], [w + border, -border], [w + border, h + border], [-border, h + border]];
        let mut all = Self { nodes: Vec::new(), parcels: Vec::new(), seed };
        all.grow(outline, 0, 0.45, rng);
        all
    }

    /// Cuts a polygon (or keeps it as a parcel) and returns its node. `lean_rad` turns the first cuts away from north.
    fn grow(&mut self, polygon: Vec<PlanePoint>, depth: u32, lean_rad: f64, rng: &mut ChaCha8Rng) -> usize {
        let axis = longest_side(&polygon, if depth < 2 { Some(lean_rad) } else { None });
        let (u, v) = (axis, [-axis[1], axis[0]]);
        let (u_range, v_range) = (extent(&polygon, u), extent(&polygon, v));
        let (length, width) = (u_range.1 - u_range.0, v_range.1 - v_range.0);
        let target_m2 = 10_000.0 * rng.random_range(1.6..5.5);
        if depth > 12 || area(&polygon) < target_m2 || length.min(width) < 55.0 {
            let along = if length >= width { u } else { v };
            let across = [-along[1], along[0]];
            let range = extent(&polygon, across);
            let share = rng.random_range(0.35..0.65);
            let state = rng.random_range(0..10);
            let divided = [matches!(state, 0..=2 | 6), matches!(state, 3..=4 | 6)];
            self.parcels.push(Parcel {
                centre: centroid(&polygon),
                along,
                divide: (across, range.0 + (range.1 - range.0) * share),
                divided: if range.1 - range.0 > 70.0 { divided } else { [false; 2] },
            });
            self.nodes.push(Node::Parcel(self.parcels.len() - 1));
            return self.nodes.len() - 1;
        }
        let jitter = if depth < 3 { 0.2 } else { 0.05 };
        let turn = rng.random_range(-jitter..jitter);
        let (sin, cos) = f64::sin_cos(turn);
        let (n, range) = if length >= width { (u, u_range) } else { (v, v_range) };
        let normal = [n[0] * cos - n[1] * sin, n[0] * sin + n[1] * cos];
        let middle = centroid(&polygon);
        let offset_m = dot(normal, middle) + (range.1 - range.0) * rng.random_range(-0.15..0.15);
        let id = self.nodes.len();
        self.nodes.push(Node::Cut { normal, offset_m, depth, low: 0, high: 0 });
        let low = self.grow(clip(&polygon, normal, offset_m, -1.0), depth + 1, lean_rad, rng);
        let high = self.grow(clip(&polygon, normal, offset_m, 1.0), depth + 1, lean_rad, rng);
        self.nodes[id] = Node::Cut { normal, offset_m, depth, low, high };
        id
    }

    /// Returns the place of (x, y) in an epoch.
    pub fn place(&self, x: f64, y: f64, epoch: usize) -> ParcelPlace {
        let bend = |k: u32| {
            22.0 * f64::from(smooth(self.seed + k, x / 420.0, y / 420.0))
                + 3.0 * f64::from(smooth(self.seed + k + 9, x / 70.0, y / 70.0))
        };
        let p = [x + bend(1), y + bend(2)];
        let (mut node, mut boundary_m, mut boundary) = (0, f64::INFINITY, (0, 0));
        loop {
            match &self.nodes[node] {
                Node::Cut { normal, offset_m, depth, low, high } => {
                    let side_m = dot(*normal, p) - offset_m;
                    if side_m.abs() < boundary_m {
                        (boundary_m, boundary) = (side_m.abs(), (node, *depth));
                    }
                    node = if side_m < 0.0 { *low } else { *high };
                }
                Node::Parcel(parcel) => {
                    let land = &self.parcels[*parcel];
                    let (mut half, mut edge_m) = (0, boundary_m);
                    if land.divided[epoch] {
                        let side_m = dot(land.divide.0, p) - land.divide.1;
                        half = u32::from(side_m > 0.0);
                        edge_m = edge_m.min(side_m.abs());
                    }
                    let across = [-land.along[1], land.along[0]];
                    return ParcelPlace {
                        parcel: *parcel,
                        half,
                        edge_m,
                        boundary_m,
                        boundary,
                        along_m: dot(land.along, p),
                        across_m: dot(across, p),
                    };
                }
            }
        }
    }

    /// A number in [0, 1) that belongs to a boundary.
    pub fn chance_of(&self, boundary: usize, salt: u32) -> f32 {
        chance(self.seed + salt, boundary as i32, 77)
    }
}

fn dot(a: PlanePoint, b: PlanePoint) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn extent(polygon: &[PlanePoint], axis: PlanePoint) -> (f64, f64) {
    polygon.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &p| (lo.min(dot(p, axis)), hi.max(dot(p, axis))))
}

fn area(polygon: &[PlanePoint]) -> f64 {
    let n = polygon.len();
    (0..n).map(|i| polygon[i][0] * polygon[(i + 1) % n][1] - polygon[(i + 1) % n][0] * polygon[i][1]).sum::<f64>().abs()
        / 2.0
}

fn centroid(polygon: &[PlanePoint]) -> PlanePoint {
    let n = polygon.len() as f64;
    [polygon.iter().map(|p| p[0]).sum::<f64>() / n, polygon.iter().map(|p| p[1]).sum::<f64>() / n]
}

fn longest_side(polygon: &[PlanePoint], lean_rad: Option<f64>) -> PlanePoint {
    if let Some(lean) = lean_rad {
        return [lean.cos(), lean.sin()];
    }
    let n = polygon.len();
    let side = |i: usize| [polygon[(i + 1) % n][0] - polygon[i][0], polygon[(i + 1) % n][1] - polygon[i][1]];
    let longest = (0..n).map(side).max_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b))).expect("a polygon has sides");
    let length = dot(longest, longest).sqrt();
    [longest[0] / length, longest[1] / length]
}

/// The part of a convex polygon on one side of a line.
fn clip(polygon: &[PlanePoint], normal: PlanePoint, offset: f64, side: f64) -> Vec<PlanePoint> {
    let n = polygon.len();
    let height = |p: PlanePoint| (dot(normal, p) - offset) * side;
    let mut out = Vec::new();
    for i in 0..n {
        let (a, b) = (polygon[i], polygon[(i + 1) % n]);
        let (ha, hb) = (height(a), height(b));
        if ha >= 0.0 {
            out.push(a);
        }
        if (ha >= 0.0) != (hb >= 0.0) {
            let t = ha / (ha - hb);
            out.push([a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]);
        }
    }
    out
}
