//! `ScenePose`: where the camera is and how it looks; its rays, by its own formula and not by the program's camera model.

use super::utm::{geodetic_from_grid, grid_from_geodetic};
use super::world::{CORNER, World};
use nalgebra::{Matrix2, Vector2, Vector3};
use overfly_core::camera::Intrinsics;
use overfly_core::geodesy::{Enu, Geodetic, LocalFrame};

/// The camera at one moment.
#[derive(Debug, Clone, Copy)]
pub struct ScenePose {
    /// Place of the nadir, metres east and south in the scene.
    pub place: [f64; 2],
    /// Height on the scene's scale, metres.
    pub z_m: f64,
    /// Clockwise from true north, radians.
    pub heading_rad: f64,
    /// Off nadir, positive ahead, radians.
    pub pitch_rad: f64,
    /// Off nadir, positive left, radians.
    pub roll_rad: f64,
}

/// A camera over the scene: rays of its frame in scene coordinates. The Earth is flat within a frame: 2 km away its surface is 0.3 m
/// lower, and a grid step differs by less than 1e-7 of its length.
#[derive(Debug, Clone, Copy)]
pub struct SceneCamera {
    origin: [f64; 3],
    /// The camera's right, down and forward axes in the scene.
    axes: [[f64; 3]; 3],
}

/// The point of the Earth at a place of the scene, metres east and south.
pub fn geodetic_at(place: [f64; 2]) -> Geodetic {
    geodetic_from_grid([CORNER[0] + place[0], CORNER[1] - place[1]])
}

/// Scene metres (east, south) per true metre towards true east and north, at a point.
fn scene_from_enu(nadir: Geodetic) -> Matrix2<f64> {
    let frame = LocalFrame::at(nadir);
    let grid = |east_m: f64, north_m: f64| {
        let point = frame.geodetic_from_enu(Enu { east_m, north_m }).expect("a step of 500 m stays on the Earth");
        let [e, n] = grid_from_geodetic(point);
        Vector2::new(e, -n)
    };
    const STEP_M: f64 = 500.0;
    let by = |e: f64, n: f64| (grid(e, n) - grid(-e, -n)) / (2.0 * STEP_M);
    Matrix2::from_columns(&[by(STEP_M, 0.0), by(0.0, STEP_M)])
}

impl SceneCamera {
    /// The camera at a pose.
    pub fn new(pose: &ScenePose) -> Self {
        let nadir = geodetic_at(pose.place);
        let scene_from_enu = scene_from_enu(nadir);
        // Heading turns the level axes, pitch lifts the view ahead, roll turns it to the left.
        let (sin_h, cos_h) = pose.heading_rad.sin_cos();
        let (sin_p, cos_p) = pose.pitch_rad.sin_cos();
        let (sin_r, cos_r) = pose.roll_rad.sin_cos();
        let (ahead, right, forward) =
            (Vector3::new(sin_h, cos_h, 0.0), Vector3::new(cos_h, -sin_h, 0.0), Vector3::new(0.0, 0.0, -1.0));
        let (ahead, forward) = (ahead * cos_p - forward * sin_p, forward * cos_p + ahead * sin_p);
        let (right, forward) = (right * cos_r + forward * sin_r, forward * cos_r - right * sin_r);
        let axes = [right, -ahead, forward].map(|axis| {
            let level = scene_from_enu * Vector2::new(axis.x, axis.y);
            [level.x, level.y, axis.z]
        });
        Self { origin: [pose.place[0], pose.place[1], pose.z_m], axes }
    }

    /// Where the camera is, scene coordinates.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// The direction, in the scene, of a ray (x / z, y / z) of the camera.
    pub fn direction(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let [right, down, forward] = &self.axes;
        std::array::from_fn(|i| forward[i] + x * right[i] + y * down[i])
    }

    /// The ground under the image's centre, scene coordinates.
    pub fn ground_under_centre(&self, world: &World, intrinsics: &Intrinsics) -> [f64; 3] {
        let centre_px = [f64::from(intrinsics.width_px) / 2.0, f64::from(intrinsics.height_px) / 2.0];
        world.ground_under_ray(self.origin, self.direction(intrinsics.ray_from_frame(centre_px)))
    }
}

/// The rays (x / z, y / z) of all pixel corners of a camera; bilinear between them.
pub struct LensTable {
    columns: usize,
    rays: Vec<[f32; 2]>,
}

impl LensTable {
    /// The table of a camera.
    pub fn new(intrinsics: &Intrinsics) -> Self {
        let columns = intrinsics.width_px as usize + 1;
        let count = columns * (intrinsics.height_px as usize + 1);
        let ray = |i: usize| {
            let [x, y] = intrinsics.ray_from_frame([(i % columns) as f64, (i / columns) as f64]);
            [x as f32, y as f32]
        };
        Self { columns, rays: (0..count).map(ray).collect() }
    }

    /// The ray at a place inside a pixel: `part` in [0, 1] from its upper-left corner.
    #[inline]
    pub fn ray(&self, column: usize, row: usize, part: [f64; 2]) -> [f64; 2] {
        let i = row * self.columns + column;
        let corner = |k: usize| self.rays[k].map(f64::from);
        let (a, b, c) = (corner(i), corner(i + 1), corner(i + self.columns));
        // A pixel of a lens is a parallelogram to a ten-thousandth of its side.
        std::array::from_fn(|axis| a[axis] + (b[axis] - a[axis]) * part[0] + (c[axis] - a[axis]) * part[1])
    }
}
