//! `evaluate cost`: how the time of a search grows with the tiles it searches.
//!
//! A frame is cut from the map itself, turned, made noisy, and searched for in squares of more and more tiles. The
//! line through the medians is t = constant + K1 times tiles.

use super::csv_file::{Decimals, Shortest, write_csv};
use super::error::TrialError;
use super::mapped_ground::MappedGround;
use super::quantiles::Quantiles;
use overfly_core::camera::{Camera, View};
use overfly_core::geodesy::{BodyFrame, Enu, Geodetic, LocalFrame};
use overfly_core::pixels::Gray;
use overfly_core::tile::{Gsd, TILE_SIZE_PX, TileId, WorldPixel, gsd_at};
use overfly_flight::locate::{Answer, FixRequest, HeadingPrior, LocateError, PositionPrior, locate};
use overfly_store::{Layer, Reader};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The options of a measurement.
#[derive(Debug, Clone)]
pub struct CostTrial {
    /// Layer to search.
    pub layer: String,
    /// Areas to search, base tiles.
    pub tiles: Vec<f64>,
    /// Searches of each area, each from a prior of its own.
    pub repeats: usize,
    /// Columns and rows of the frame. Its pixels are as large as the map's.
    pub frame_px: [usize; 2],
    /// Whether the heading is unknown to the search.
    pub unknown_heading: bool,
    /// Seed of priors and noise.
    pub seed: u64,
    /// Threads of each search.
    pub threads: usize,
}

/// The searches of one area.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CostStep {
    /// Area of the square, base tiles.
    pub tiles: f64,
    /// Half its edge, metres.
    pub half_width_m: f64,
    /// Base tiles that meet the square, or a frame within it.
    pub tiles_searched: usize,
    /// Nominal count of the search, by the paper's model.
    pub nominal_count: f64,
    /// Searches that found the frame.
    pub right: usize,
    /// Searches made.
    pub repeats: usize,
    /// Duration of the first search, before which nothing of the area had been read, milliseconds.
    pub first_ms: f64,
    /// Durations of all other searches, milliseconds.
    pub elapsed_ms: Quantiles,
}

/// The summary of `evaluate cost`, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// Columns and rows of the frame.
    pub frame_px: [usize; 2],
    /// Whether the heading was unknown to the search.
    pub unknown_heading: bool,
    /// K1: slope of the least-squares line through the medians, seconds per base tile.
    pub seconds_per_tile: f64,
    /// Intercept of the same line, seconds.
    pub constant_s: f64,
    /// The results, area by area.
    pub steps: Vec<CostStep>,
    /// Areas that were skipped because the layer covers less than nine tenths of them, base tiles.
    pub skipped: Vec<f64>,
    /// Threads of each search.
    pub threads: usize,
}

/// True heading of the frame.
const HEADING_RAD: f64 = 0.6;
/// Noise added to the frame, one standard deviation, gray levels.
const NOISE: f32 = 4.0;
/// Greatest error of a right fix, pixels of the map.
const RIGHT_PX: f64 = 3.0;

impl CostTrial {
    /// Measures every area; calls `progress` after each.
    ///
    /// # Errors
    /// If an option is out of range, the layer is smaller than the frame, or the store fails.
    pub fn run(&self, store: &Reader, mut progress: impl FnMut(&CostStep)) -> Result<Cost, TrialError> {
        let refuse = |name, value: f64, expected| Err(TrialError::Option { name, value, expected });
        if self.repeats < 2 {
            return refuse("repeats", self.repeats as f64, "at least 2");
        }
        if let Some(&tiles) = self.tiles.iter().find(|t| !(t.is_finite() && **t > 0.0)) {
            return refuse("tiles", tiles, "positive areas, in base tiles");
        }
        let fail = |cause: LocateError| TrialError::Locate { image: "a frame cut from the map".into(), cause };
        let layer = store.layer(&self.layer).map_err(|e| fail(e.into()))?;
        let ground = MappedGround::read(store, layer).map_err(|e| fail(e.into()))?;
        let Some(place) = ground.middle() else {
            return refuse("tiles", 0.0, "a layer with imagery");
        };
        let gsd = gsd_at(place, layer.base_zoom);
        let gray = self.cut(store, layer, place, gsd).map_err(fail)?;
        let (mut steps, mut skipped) = (Vec::new(), Vec::new());
        for &tiles in &self.tiles {
            let half_width_m = tiles.sqrt() * f64::from(TILE_SIZE_PX) * gsd.mean_m_per_px() / 2.0;
            if ground.shared_m2(place, half_width_m) < 0.9 * (2.0 * half_width_m).powi(2) {
                skipped.push(tiles);
                continue;
            }
            let step = self.step(store, &gray, place, gsd, tiles, half_width_m).map_err(fail)?;
            progress(&step);
            steps.push(step);
        }
        let [constant_s, seconds_per_tile] = line(&steps);
        let (frame_px, unknown_heading, threads) = (self.frame_px, self.unknown_heading, self.threads);
        Ok(Cost { frame_px, unknown_heading, seconds_per_tile, constant_s, steps, skipped, threads })
    }

