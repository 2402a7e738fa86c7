//! `MappedGround`: where a layer has imagery, in coarse cells, to draw search centres and to measure the searched
//! area.

use overfly_core::geodesy::{Enu, Geodetic, LocalFrame};
use overfly_core::tile::{TILE_SIZE_PX, WorldPixel, gsd_at};
use overfly_store::{Layer, Reader, StoreError};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Edge of a cell, pixels of the layer's coarsest level.
const CELL_PX: usize = 8;
/// Draws until a place counts as impossible.
const DRAWS: usize = 200;

/// The cells of a layer that hold imagery.
pub struct MappedGround {
    zoom: u8,
    /// Column and row in the world's grid of cells, and share of valid pixels; sorted by column and row.
    cells: Vec<(i64, i64, f64)>,
}

impl MappedGround {
    /// Reads the coarsest level of a layer.
    pub fn read(store: &Reader, layer: &Layer) -> Result<Self, StoreError> {
        let per_tile = TILE_SIZE_PX as usize / CELL_PX;
        let mut cells = Vec::new();
        for footprint in store.footprints(layer, layer.min_zoom)? {
            let Some(tile) = store.tile(layer, footprint.tile)? else { continue };
            let first = [footprint.tile.column(), footprint.tile.row()].map(|n| i64::from(n) * per_tile as i64);
            for i in 0..per_tile * per_tile {
                let (x, y) = (i % per_tile, i / per_tile);
                let pixels = (0..CELL_PX * CELL_PX)
                    .filter(|k| tile.mask.at(x * CELL_PX + k % CELL_PX, y * CELL_PX + k / CELL_PX));
                let share = pixels.count() as f64 / (CELL_PX * CELL_PX) as f64;
                if share > 0.0 {
                    cells.push((first[0] + x as i64, first[1] + y as i64, share));
                }
            }
        }
        cells.sort_by_key(|c| (c.0, c.1));
        Ok(Self { zoom: layer.min_zoom, cells })
    }

    /// The cell nearest to the centre of all; `None` for a layer without imagery.
    pub fn middle(&self) -> Option<Geodetic> {
        let n = self.cells.len().max(1) as f64;
        let mean = |of: fn(&(i64, i64, f64)) -> i64| self.cells.iter().map(|c| of(c) as f64).sum::<f64>() / n;
        let (x, y) = (mean(|c| c.0), mean(|c| c.1));
        let far = |c: &(i64, i64, f64)| (c.0 as f64 - x).hypot(c.1 as f64 - y);
        let &(x, y, _) = self.cells.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
        let at = WorldPixel { x_px: (x as f64 + 0.5) * CELL_PX as f64, y_px: (y as f64 + 0.5) * CELL_PX as f64 };
        at.to_geodetic(self.zoom).ok()
    }

    /// Draws a point over imagery, up to `half_width_m` on each axis from a place of the layer. The square around the
    /// point contains the place.
    pub fn displaced(&self, place: Geodetic, half_width_m: f64, rng: &mut ChaCha8Rng) -> Geodetic {
        let frame = LocalFrame::at(place);
        let mut draw = || {
            let mut axis = || rng.random_range(-half_width_m..=half_width_m);
            let offset = Enu { east_m: axis(), north_m: axis() };
            frame.geodetic_from_enu(offset).ok().filter(|p| self.holds(*p))
        };
        (0..DRAWS).find_map(|_| draw()).unwrap_or(place)
    }

    /// Draws a point over imagery, more than `apart_m` from a place on one axis; `None` if no draw meets one.
    pub fn elsewhere(&self, place: Geodetic, apart_m: f64, rng: &mut ChaCha8Rng) -> Option<Geodetic> {
        let frame = LocalFrame::at(place);
        let is_apart = |point: &Geodetic| {
            let off = frame.enu_from_geodetic(*point);
            off.east_m.abs().max(off.north_m.abs()) > apart_m
        };
        (0..DRAWS).find_map(|_| self.drawn(rng).filter(is_apart))
    }

    /// Draws a point over imagery; `None` for a layer without imagery.
    pub fn anywhere(&self, rng: &mut ChaCha8Rng) -> Option<Geodetic> {
        (0..DRAWS).find_map(|_| self.drawn(rng))
    }

