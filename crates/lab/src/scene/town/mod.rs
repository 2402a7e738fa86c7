//! The town: districts of houses, closed rows, flats, works and parks between main roads.

mod district;
mod ground;
mod lot;
mod paint;
mod standing;
mod traffic;

use super::cells::Cells;
use super::date::SceneDate;
use super::noise::{cloudy, hash};
use super::sample::Sample;
use super::terrain::Terrain;
use super::world::World;
use district::TownLayout;
use standing::Standing;

/// Side of a cell, metres.
pub const CELL_M: f64 = 0.15;

/// A town of a seed and a size (east, south, metres) on a day. The terrain varies by a few metres.
pub fn town(seed: u64, size_m: [f64; 2], date: &SceneDate) -> World {
    let seed = hash(0x70_77_6e, seed as i32, (seed >> 32) as i32);
    let layout = TownLayout::new(seed, size_m);
    let terrain = Terrain::new(size_m, 5.0, |x, y| 212.0 + 5.0 * f64::from(cloudy(seed ^ 99, x / 420.0, y / 420.0)));
    let mut standing = Standing::new(&layout, &terrain, date);
    standing.add_traffic();
    let Standing { objects, buildings, .. } = standing;
    let ground = |x: f64, y: f64| {
        let (colour, lift_m, kind) = ground::surface(&layout, date, x, y);
        Sample { colour, top_m: (terrain.height_m(x, y) + lift_m) as f32, kind }
    };
    let cells = Cells::paint(size_m, CELL_M, ground, &objects);
    World::new(cells, terrain, None, buildings, date.sun)
}
