//! Draws what a camera over the canvas sees, by casting rays.
//!
//! Does not use the program's own camera model, so that agreement with it is meaningful.

use crate::canvas::{PIXELS_PER_M, SceneCanvas};
use crate::relief::Relief;
use crate::utm::grid_from_geodetic;
use nalgebra::Vector3;
use overfly_core::geodesy::{Enu, Geodetic, LocalFrame};
use rayon::prelude::*;

/// Columns of a frame.
pub const WIDTH_PX: usize = 320;
/// Rows of a frame.
pub const HEIGHT_PX: usize = 240;
/// Focal length.
pub const FOCAL_PX: f64 = 400.0;
/// Principal point from the image's corner.
pub const PRINCIPAL_PX: [f64; 2] = [161.3, 118.9];
/// k1, k2, p1, p2, k3.
pub const DISTORTION: [f64; 5] = [-0.06, 0.015, 0.0004, -0.0003, 0.0];
/// Height at which rays begin, above everything, metres.
const TOP_M: f64 = 32.0;
/// Rays per pixel along each axis.
const RAYS: usize = 3;

/// Position and attitude of the camera.
pub struct SightPose {
    /// The point straight below.
    pub nadir: Geodetic,
    /// Clockwise from true north.
    pub heading_rad: f64,
    /// Off nadir, positive ahead.
    pub pitch_rad: f64,
    /// Off nadir, positive left.
    pub roll_rad: f64,
    /// Above the ground.
    pub height_m: f64,
    /// Time on the flight's clock.
    pub time_s: f64,
}

/// Both ends of a ray, metres east and south of the canvas's corner: where it comes below [`TOP_M`], and on the ground.
type Ends = [[f64; 2]; 2];

/// The relief around a ray: to a corner, tilted by 10 degrees, a ray moves by 25 m below the top.
pub fn relief(canvas: &SceneCanvas) -> Relief {
    Relief::new(canvas, TOP_M)
}

/// A camera in its place over a canvas.
pub struct Sight {
    frame: LocalFrame,
    /// The camera's axes, east, north, up.
    ahead: Vector3<f64>,
    right: Vector3<f64>,
    down: Vector3<f64>,
    height_m: f64,
    corner: [f64; 2],
}

impl Sight {
    /// Places the camera at a pose, over a canvas whose north-western corner has these grid coordinates.
    pub fn new(pose: &SightPose, corner: [f64; 2]) -> Self {
        // Heading turns the level axes, pitch lifts the nose, roll lowers the right wing.
        let (sin_h, cos_h) = pose.heading_rad.sin_cos();
        let (sin_p, cos_p) = pose.pitch_rad.sin_cos();
        let (sin_r, cos_r) = pose.roll_rad.sin_cos();
        let (ahead, right, down) =
            (Vector3::new(sin_h, cos_h, 0.0), Vector3::new(cos_h, -sin_h, 0.0), Vector3::new(0.0, 0.0, -1.0));
        let (ahead, down) = (ahead * cos_p - down * sin_p, down * cos_p + ahead * sin_p);
        let (right, down) = (right * cos_r + down * sin_r, down * cos_r - right * sin_r);
        Self { frame: LocalFrame::at(pose.nadir), ahead, right, down, height_m: pose.height_m, corner }
    }

    /// The ray through a position on the frame, pixels.
    pub fn ends(&self, u: f64, v: f64) -> Ends {
        let [x, y] = undistorted([(u - PRINCIPAL_PX[0]) / FOCAL_PX, (v - PRINCIPAL_PX[1]) / FOCAL_PX]);
        let ray = self.down + self.right * x - self.ahead * y;
        let ground_at = |z_m: f64| {
            let k = (self.height_m - z_m) / -ray.z;
            let point = self.frame.geodetic_from_enu(Enu { east_m: ray.x * k, north_m: ray.y * k }).expect("in sight");
            let grid = grid_from_geodetic(point);
            [grid[0] - self.corner[0], self.corner[1] - grid[1]]
        };
        [ground_at(TOP_M), ground_at(0.0)]
    }