    fn step(
        &self,
        store: &Reader,
        gray: &Gray,
        place: Geodetic,
        gsd: Gsd,
        tiles: f64,
        half_width_m: f64,
    ) -> Result<CostStep, LocateError> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let frame = LocalFrame::at(place);
        let (mut times, mut right, mut searched, mut nominal_count) = (Vec::new(), 0, 0, 0.0);
        for _ in 0..self.repeats {
            let mut axis = || rng.random_range(-0.4..0.4) * half_width_m;
            let offset = Enu { east_m: axis(), north_m: axis() };
            let centre = frame.geodetic_from_enu(offset).unwrap_or(place);
            let request = FixRequest {
                layer: self.layer.clone(),
                position: PositionPrior::Square { centre, half_width_m },
                heading: (!self.unknown_heading)
                    .then_some(HeadingPrior { heading_rad: HEADING_RAD + 0.01, sigma_rad: 3f64.to_radians() }),
                view: View::Nadir { gsd_m_per_px: gsd.mean_m_per_px() },
                scale_sigma_ratio: 0.03,
                time_s: None,
            };
            let asked = Instant::now();
            let answer = locate(store, gray, &request, self.threads)?;
            times.push(asked.elapsed().as_secs_f64() * 1e3);
            (searched, nominal_count) = match &answer {
                Answer::Fix(fix) => (fix.tiles_searched, fix.nominal_count),
                Answer::NoFix(no_fix) => (no_fix.tiles_searched, no_fix.nominal_count),
            };
            right += usize::from(is_right(&answer, &frame, gsd));
        }
        let first_ms = times.remove(0);
        let elapsed_ms = Quantiles::from_values(times).expect("at least two searches");
        let repeats = self.repeats;
        Ok(CostStep {
            tiles,
            half_width_m,
            tiles_searched: searched,
            nominal_count,
            right,
            repeats,
            first_ms,
            elapsed_ms,
        })
    }

    /// Draws what a camera above `place` would see if the map were the ground.
    fn cut(&self, store: &Reader, layer: &Layer, place: Geodetic, gsd: Gsd) -> Result<Gray, LocateError> {
        let [width, height] = self.frame_px;
        let view = View::Nadir { gsd_m_per_px: gsd.mean_m_per_px() };
        let camera = Camera::new(&view, width as u32, height as u32)?;
        let reach_px = ((width as f64).hypot(height as f64) / 2.0).ceil() as i64 + 8;
        let Ok(at) = WorldPixel::from_geodetic(place, layer.base_zoom) else {
            return Ok(Gray::filled(width, height, 0.0));
        };
        let corner = [at.x_px as i64 - reach_px, at.y_px as i64 - reach_px];
        let map = window(store, layer, corner, 2 * reach_px as usize)?;
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let frame = BodyFrame::from_heading_rad(HEADING_RAD);
        let mut seen = Gray::filled(width, height, 0.0);
        for (i, value) in seen.values_mut().iter_mut().enumerate() {
            let pixel = [(i % width) as f64 + 0.5, (i / width) as f64 + 0.5];
            let Enu { east_m, north_m } = frame.enu_from_body(camera.body_from_frame(pixel).unwrap_or_default());
            let (x, y) = (at.x_px + east_m / gsd.east_m_per_px, at.y_px - north_m / gsd.north_m_per_px);
            // The sum of twelve uniform numbers, minus six, is close enough to normal.
            let noise = (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
            let shown = map.sample(x - corner[0] as f64, y - corner[1] as f64);
            *value = (shown + NOISE * noise).round().clamp(0.0, 255.0);
        }
        Ok(seen)
    }
}

