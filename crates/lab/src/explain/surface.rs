//! `Peaked`: the coarse search's surface under the heading and scale of the answer, and its highest peaks.

use super::{Pose, coarsest, seen};
use overfly_core::camera::Camera;
use overfly_core::feature::Structure;
use overfly_core::geodesy::Geodetic;
use overfly_core::pixels::{Colour, Gray};
use overfly_core::registration::coarse::{CoarseMap, PlacedView, Reach};
use overfly_core::tile::{TILE_SIZE_PX, WorldPixel, gsd_at};
use overfly_flight::locate::{FixRequest, LocateError, PositionPrior};
use overfly_store::{Layer, Reader, StoreError};

/// No more than this of a region is shown to each side, pixels.
const MOST_HALF_PX: f64 = 256.0;
/// Peaks marked, and how far they lie apart, pixels.
const PEAKS: usize = 5;
const APART_PX: f64 = 9.0;

/// T at every place of a region, in standard deviations.
pub struct Peaked {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Metres a pixel.
    pub gsd_m_per_px: f64,
    scores: Vec<f32>,
    /// Column, row and score, best first.
    pub peaks: Vec<([usize; 2], f32)>,
}

impl Peaked {
    /// Over the region of a request, or what lies around `place` of one that is too large to show; `None` where nothing
    /// can be compared.
    pub fn of(
        store: &Reader,
        layer: &Layer,
        gray: &Gray,
        camera: &Camera,
        request: &FixRequest,
        place: Geodetic,
        heading_rad: f64,
    ) -> Result<Option<Self>, LocateError> {
        let zoom = coarsest(camera, layer, place);
        let gsd = gsd_at(place, zoom);
        let (centre, half_m) = match request.position {
            PositionPrior::Square { centre, half_width_m } => (centre, half_width_m),
            PositionPrior::Gaussian { centre, sigma_east_m, sigma_north_m, .. } => {
                (centre, 3.41 * sigma_east_m.max(sigma_north_m))
            }
            PositionPrior::WholeLayer => (place, f64::INFINITY),
        };
        let half_px = half_m / gsd.mean_m_per_px();
        let (centre, half_px) = if half_px > MOST_HALF_PX { (place, MOST_HALF_PX) } else { (centre, half_px) };
        let Ok(middle) = WorldPixel::from_geodetic(centre, zoom) else { return Ok(None) };
        let corner = WorldPixel { x_px: (middle.x_px - half_px).floor(), y_px: (middle.y_px - half_px).floor() };
        let Some(view) = seen(gray, camera, &Pose { nadir: corner, heading_rad }, gsd) else { return Ok(None) };
        let nadir_px = view.grid.nadir_px.map(|v| v.round() as i64);
        let placed = PlacedView { structure: Structure::new(&view.gray, &view.mask), nadir_px };
        let reach = Reach::from_views(std::slice::from_ref(&placed));
        let edge = (2.0 * half_px).ceil() as usize + 1;
        let from = [corner.x_px as i64 - reach.left as i64, corner.y_px as i64 - reach.top as i64];
        let size = [edge + reach.left + reach.right - 1, edge + reach.top + reach.bottom - 1];
        let map = CoarseMap::new(&structure(store, layer, zoom, from, size)?, reach);
        let mut fourier = map.fourier();
        let Some(spread) = map.normalisation(&mut fourier, &placed) else { return Ok(None) };
        let [surface, _] = map.correlate(&mut fourier, [&placed, &placed], &spread);
        Ok(Self::scored(surface.values, map.places(), gsd.mean_m_per_px()))
    }

    fn scored(values: Vec<f32>, size: [usize; 2], gsd_m_per_px: f64) -> Option<Self> {
        let compared = || values.iter().filter(|v| **v != 0.0).map(|v| f64::from(*v));
        let n = compared().count() as f64;
        let mean = compared().sum::<f64>() / n;
        let deviation = (compared().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
        if deviation.is_nan() || deviation <= 0.0 {
            return None;
        }
        let score = |v: f32| if v == 0.0 { 0.0 } else { ((f64::from(v) - mean) / deviation) as f32 };
        let scores: Vec<f32> = values.into_iter().map(score).collect();
        let mut order: Vec<usize> = (0..scores.len()).collect();
        order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
        let mut peaks: Vec<([usize; 2], f32)> = Vec::new();
        for i in order {
            let at = [i % size[0], i / size[0]];
            let far = |p: &[usize; 2]| (p[0] as f64 - at[0] as f64).hypot(p[1] as f64 - at[1] as f64) >= APART_PX;
            if peaks.iter().all(|(p, _)| far(p)) {
                peaks.push((at, scores[i]));
            }
            if peaks.len() == PEAKS {
                break;
            }
        }
        Some(Self { size, gsd_m_per_px, scores, peaks })
    }

    /// The surface as heat, from two deviations below its mean to its highest peak.
    pub fn picture(&self) -> Colour {
        let highest = self.peaks.first().map_or(1.0, |p| p.1);
        let paint = |s: &f32| super::palette::heat((s + 2.0) / (highest + 2.0));
        let values = self.scores.iter().flat_map(paint).collect();
        Colour::from_values(self.size[0], self.size[1], values).expect("three values a pixel")
    }
}

fn structure(
    store: &Reader,
    layer: &Layer,
    zoom: u8,
    from: [i64; 2],
    size: [usize; 2],
) -> Result<Structure, StoreError> {
    let mut map = Structure::unknown(size[0], size[1]);
    let edge = i64::from(TILE_SIZE_PX);
    let tiles = |axis: usize| from[axis].div_euclid(edge)..=(from[axis] + size[axis] as i64 - 1).div_euclid(edge);
    for row in tiles(1) {
        for column in tiles(0) {
            if let Some(tile) = store.structure(layer, zoom, column, row)? {
                map.paste(&tile, column * edge - from[0], row * edge - from[1]);
            }
        }
    }
    Ok(map)
}
