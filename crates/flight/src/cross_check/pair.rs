//! `LayerPair`: the shift between two layers of a store.

use crate::locate::{Answer, FixRequest, HeadingPrior, LocateError, PositionPrior, locate};
use overfly_core::camera::View;
use overfly_core::geodesy::{Enu, GeodeticBounds, LocalFrame, WORLD_M};
use overfly_core::tile::{MercatorBounds, TILE_SIZE_PX, TileId, WorldPixel, gsd_at};
use overfly_store::{Layer, Reader, StoreError};

/// Patches of a pair that are located.
pub const PATCHES: usize = 40;
/// Edge of a patch, pixels. Its middle is that of a cell of a tile.
const PATCH_PX: usize = 192;
const CELL_PX: usize = 32;
/// Cells along the edge of a tile.
const PER_TILE: usize = TILE_SIZE_PX as usize / CELL_PX;
/// Places at which a patch is tried at most.
const TRIES: usize = 1600;
/// Of this share of a patch both layers have pixels: specks without data are common in maps.
const LEAST_VALID: f64 = 0.98;
/// The golden ratio less one: its multiples fill the unit interval evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Fewer patches found measure no shift.
const LEAST_FOUND: usize = 5;
/// The other layer is searched around the patch's place under this standard deviation, pixels, and at least metres.
const SIGMA_PX: f64 = 12.0;
const LEAST_SIGMA_M: f64 = 10.0;
/// Both layers have one scale and one north, but for what their makers got wrong.
const HEADING_SIGMA_DEG: f64 = 1.0;
const SCALE_SIGMA_RATIO: f64 = 0.01;
/// The standard deviation of a Gaussian over its median absolute deviation.
const SIGMA_OF_MAD: f64 = 1.4826;

/// Two layers compared on the ground that both show.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerPair {
    /// The layers' names.
    pub layers: [String; 2],
    /// The level of the patches.
    pub zoom: u8,
    /// Patches of the first layer that were located on the second.
    pub compared: usize,
    /// Of these: found.
    pub found: usize,
    /// The shift, where enough were found.
    pub shift: Option<PairShift>,
}

/// How far the first layer of a pair lies off the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairShift {
    /// Where the first layer puts a thing, less where the second puts it: the median over the patches.
    pub median: Enu,
    /// Standard deviation per axis of the patches around the median, metres, from the median absolute deviation.
    pub scatter_m: f64,
    /// The farthest patch from the median, metres.
    pub farthest_m: f64,
}

impl LayerPair {
    /// Locates the patches of common ground of the first layer on the second.
    ///
    /// # Errors
    /// [`LocateError::Store`] where a tile cannot be read.
    pub fn new(
        store: &Reader,
        [a, b]: [&Layer; 2],
        ground: &CommonGround,
        threads: usize,
        report: &dyn Fn(usize),
    ) -> Result<Self, LocateError> {
        let CommonGround { zoom, corners_px } = ground;
        let mut shifts = Vec::new();
        for (done, corner_px) in corners_px.iter().enumerate() {
            report(done);
            shifts.extend(patch_shift(store, *zoom, *corner_px, [a, b], threads)?);
        }
        report(PATCHES);
        let layers = [a, b].map(|layer| layer.name.clone());
        let (compared, found) = (corners_px.len(), shifts.len());
        Ok(Self { layers, zoom: *zoom, compared, found, shift: PairShift::new(&shifts) })
    }
}

impl PairShift {
    fn new(shifts: &[Enu]) -> Option<Self> {
        if shifts.len() < LEAST_FOUND {
            return None;
        }
        let along = |axis: fn(&Enu) -> f64| median(shifts.iter().map(axis).collect());
        let middle = Enu { east_m: along(|s| s.east_m)?, north_m: along(|s| s.north_m)? };
        let off = |s: &Enu| [s.east_m - middle.east_m, s.north_m - middle.north_m];
        let deviations = shifts.iter().flat_map(|s| off(s).map(f64::abs)).collect();
        let farthest_m = shifts.iter().map(|s| off(s)[0].hypot(off(s)[1])).fold(0.0, f64::max);
        Some(Self { median: middle, scatter_m: SIGMA_OF_MAD * median(deviations)?, farthest_m })
    }
}

/// Patches of the ground that two layers show.
pub struct CommonGround {
    /// The finer level that both have.
    pub zoom: u8,
    /// Corners of patches of which both layers have almost all pixels, pixels of the world; at least one.
    pub corners_px: Vec<[i64; 2]>,
}

impl CommonGround {
    /// Spreads patches evenly over what the smaller of two layers shows within the bounds of the other, whatever its shape. `None` where they
    /// have no level in common, or no ground.
    ///
    /// # Errors
    /// Where a tile cannot be read.
    pub fn new(store: &Reader, [a, b]: [&Layer; 2]) -> Result<Option<Self>, StoreError> {
        let zoom = a.base_zoom.min(b.base_zoom);
        if zoom < a.min_zoom.max(b.min_zoom) {
            return Ok(None);
        }
        let tiles_at = |layer: &Layer| layer.base_tiles >> (2 * u32::from(layer.base_zoom - zoom)).min(63);
        let [smaller, larger] = if tiles_at(a) <= tiles_at(b) { [a, b] } else { [b, a] };
        let footprints = match mercator_bounds(larger.bounds_deg, zoom) {
            Some(within) => store.footprints_in(smaller, zoom, &within)?,
            None => store.footprints(smaller, zoom)?,
        };
        let tiles: Vec<_> = footprints.into_iter().map(|footprint| footprint.tile).collect();
        let corners_px = common_patches(store, [larger, smaller], zoom, &tiles)?;
        Ok(if corners_px.is_empty() { None } else { Some(Self { zoom, corners_px }) })
    }
}

