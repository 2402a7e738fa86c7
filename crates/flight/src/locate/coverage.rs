//! Where the map has pixels: the ground of each layer's tiles joined to rectangles, as GeoJSON.

use super::candidates::Geometry;
use overfly_core::geodesy::degrees_from_mercator;
use overfly_core::tile::{MercatorBounds, TILE_SIZE_PX, TileId};
use overfly_store::{Footprint, Layer, Reader, StoreError};
use serde::Serialize;
use std::collections::HashMap;

/// Most rectangles of one layer: a coarser level is shown where the base level is more ragged than that.
const MAX_RECTANGLES: usize = 20_000;

/// Area of a tile, px^2.
const WHOLE_TILE_PX2: f64 = (TILE_SIZE_PX * TILE_SIZE_PX) as f64;

/// A GeoJSON feature collection, a feature a finished layer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// "FeatureCollection".
    pub r#type: &'static str,
    /// By layer name.
    pub features: Vec<CoveredLayer>,
}

/// A GeoJSON feature.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoveredLayer {
    /// "Feature".
    pub r#type: &'static str,
    /// Disjoint rectangles that together are the ground of which the layer has pixels.
    pub geometry: Geometry,
    /// What is covered.
    pub properties: CoverageProperties,
}

/// What a feature of the coverage says of its layer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoverageProperties {
    /// The layer.
    pub layer: String,
    /// The level whose tiles are drawn: the base level, or a coarser one where that is too ragged.
    pub zoom: u8,
    /// Tiles at that level.
    pub tiles: usize,
    /// Earliest and latest acquisition date, where known.
    pub acquired: Option<(String, String)>,
}

/// The coverage of one layer, or of every finished one.
///
/// # Errors
/// An unknown or unfinished layer, or the store.
pub fn coverage(store: &Reader, layer: Option<&str>) -> Result<Coverage, StoreError> {
    let layers: Vec<&Layer> = match layer {
        Some(name) => vec![store.imagery_layer(name)?],
        None => store.imagery_layers().collect(),
    };
    let features = layers.into_iter().map(|l| covered(store, l)).collect::<Result<_, _>>()?;
    Ok(Coverage { r#type: "FeatureCollection", features })
}

fn covered(store: &Reader, layer: &Layer) -> Result<CoveredLayer, StoreError> {
    let mut zoom = layer.base_zoom;
    let (tiles, rectangles) = loop {
        let footprints = store.footprints(layer, zoom)?;
        let rectangles = imaged(zoom, &footprints);
        if rectangles.len() <= MAX_RECTANGLES || zoom <= layer.min_zoom {
            break (footprints.len(), rectangles);
        }
        zoom -= 1;
    };
    Ok(CoveredLayer {
        r#type: "Feature",
        geometry: Geometry::from_rings(rectangles),
        properties: CoverageProperties { layer: layer.name.clone(), zoom, tiles, acquired: layer.acquired.clone() },
    })
}

/// The rings around the ground of which tiles of one zoom have pixels: whole tiles joined to blocks, the others by their outlines.
fn imaged(zoom: u8, footprints: &[Footprint]) -> Vec<Vec<[f64; 2]>> {
    let is_partly =
        |f: &&Footprint| f.valid_outline.as_ref().is_some_and(|outline| outline.area_px2() < WHOLE_TILE_PX2);
    let (partly, whole): (Vec<_>, Vec<_>) = footprints.iter().partition(is_partly);
    let mut tiles: Vec<TileId> = whole.iter().map(|f| f.tile).collect();
    tiles.sort_unstable();
    let blocks = joined(&tiles).into_iter().map(|block| ring_deg(zoom, &block));
    blocks.chain(partly.iter().flat_map(|f| f.imaged_ground().0).map(|part| bounds_ring_deg(&part))).collect()
}

fn bounds_ring_deg(bounds: &MercatorBounds) -> Vec<[f64; 2]> {
    let corners = [
        [bounds.min_x_m, bounds.min_y_m],
        [bounds.max_x_m, bounds.min_y_m],
        [bounds.max_x_m, bounds.max_y_m],
        [bounds.min_x_m, bounds.max_y_m],
        [bounds.min_x_m, bounds.min_y_m],
    ];
    corners.map(|[x_m, y_m]| degrees_from_mercator(x_m, y_m)).to_vec()
}

/// Columns and rows of a block of tiles, first and last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TileBlock {
    columns: (u32, u32),
    rows: (u32, u32),
}

/// Tiles of one zoom, sorted by row and column, joined to runs along rows, and equal runs of successive rows to blocks.
fn joined(tiles: &[TileId]) -> Vec<TileBlock> {
    let mut blocks: Vec<TileBlock> = Vec::new();
    // By columns: the block that a run of the next row may prolong.
    let mut open: HashMap<(u32, u32), usize> = HashMap::new();
    let mut i = 0;
    while i < tiles.len() {
        let (row, first) = (tiles[i].row(), tiles[i].column());
        let mut last = first;
        i += 1;
        while i < tiles.len() && tiles[i].row() == row && tiles[i].column() == last + 1 {
            last += 1;
            i += 1;
        }
        match open.get(&(first, last)) {
            Some(&block) if blocks[block].rows.1 + 1 == row => blocks[block].rows.1 = row,
            _ => {
                open.insert((first, last), blocks.len());
                blocks.push(TileBlock { columns: (first, last), rows: (row, row) });
            }
        }
    }
    blocks
}

fn ring_deg(zoom: u8, block: &TileBlock) -> Vec<[f64; 2]> {
    let bounds = |column, row| TileId::new(zoom, column, row).expect("taken from a tile").bounds();
    let (upper_left, lower_right) = (bounds(block.columns.0, block.rows.0), bounds(block.columns.1, block.rows.1));
    let (west, north) = (upper_left.west_deg, upper_left.north_deg);
    let (east, south) = (lower_right.east_deg, lower_right.south_deg);
    vec![[west, south], [east, south], [east, north], [west, north], [west, south]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn blocks_are_the_tiles_each_once(cells in prop::collection::btree_set((0u32..12, 0u32..12), 0..80)) {
            let mut tiles: Vec<TileId> = cells.iter().map(|&(x, y)| TileId::new(9, x, y).unwrap()).collect();
            tiles.sort_unstable();
            let mut seen = BTreeSet::new();
            for b in joined(&tiles) {
                for y in b.rows.0..=b.rows.1 {
                    for x in b.columns.0..=b.columns.1 {
                        prop_assert!(seen.insert((x, y)), "twice");
                    }
                }
            }
            prop_assert_eq!(seen, cells);
        }
    }

    #[test]
    fn a_full_rectangle_is_one_block() {
        let mut tiles: Vec<TileId> = (0..5).flat_map(|y| (3..9).map(move |x| TileId::new(9, x, y).unwrap())).collect();
        tiles.sort_unstable();
        assert_eq!(joined(&tiles), [TileBlock { columns: (3, 8), rows: (0, 4) }]);
    }
}