    /// Draws a point; `None` if it has no imagery.
    fn drawn(&self, rng: &mut ChaCha8Rng) -> Option<Geodetic> {
        let (x, y, share) = *self.cells.get(rng.random_range(0..self.cells.len().max(1)))?;
        let (u, v, lot) = (rng.random::<f64>(), rng.random::<f64>(), rng.random::<f64>());
        let at = WorldPixel { x_px: (x as f64 + u) * CELL_PX as f64, y_px: (y as f64 + v) * CELL_PX as f64 };
        at.to_geodetic(self.zoom).ok().filter(|_| lot < share)
    }

    fn holds(&self, point: Geodetic) -> bool {
        let Ok(at) = WorldPixel::from_geodetic(point, self.zoom) else { return false };
        let cell = [at.x_px, at.y_px].map(|v| (v / CELL_PX as f64).floor() as i64);
        let found = self.cells.binary_search_by_key(&(cell[0], cell[1]), |c| (c.0, c.1));
        found.is_ok_and(|i| self.cells[i].2 >= 0.5)
    }

    /// Area of the imagery within a square, m^2.
    pub fn shared_m2(&self, centre: Geodetic, half_width_m: f64) -> f64 {
        let Ok(at) = WorldPixel::from_geodetic(centre, self.zoom) else { return 0.0 };
        let gsd = gsd_at(centre, self.zoom);
        let (half_x, half_y) = (half_width_m / gsd.east_m_per_px, half_width_m / gsd.north_m_per_px);
        let world_px = f64::from(TILE_SIZE_PX) * f64::from(1u32 << self.zoom);
        // The overlap with a cell that begins `from` pixels off the centre.
        let overlap = |from: f64, half: f64| ((from + CELL_PX as f64).min(half) - from.max(-half)).max(0.0);
        let shared_px2 = |&(x, y, share): &(i64, i64, f64)| {
            let across = (x as f64 * CELL_PX as f64 - at.x_px + world_px / 2.0).rem_euclid(world_px) - world_px / 2.0;
            share * overlap(across, half_x) * overlap(y as f64 * CELL_PX as f64 - at.y_px, half_y)
        };
        self.cells.iter().map(shared_px2).sum::<f64>() * gsd.east_m_per_px * gsd.north_m_per_px
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// 100 x 60 cells around 48 N 15 E at a level where a cell is about 100 m wide.
    fn ground() -> (MappedGround, Geodetic) {
        let middle = Geodetic::from_degrees(48.0, 15.0).unwrap();
        let at = WorldPixel::from_geodetic(middle, 12).unwrap();
        let (x, y) = ((at.x_px / CELL_PX as f64) as i64, (at.y_px / CELL_PX as f64) as i64);
        let cells = (x - 50..x + 50).flat_map(|i| (y - 30..y + 30).map(move |j| (i, j, 1.0))).collect();
        (MappedGround { zoom: 12, cells }, middle)
    }

    #[test]
    fn a_displaced_square_holds_the_place_and_has_its_middle_over_imagery() {
        let ((ground, middle), mut rng) = (ground(), ChaCha8Rng::seed_from_u64(1));
        for _ in 0..200 {
            let centre = ground.displaced(middle, 9000.0, &mut rng);
            let off = LocalFrame::at(middle).enu_from_geodetic(centre);
            assert!(off.east_m.abs() <= 9001.0 && off.north_m.abs() <= 9001.0 && ground.holds(centre));
        }
    }

    #[test]
    fn elsewhere_is_apart_or_nowhere() {
        let ((ground, middle), mut rng) = (ground(), ChaCha8Rng::seed_from_u64(2));
        for _ in 0..100 {
            let point = ground.elsewhere(middle, 3000.0, &mut rng).unwrap();
            let off = LocalFrame::at(middle).enu_from_geodetic(point);
            assert!(off.east_m.abs().max(off.north_m.abs()) > 3000.0 && ground.holds(point));
        }
        assert!(ground.elsewhere(middle, 20_000.0, &mut rng).is_none());
        let empty = MappedGround { zoom: 12, cells: Vec::new() };
        assert!(empty.elsewhere(middle, 1.0, &mut rng).is_none());
        assert_eq!(empty.displaced(middle, 10.0, &mut rng), middle);
    }

    #[test]
    fn shares_the_imagery_that_lies_in_the_square() {
        let (ground, middle) = ground();
        assert!((ground.shared_m2(middle, 500.0) / 1e6 - 1.0).abs() < 1e-6);
        let gsd = gsd_at(middle, 12);
        let whole = 6000.0 * (CELL_PX * CELL_PX) as f64 * gsd.east_m_per_px * gsd.north_m_per_px;
        assert!((ground.shared_m2(middle, 1e5) / whole - 1.0).abs() < 1e-6);
    }
}
