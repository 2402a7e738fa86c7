//! `TownLayout`: districts between main roads, each with its own streets; where a point lies among them.

use crate::scene::noise::{chance, hash, smooth};

/// Mean distance between the middles of districts, metres.
const APART_M: f64 = 230.0;
/// Half the carriageway of a main road, metres.
pub const MAIN_HALF_M: f64 = 5.8;
/// Half a main road with its pavements, metres.
pub const MAIN_REACH_M: f64 = 8.4;
/// Width of the pavement of a street, metres.
pub const PAVEMENT_M: f64 = 1.9;

/// What stands in a district.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// Single houses in gardens.
    Houses,
    /// Closed rows along the streets, yards behind.
    Rows,
    /// Slabs of flats on lawns.
    Flats,
    /// Halls and yards.
    Works,
    /// Grass, trees, paths.
    Park,
}

/// One district.
#[derive(Debug, Clone, Copy)]
pub struct District {
    /// What stands there.
    pub used: Use,
    /// Draws that belong to it.
    pub seed: u32,
    middle: [f64; 2],
    cos: f64,
    sin: f64,
    /// Distance between streets along u and along v, metres.
    spacing_m: [f64; 2],
    /// How far streets wind, metres.
    winding_m: f64,
    /// Half the carriageway of its streets, metres.
    pub half_m: f64,
}

/// Where a point lies.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// The district's number.
    pub district: usize,
    /// Distance to the middle of the nearest main road, metres.
    pub border_m: f64,
    /// Length along that road, metres.
    pub along_m: f64,
    /// The district's own coordinates, along its streets, metres.
    pub uv: [f64; 2],
}

/// The piece of ground between four streets.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    /// Its numbers along u and v.
    pub number: [i32; 2],
    /// First u, last u, first v, last v, between the streets' middles, metres.
    pub edges_m: [f64; 4],
}

/// All districts of a town.
pub struct TownLayout {
    seed: u32,
    across: usize,
    /// The districts, on a jittered grid.
    pub districts: Vec<District>,
}

impl TownLayout {
    /// Draws the districts of a town of a size, metres.
    pub fn new(seed: u32, size_m: [f64; 2]) -> Self {
        let [across, down] = size_m.map(|size| (size / APART_M).ceil() as usize + 4);
        let district = |i: usize| District::draw(seed, (i % across) as i32 - 2, (i / across) as i32 - 2);
        Self { seed, across, districts: (0..across * down).map(district).collect() }
    }

    /// Where a point (metres east and south) lies.
    pub fn place(&self, x_m: f64, y_m: f64) -> Place {
        let bend = |n: u32| 14.0 * f64::from(smooth(self.seed ^ n, x_m / 170.0, y_m / 170.0));
        let (x, y) = (x_m + bend(1), y_m + bend(2));
        let down = self.districts.len() / self.across;
        let column = ((x / APART_M).floor() as i64 + 2).clamp(1, self.across as i64 - 2) as usize;
        let row = ((y / APART_M).floor() as i64 + 2).clamp(1, down as i64 - 2) as usize;
        let mut nearest = [(f64::MAX, 0usize); 2];
        for j in row - 1..=row + 1 {
            for i in column - 1..=column + 1 {
                let number = j * self.across + i;
                let [mx, my] = self.districts[number].middle;
                let found = ((x - mx).powi(2) + (y - my).powi(2), number);
                if found.0 < nearest[0].0 {
                    nearest = [found, nearest[0]];
                } else if found.0 < nearest[1].0 {
                    nearest[1] = found;
                }
            }
        }
        let [a, b] = nearest.map(|(_, number)| self.districts[number].middle);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let apart_m = dx.hypot(dy).max(1e-9);
        Place {
            district: nearest[0].1,
            border_m: (nearest[1].0 - nearest[0].0) / (2.0 * apart_m),
            along_m: (x * dy - y * dx) / apart_m,
            uv: self.districts[nearest[0].1].uv(x_m, y_m),
        }
    }
}