/// Returns a square of the base level; 0 where the map has no pixel.
fn window(store: &Reader, layer: &Layer, corner: [i64; 2], edge_px: usize) -> Result<Gray, LocateError> {
    let size = i64::from(TILE_SIZE_PX);
    let mut map = Gray::filled(edge_px, edge_px, 0.0);
    let range = |from: i64| from.div_euclid(size)..=(from + edge_px as i64 - 1).div_euclid(size);
    for row in range(corner[1]) {
        for column in range(corner[0]) {
            let id = u32::try_from(column).ok().zip(u32::try_from(row).ok());
            let Some(Ok(id)) = id.map(|(c, r)| TileId::new(layer.base_zoom, c, r)) else { continue };
            let Some(tile) = store.tile(layer, id)? else { continue };
            let gray = tile.colour.to_gray();
            for y in (row * size).max(corner[1])..((row + 1) * size).min(corner[1] + edge_px as i64) {
                for x in (column * size).max(corner[0])..((column + 1) * size).min(corner[0] + edge_px as i64) {
                    let to = (y - corner[1]) as usize * edge_px + (x - corner[0]) as usize;
                    map.values_mut()[to] = gray.at((x - column * size) as usize, (y - row * size) as usize);
                }
            }
        }
    }
    Ok(map)
}

fn is_right(answer: &Answer, frame: &LocalFrame, gsd: Gsd) -> bool {
    let Answer::Fix(fix) = answer else { return false };
    frame.enu_from_geodetic(fix.position).length_m() <= RIGHT_PX * gsd.mean_m_per_px()
}

/// Constant (s) and slope (s per tile) of the least-squares line through the medians.
fn line(steps: &[CostStep]) -> [f64; 2] {
    let n = steps.len() as f64;
    let mean = |of: fn(&CostStep) -> f64| steps.iter().map(of).sum::<f64>() / n.max(1.0);
    let (x, y) = (mean(|s| s.tiles), mean(|s| s.elapsed_ms.median / 1e3));
    let sxx: f64 = steps.iter().map(|s| (s.tiles - x).powi(2)).sum();
    let sxy: f64 = steps.iter().map(|s| (s.tiles - x) * (s.elapsed_ms.median / 1e3 - y)).sum();
    let slope = if sxx > 0.0 { sxy / sxx } else { 0.0 };
    [y - slope * x, slope]
}

/// A row of `cost.csv`.
#[derive(Serialize, Default)]
struct CostRow {
    tiles: Shortest,
    half_width_m: Decimals<1>,
    tiles_searched: usize,
    nominal_count: Decimals<2>,
    right: usize,
    repeats: usize,
    first_ms: Decimals<3>,
    median_ms: Decimals<3>,
    p95_ms: Decimals<3>,
    max_ms: Decimals<3>,
}

impl CostRow {
    fn new(s: &CostStep) -> Self {
        Self {
            tiles: Shortest(s.tiles),
            half_width_m: Decimals(s.half_width_m),
            tiles_searched: s.tiles_searched,
            nominal_count: Decimals(s.nominal_count),
            right: s.right,
            repeats: s.repeats,
            first_ms: Decimals(s.first_ms),
            median_ms: Decimals(s.elapsed_ms.median),
            p95_ms: Decimals(s.elapsed_ms.p95),
            max_ms: Decimals(s.elapsed_ms.max),
        }
    }
}

/// Writes `cost.csv` into a folder, which is made if absent, and returns the path of the file.
///
/// # Errors
/// [`TrialError::Unwritable`].
pub fn write_cost(folder: &Path, cost: &Cost) -> Result<PathBuf, TrialError> {
    write_csv(folder, "cost.csv", cost.steps.iter().map(CostRow::new))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_goes_through_points_on_a_line() {
        let step = |tiles: f64| CostStep {
            tiles,
            half_width_m: 100.0,
            tiles_searched: 4,
            nominal_count: 4.0,
            right: 5,
            repeats: 6,
            first_ms: 90.0,
            elapsed_ms: Quantiles { median: 12.0 + 3.0 * tiles, p95: 50.0, max: 60.0 },
        };
        let [constant_s, seconds_per_tile] = line(&[step(1.0), step(4.0), step(100.0)]);
        assert!((constant_s - 0.012).abs() < 1e-12 && (seconds_per_tile - 0.003).abs() < 1e-12);
        assert_eq!(line(&[]), [0.0, 0.0]);
    }
}
