//! `World`: cells under a sun, the bare ground below them, and the place of both on the Earth.

use super::building::Building;
use super::cells::Cells;
use super::sun::Sun;
use super::terrain::Terrain;

/// Easting and northing of the north-western corner of every world, EPSG:32633: off the central meridian, so that grid north is
/// 0.5 degrees off true north.
pub const CORNER: [f64; 2] = [548_000.0, 5_372_000.0];

/// A lit world of one date. Scene coordinates: metres of the grid east and south of [`CORNER`], metres up.
pub struct World {
    /// What is seen.
    pub cells: Cells,
    /// The bare ground, which orthophotos are rectified on.
    pub terrain: Terrain,
    /// Level of all open water, metres.
    pub water_m: Option<f64>,
    /// The buildings, by number.
    pub buildings: Vec<Building>,
    /// The sun of the date.
    pub sun: Sun,
}

impl World {
    /// Makes a world of painted cells and lights them.
    pub fn new(mut cells: Cells, terrain: Terrain, water_m: Option<f64>, buildings: Vec<Building>, sun: Sun) -> Self {
        sun.light(&mut cells);
        Self { cells, terrain, water_m, buildings, sun }
    }

    /// Size of the world towards east and south, metres.
    pub fn size_m(&self) -> [f64; 2] {
        [self.cells.columns as f64 * self.cells.cell_m, self.cells.rows as f64 * self.cells.cell_m]
    }

    /// Height of the bare ground or of the water over it, metres.
    pub fn ground_m(&self, x_m: f64, y_m: f64) -> f64 {
        let ground_m = self.terrain.height_m(x_m, y_m);
        self.water_m.map_or(ground_m, |water_m| ground_m.max(water_m))
    }

    /// Where a ray first meets the bare ground or water: the truth of what it points at. `direction` points down.
    pub fn ground_under_ray(&self, origin: [f64; 3], direction: [f64; 3]) -> [f64; 3] {
        let at = |t: f64| [0, 1, 2].map(|axis| origin[axis] + t * direction[axis]);
        let above_m = |t: f64| {
            let [x, y, z] = at(t);
            z - self.ground_m(x, y)
        };
        // Steps of half a knot along the ground, or of 2 m down, then bisection to a tenth of a millimetre.
        let run = direction[0].hypot(direction[1]);
        let step = (0.5 * self.terrain.spacing_m / run.max(1e-9)).min(2.0 / -direction[2]);
        let highest_m = f64::from(self.cells.highest_m);
        let mut t = ((origin[2] - highest_m) / -direction[2]).max(0.0);
        while above_m(t + step) > 0.0 {
            t += step;
        }
        let (mut near, mut far) = (t, t + step);
        while (far - near) * direction[2].abs() > 1e-4 {
            let middle = 0.5 * (near + far);
            if above_m(middle) > 0.0 { near = middle } else { far = middle }
        }
        at(far)
    }
}