    /// Like [`Sight::ends`] to a few millimetres and much faster: exact at every fourth pixel, bilinear between.
    pub fn knots(&self) -> RayGrid {
        let (columns, rows) = (WIDTH_PX / KNOT_PX + 1, HEIGHT_PX / KNOT_PX + 1);
        let at = |i: usize| self.ends((i % columns * KNOT_PX) as f64, (i / columns * KNOT_PX) as f64);
        RayGrid { columns, ends: (0..columns * rows).into_par_iter().map(at).collect() }
    }

    /// Draws what the camera sees, before its electronics; `ends` gives the ray of a position.
    pub fn expose(
        &self,
        canvas: &SceneCanvas,
        relief: &Relief,
        ends: impl Fn(f64, f64) -> Ends + Sync,
    ) -> Vec<[f32; 3]> {
        let see = |u: f64, v: f64| {
            let [top, bottom] = ends(u, v);
            first_hit(canvas, relief, top, bottom)
        };
        (0..WIDTH_PX * HEIGHT_PX)
            .into_par_iter()
            .map(|i| {
                let (column, row) = ((i % WIDTH_PX) as f64, (i / WIDTH_PX) as f64);
                let mut sum = [0.0f32; 3];
                for k in 0..RAYS * RAYS {
                    let part = |n: usize| (n as f64 + 0.5) / RAYS as f64;
                    let seen = see(column + part(k % RAYS), row + part(k / RAYS));
                    (0..3).for_each(|c| sum[c] += seen[c] / (RAYS * RAYS) as f32);
                }
                sum
            })
            .collect()
    }
}

const KNOT_PX: usize = 4;

/// Rays at the corners of a grid of pixels.
pub struct RayGrid {
    columns: usize,
    ends: Vec<Ends>,
}

impl RayGrid {
    /// The ray through a position on the frame, pixels.
    pub fn ends(&self, u: f64, v: f64) -> Ends {
        let (x, y) = (u / KNOT_PX as f64, v / KNOT_PX as f64);
        let (i, j) = ((x as usize).min(self.columns - 2), (y as usize).min(self.ends.len() / self.columns - 2));
        let (fx, fy) = (x - i as f64, y - j as f64);
        let knot = |di: usize, dj: usize| &self.ends[(j + dj) * self.columns + i + di];
        let (a, b, c, d) = (knot(0, 0), knot(1, 0), knot(0, 1), knot(1, 1));
        let between = |end: usize, axis: usize| {
            let (top, bottom) =
                (a[end][axis] + (b[end][axis] - a[end][axis]) * fx, c[end][axis] + (d[end][axis] - c[end][axis]) * fx);
            top + (bottom - top) * fy
        };
        [[between(0, 0), between(0, 1)], [between(1, 0), between(1, 1)]]
    }
}

/// The colour where a ray from `top` (at [`TOP_M`]) to `bottom` (on the ground) first meets the scene.
fn first_hit(canvas: &SceneCanvas, relief: &Relief, top: [f64; 2], bottom: [f64; 2]) -> [f32; 3] {
    const STEPS: usize = 64;
    let pixel = |p: [f64; 2]| p.map(|v| (v * PIXELS_PER_M).floor() as isize);
    let tallest_m = f64::from(relief.tallest_m(pixel(bottom)[0], pixel(bottom)[1]));
    // A ray hits nothing above the tallest object.
    let first = (STEPS as f64 * (1.0 - tallest_m / TOP_M)).floor().max(0.0) as usize;
    for k in first..=STEPS {
        let t = k as f64 / STEPS as f64;
        let p = [top[0] + (bottom[0] - top[0]) * t, top[1] + (bottom[1] - top[1]) * t];
        let [column, row] = pixel(p);
        if f64::from(canvas.height_at(column, row)) >= TOP_M * (1.0 - t) {
            return canvas.colour_at(p[0], p[1]);
        }
    }
    canvas.colour_at(bottom[0], bottom[1])
}

/// Returns where an undistorted camera would have seen the point that this camera sees at `seen` (both over the focal
/// length): the inverse of the OpenCV model by iteration, to below 1e-9.
fn undistorted(seen: [f64; 2]) -> [f64; 2] {
    let [k1, k2, p1, p2, k3] = DISTORTION;
    let [mut x, mut y] = seen;
    for _ in 0..40 {
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let (dx, dy) = (2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
        (x, y) = ((seen[0] - dx) / radial, (seen[1] - dy) / radial);
    }
    [x, y]
}