/// The tiles of a level that bounds touch, as an extent; `None` where a corner lies beyond the tile matrix.
fn mercator_bounds(bounds: GeodeticBounds, zoom: u8) -> Option<MercatorBounds> {
    let north_west = TileId::containing(bounds.north_west().ok()?, zoom).ok()?.mercator_bounds();
    let south_east = TileId::containing(bounds.south_east().ok()?, zoom).ok()?.mercator_bounds();
    let past_antimeridian_m = if south_east.max_x_m <= north_west.min_x_m { WORLD_M } else { 0.0 };
    Some(MercatorBounds {
        min_x_m: north_west.min_x_m,
        min_y_m: south_east.min_y_m,
        max_x_m: south_east.max_x_m + past_antimeridian_m,
        max_y_m: north_west.max_y_m,
    })
}

/// Corners of patches on tiles, pixels of the world, of which both layers have almost all pixels. The first layer is asked first.
fn common_patches(
    store: &Reader,
    layers: [&Layer; 2],
    zoom: u8,
    tiles: &[TileId],
) -> Result<Vec<[i64; 2]>, StoreError> {
    let cells = PER_TILE * PER_TILE * tiles.len();
    let mut common = Vec::new();
    for i in 0..(2 * cells).min(TRIES) {
        let cell = ((i as f64 * GOLDEN).fract() * cells as f64) as usize;
        let (tile, cell) = (tiles[cell / PER_TILE.pow(2)], cell % PER_TILE.pow(2));
        let corner = |tile: u32, cell: usize| {
            let middle = (tile as usize * PER_TILE + cell) * CELL_PX + CELL_PX / 2;
            middle as i64 - PATCH_PX as i64 / 2
        };
        let corner_px = [corner(tile.column(), cell % PER_TILE), corner(tile.row(), cell / PER_TILE)];
        if common.contains(&corner_px) {
            continue;
        }
        let is_shown = |layer: &Layer| -> Result<bool, StoreError> {
            Ok(store.gray_window(layer, zoom, corner_px, [PATCH_PX; 2])?.1.valid_fraction() >= LEAST_VALID)
        };
        if is_shown(layers[0])? && is_shown(layers[1])? {
            common.push(corner_px);
        }
        if common.len() == PATCHES {
            break;
        }
    }
    Ok(common)
}

/// Where the first layer shows the ground of a patch, less where the second does; `None` where the patch is not found.
fn patch_shift(
    store: &Reader,
    zoom: u8,
    corner_px: [i64; 2],
    [a, b]: [&Layer; 2],
    threads: usize,
) -> Result<Option<Enu>, LocateError> {
    let (frame, _) = store.gray_window(a, zoom, corner_px, [PATCH_PX; 2])?;
    let [x_px, y_px] = corner_px.map(|corner| corner as f64 + PATCH_PX as f64 / 2.0);
    let Ok(centre) = (WorldPixel { x_px, y_px }).to_geodetic(zoom) else { return Ok(None) };
    let gsd_m_per_px = gsd_at(centre, zoom).mean_m_per_px();
    let sigma_m = (SIGMA_PX * gsd_m_per_px).max(LEAST_SIGMA_M);
    let request = FixRequest {
        layer: b.name.clone(),
        position: PositionPrior::Gaussian { centre, sigma_east_m: sigma_m, sigma_north_m: sigma_m, correlation: 0.0 },
        heading: Some(HeadingPrior { heading_rad: 0.0, sigma_rad: HEADING_SIGMA_DEG.to_radians() }),
        view: View::Nadir { gsd_m_per_px },
        scale_sigma_ratio: SCALE_SIGMA_RATIO,
        time_s: None,
    };
    let Answer::Fix(fix) = locate(store, &frame, &request, threads)? else { return Ok(None) };
    let on_other = LocalFrame::at(centre).enu_from_geodetic(fix.image_centre);
    Ok(Some(Enu { east_m: -on_other.east_m, north_m: -on_other.north_m }))
}

/// The middle value, or the mean of the two in the middle; `None` where there is none.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { None } else { Some((values[(n - 1) / 2] + values[n / 2]) / 2.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shift_is_the_median_and_one_patch_in_five_moves_nothing() {
        let mut shifts: Vec<_> =
            (0..20).map(|i| Enu { east_m: 2.0 + 0.1 * f64::from(i % 5 - 2), north_m: -1.0 }).collect();
        shifts.extend((0..4).map(|i| Enu { east_m: 90.0 * f64::from(i), north_m: 70.0 }));
        let found = PairShift::new(&shifts).unwrap();
        assert!((found.median.east_m - 2.1).abs() < 0.11 && found.median.north_m == -1.0, "{found:?}");
        assert!(found.scatter_m < 0.3 && found.farthest_m > 200.0, "{found:?}");
        assert_eq!(PairShift::new(&shifts[..4]), None);
    }

    #[test]
    fn medians() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }
}