impl District {
    fn draw(seed: u32, i: i32, j: i32) -> Self {
        let draw = |n: u32| f64::from(chance(seed.wrapping_add(31 * n), i, j));
        let used = match draw(0) {
            v if v < 0.46 => Use::Houses,
            v if v < 0.66 => Use::Rows,
            v if v < 0.80 => Use::Flats,
            v if v < 0.92 => Use::Works,
            _ => Use::Park,
        };
        let angle_rad = draw(1) * std::f64::consts::FRAC_PI_2;
        let is_regular = draw(2) < 0.4;
        let spacing_m = match used {
            Use::Works => [110.0 + 50.0 * draw(3), 80.0 + 25.0 * draw(4)],
            Use::Flats => [95.0 + 30.0 * draw(3), 70.0 + 20.0 * draw(4)],
            _ => [78.0 + 50.0 * draw(3), 50.0 + 16.0 * draw(4)],
        };
        Self {
            used,
            seed: hash(seed, i, j),
            middle: [
                (f64::from(i) + 0.5 + 0.7 * (draw(5) - 0.5)) * APART_M,
                (f64::from(j) + 0.5 + 0.7 * (draw(6) - 0.5)) * APART_M,
            ],
            cos: angle_rad.cos(),
            sin: angle_rad.sin(),
            spacing_m,
            winding_m: if is_regular { 0.8 } else { 5.0 + 7.0 * draw(7) },
            half_m: 2.6 + 1.3 * draw(8),
        }
    }

    /// The district's coordinates of a point, metres.
    pub fn uv(&self, x_m: f64, y_m: f64) -> [f64; 2] {
        let wind = |n: u32| self.winding_m * f64::from(smooth(self.seed ^ n, x_m / 95.0, y_m / 95.0));
        let (x, y) = (x_m - self.middle[0] + wind(1), y_m - self.middle[1] + wind(2));
        [x * self.cos + y * self.sin, y * self.cos - x * self.sin]
    }

    /// The point with these coordinates: the inverse of [`District::uv`], by iteration to a millimetre.
    pub fn point(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let straight = |u: f64, v: f64| {
            [self.middle[0] + u * self.cos - v * self.sin, self.middle[1] + u * self.sin + v * self.cos]
        };
        let mut point = straight(u, v);
        for _ in 0..12 {
            let [hu, hv] = self.uv(point[0], point[1]);
            let [back, there] = [straight(hu, hv), straight(u, v)];
            point = [point[0] + there[0] - back[0], point[1] + there[1] - back[1]];
        }
        point
    }

    /// The unit vector along u at a point.
    pub fn along(&self, uv: [f64; 2]) -> [f64; 2] {
        let (a, b) = (self.point([uv[0] - 3.0, uv[1]]), self.point([uv[0] + 3.0, uv[1]]));
        let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
        [(b[0] - a[0]) / length, (b[1] - a[1]) / length]
    }

    /// Where street `k` of an axis runs.
    pub fn line_m(&self, axis: usize, k: i32) -> f64 {
        let jitter = f64::from(chance(self.seed ^ (91 + axis as u32), k, 0)) - 0.5;
        (f64::from(k) + 0.24 * jitter) * self.spacing_m[axis]
    }

    /// The block of a point, in the district's coordinates.
    pub fn block(&self, uv: [f64; 2]) -> Block {
        let find = |axis: usize| {
            let mut k = (uv[axis] / self.spacing_m[axis]).floor() as i32 - 1;
            while self.line_m(axis, k + 1) <= uv[axis] {
                k += 1;
            }
            k
        };
        self.block_with([find(0), find(1)])
    }

    /// The block with these numbers.
    pub fn block_with(&self, [i, j]: [i32; 2]) -> Block {
        let edges_m = [self.line_m(0, i), self.line_m(0, i + 1), self.line_m(1, j), self.line_m(1, j + 1)];
        Block { number: [i, j], edges_m }
    }

    /// The numbers of blocks that may lie within a distance of the district's middle, metres.
    pub fn blocks(&self, reach_m: f64) -> impl Iterator<Item = Block> + '_ {
        let most = self.spacing_m.map(|s| (reach_m / s).ceil() as i32);
        (-most[1]..=most[1]).flat_map(move |j| (-most[0]..=most[0]).map(move |i| self.block_with([i, j])))
    }
}

impl Block {
    /// Draws that belong to it.
    pub fn seed(&self, district: &District) -> u32 {
        hash(district.seed ^ 0x51, self.number[0], self.number[1])
    }

    /// The edges inside the streets and pavements, metres.
    pub fn inner_m(&self, district: &District) -> [f64; 4] {
        let strip_m = district.half_m + PAVEMENT_M;
        let [a, b, c, d] = self.edges_m;
        [a + strip_m, b - strip_m, c + strip_m, d - strip_m]
    }
}
