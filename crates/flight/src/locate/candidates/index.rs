//! `ResidentIndex`: the footprints of one layer and level held in memory.

use overfly_core::geodesy::WORLD_M;
use overfly_core::tile::MercatorBounds;
use overfly_store::Footprint;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

type Entry = GeomWithData<Rectangle<[f64; 2]>, u32>;

/// An R*-tree over footprints: finds what meets an extent without touching the file.
#[derive(Debug)]
pub struct ResidentIndex {
    footprints: Vec<Footprint>,
    tree: RTree<Entry>,
}

impl ResidentIndex {
    /// The index of the footprints given (of one layer and level; at most 2^32).
    pub fn new(footprints: Vec<Footprint>) -> Self {
        let entries = (0..).zip(&footprints).map(|(i, f)| {
            let b = f.tile.mercator_bounds();
            Entry::new(Rectangle::from_corners([b.min_x_m, b.min_y_m], [b.max_x_m, b.max_y_m]), i)
        });
        let tree = RTree::bulk_load(entries.collect());
        Self { footprints, tree }
    }

    /// How many footprints it holds.
    pub fn len(&self) -> usize {
        self.footprints.len()
    }

    /// Whether it holds none.
    pub fn is_empty(&self) -> bool {
        self.footprints.is_empty()
    }

    /// Those whose bounds meet an extent, x running past the antimeridian included; each once, in no order.
    pub fn footprints_in(&self, bounds: &MercatorBounds) -> Vec<&Footprint> {
        let mut found: Vec<u32> = Vec::new();
        let mut windows = 0;
        for world in [-1.0, 0.0, 1.0] {
            let shift = world * WORLD_M;
            let (min_x, max_x) = (bounds.min_x_m - shift, bounds.max_x_m - shift);
            if max_x >= -WORLD_M / 2.0 && min_x <= WORLD_M / 2.0 {
                let window = AABB::from_corners([min_x, bounds.min_y_m], [max_x, bounds.max_y_m]);
                found.extend(self.tree.locate_in_envelope_intersecting(&window).map(|entry| entry.data));
                windows += 1;
            }
        }
        // Only two windows can find the same tile: at zoom 0 one tile is the whole world.
        if windows > 1 {
            found.sort_unstable();
            found.dedup();
        }
        found.into_iter().map(|i| &self.footprints[i as usize]).collect()
    }
}
