//! Warping a source to a tile of the matrix.
//!
//! A tile pixel that covers at most about one source pixel is interpolated at its centre. One that covers more is the mean
//! of samples spread over its whole footprint, no farther apart than a pixel of the level that they are taken from.

use super::block::{BlockCache, BlockSource, RasterLevel};
use super::error::RasterError;
use super::georeference::Georeference;
use super::mapping::{Cell, CellFit, fit};
use super::window::{CachedBlocks, Sample, Window, unmultiplied};
use overfly_core::pixels::{Colour, Mask, MaskedColour};
use overfly_core::tile::{TILE_SIZE_PX, TileId};

/// Edge of a cell of the position lattice, pixels. A tile's edge is a multiple of it.
const CELL_PX: i64 = 64;
/// A tile pixel over at most this many source pixels is interpolated, not averaged. A source on the matrix itself gives
/// 1, and a level chosen by `zoom_for_gsd` up to 1.02.
const INTERPOLATED_UP_TO: f64 = 1.05;
/// An overview is used only where at least this many of its pixels are averaged per axis, because overviews are often made
/// by dropping pixels.
const OVERVIEW_OVERSAMPLING: f64 = 2.0;
/// A window of more pixels is split (16 MB).
const MAX_WINDOW_PX: f64 = 1024.0 * 1024.0;
/// The most samples per axis of one tile pixel. Beyond 256 source pixels per tile pixel they no longer touch.
const MAX_SAMPLES: f64 = 256.0;

/// A source and the cache of its blocks.
pub(super) struct Warp<'a> {
    pub georeference: &'a Georeference,
    pub source: &'a dyn BlockSource,
    pub cache: &'a BlockCache,
    pub source_key: u64,
    /// Whether red and green of a pixel are the bytes of one number.
    pub heights: bool,
}

/// A tile that is being filled.
struct TileCanvas {
    /// The tile's upper-left pixel in the world of its zoom.
    x: i64,
    y: i64,
    zoom: u8,
    /// RGB and validity of the tile's pixels, row by row.
    colour: Vec<u8>,
    mask: Vec<u8>,
    any_valid: bool,
    heights: bool,
    window: Window,
    sums: Vec<Sample>,
}

impl Warp<'_> {
    /// Returns the tile's pixels; `None` where no pixel is valid.
    pub fn tile(&self, tile: TileId) -> Result<Option<MaskedColour>, RasterError> {
        let edge = TILE_SIZE_PX as usize;
        let (x, y) =
            (i64::from(tile.column()) * i64::from(TILE_SIZE_PX), i64::from(tile.row()) * i64::from(TILE_SIZE_PX));
        let zoom = tile.zoom();
        if !self.may_touch(zoom, x, y, i64::from(TILE_SIZE_PX)) {
            return Ok(None);
        }
        let mut canvas = TileCanvas {
            x,
            y,
            zoom,
            colour: vec![0; edge * edge * 3],
            mask: vec![0; edge * edge],
            any_valid: false,
            heights: self.heights,
            window: Window::default(),
            sums: Vec::new(),
        };
        for cell_y in (y..y + edge as i64).step_by(CELL_PX as usize) {
            for cell_x in (x..x + edge as i64).step_by(CELL_PX as usize) {
                self.fill(&mut canvas, cell_x, cell_y, CELL_PX)?;
            }
        }
        Ok(canvas.any_valid.then(|| MaskedColour {
            colour: Colour::from_values(edge, edge, canvas.colour).expect("three values a pixel"),
            mask: Mask::from_values(edge, edge, canvas.mask).expect("one value a pixel"),
        }))
    }

    /// Whether a square of the world's pixels may meet the source's extent, on either side of the antimeridian.
    fn may_touch(&self, zoom: u8, x: i64, y: i64, size: i64) -> bool {
        let world_px = f64::from(TILE_SIZE_PX) * (1u64 << zoom) as f64;
        let [west, north, east, south] = self.georeference.world.map(|v| v * world_px);
        let (x0, y0, x1, y1) = (x as f64, y as f64, (x + size) as f64, (y + size) as f64);
        y0 < south
            && north < y1
            && [-1.0, 0.0, 1.0].into_iter().any(|k| x0 + k * world_px < east && west < x1 + k * world_px)
    }

    fn fill(&self, canvas: &mut TileCanvas, x: i64, y: i64, size: i64) -> Result<(), RasterError> {
        if !self.may_touch(canvas.zoom, x, y, size) {
            return Ok(());
        }
        let cell = match fit(self.georeference, canvas.zoom, x, y, size) {
            CellFit::Nowhere => return Ok(()),
            CellFit::Bilinear(cell) => Some(cell),
            CellFit::Bent => None,
        };
        if let Some(cell) = cell {
            let ([left, top], [right, bottom]) = cell.source_bounds();
            let (width, height) = self.georeference.size_px;
            if left >= width || top >= height || right <= 0.0 || bottom <= 0.0 {
                return Ok(());
            }
            let (level, cell) = self.choose_level(cell);
            let ([left, top], [right, bottom]) = cell.source_bounds();
            if size == 1 || (right - left + 6.0) * (bottom - top + 6.0) <= MAX_WINDOW_PX {
                return self.draw(canvas, level, &cell);
            }
        } else if size == 1 {
            return Ok(());
        }
        for (quarter_x, quarter_y) in Cell::quarters(x, y, size) {
            self.fill(canvas, quarter_x, quarter_y, size / 2)?;
        }
        Ok(())
    }

    /// Returns the coarsest level that still leaves enough pixels to average, and the cell in its pixels.
    fn choose_level(&self, cell: Cell) -> (usize, Cell) {
        let (across, down) = cell.shrink();
        let levels = self.source.levels();
        let scale = |level: &RasterLevel| {
            [level.width_px as f64 / levels[0].width_px as f64, level.height_px as f64 / levels[0].height_px as f64]
        };
        let enough =
            |level: &RasterLevel| across.min(down) * scale(level)[0].min(scale(level)[1]) >= OVERVIEW_OVERSAMPLING;
        let chosen = levels.iter().rposition(enough).unwrap_or(0);
        (chosen, cell.scaled(scale(&levels[chosen])))
    }

    fn draw(&self, canvas: &mut TileCanvas, level: usize, cell: &Cell) -> Result<(), RasterError> {
        let ([left, top], [right, bottom]) = cell.source_bounds();
        if (right - left + 6.0) * (bottom - top + 6.0) > 4.0 * MAX_WINDOW_PX {
            return self.draw_sparsely(canvas, level, cell);
        }
        // Three more pixels on each side: two for the kernel, and one for rounding.
        let (x0, y0) = (left.floor() as i64 - 3, top.floor() as i64 - 3);
        let (x1, y1) = (right.ceil() as i64 + 3, bottom.ceil() as i64 + 3);
        self.load(&mut canvas.window, level, [x0, y0, x1, y1])?;
        let (across, down) = cell.shrink();
        if across <= INTERPOLATED_UP_TO && down <= INTERPOLATED_UP_TO {
            canvas.interpolate(cell);
        } else {
            let samples =
                |shrink: f64| if shrink <= INTERPOLATED_UP_TO { 1 } else { shrink.ceil().min(MAX_SAMPLES) as usize };
            canvas.average(cell, samples(across), samples(down));
        }
        Ok(())
    }

    /// Draws one tile pixel that covers more than a whole window of the source: single source pixels stand for the rest.
    fn draw_sparsely(&self, canvas: &mut TileCanvas, level: usize, cell: &Cell) -> Result<(), RasterError> {
        const PER_AXIS: usize = 32;
        let mut sum = [0.0f32; 4];
        for i in 0..PER_AXIS * PER_AXIS {
            let share = |k: usize| (k as f64 + 0.5) / PER_AXIS as f64;
            let [x, y] = cell.at(share(i % PER_AXIS), share(i / PER_AXIS));
            let (column, row) = (x.floor() as i64, y.floor() as i64);
            self.load(&mut canvas.window, level, [column, row, column + 2, row + 2])?;
            let centre = [column as f64 + 0.5, row as f64 + 0.5];
            let value = canvas.window.sample(canvas.window.walk(centre, [0.0; 2]).next_position());
            for c in 0..4 {
                sum[c] += value[c] / (PER_AXIS * PER_AXIS) as f32;
            }
        }
        canvas.put_mean(canvas.index(cell.x, cell.y), sum);
        Ok(())
    }

    /// Fills the window [x0, x1) x [y0, y1) of a level from its blocks.
    fn load(&self, window: &mut Window, level: usize, bounds: [i64; 4]) -> Result<(), RasterError> {
        window.load(
            &CachedBlocks { source: self.source, cache: self.cache, source_key: self.source_key },
            level,
            bounds,
        )
    }
}

impl TileCanvas {
    fn interpolate(&mut self, cell: &Cell) {
        let size = cell.size as f64;
        for j in 0..cell.size {
            let (start, step) = row_positions(cell, (j as f64 + 0.5) / size, size);
            let mut walk = self.window.walk(start, step);
            let first = self.index(cell.x, cell.y + j);
            for i in first..first + cell.size as usize {
                if let Some(sample) = self.window.interpolate(walk.next_position()) {
                    self.put(i, sample);
                }
            }
        }
    }

    /// Draws each pixel of the cell as the mean of `across` x `down` samples.
    fn average(&mut self, cell: &Cell, across: usize, down: usize) {
        let size = cell.size as usize;
        let share = 1.0 / (across * down) as f32;
        for j in 0..size {
            self.sums.clear();
            self.sums.resize(size, [0.0; 4]);
            for sub in 0..down {
                let ty = ((j * down + sub) as f64 + 0.5) / (size * down) as f64;
                let (start, step) = row_positions(cell, ty, (size * across) as f64);
                let mut walk = self.window.walk(start, step);
                for sum in &mut self.sums {
                    for _ in 0..across {
                        let value = self.window.sample(walk.next_position());
                        for c in 0..4 {
                            sum[c] += value[c];
                        }
                    }
                }
            }
            let first = self.index(cell.x, cell.y + j as i64);
            for i in 0..size {
                let mean = self.sums[i].map(|v| v * share);
                self.put_mean(first + i, mean);
            }
        }
    }

    /// Returns the index of a world pixel in the tile.
    fn index(&self, x: i64, y: i64) -> usize {
        (y - self.y) as usize * TILE_SIZE_PX as usize + (x - self.x) as usize
    }

    /// Puts a premultiplied mean where at least half of the pixel's area is valid (less rounding).
    fn put_mean(&mut self, index: usize, mean: Sample) {
        if mean[3] >= 127.4 {
            self.put(index, unmultiplied(mean));
        }
    }

    fn put(&mut self, index: usize, colour: Sample) {
        // Cubic convolution overshoots, hence the clamp. Adding 2^23 leaves the rounded value in the lowest bits.
        let byte = |v: f32| (v.clamp(0.0, 255.0) + 8_388_608.0).to_bits() as u8;
        let mut bytes = colour.map(byte);
        if self.heights {
            // The steps are interpolated, not their bytes.
            let step = (256.0 * colour[0] + colour[1]).round().clamp(0.0, 65_534.0) as u16;
            bytes[..2].copy_from_slice(&step.to_be_bytes());
        }
        self.colour[index * 3..index * 3 + 3].copy_from_slice(&bytes[..3]);
        self.mask[index] = bytes[3];
        self.any_valid = true;
    }
}

/// Returns the first of `count` positions along a row of a cell, and the step between them.
fn row_positions(cell: &Cell, ty: f64, count: f64) -> ([f64; 2], [f64; 2]) {
    let (start, end) = (cell.at(0.0, ty), cell.at(1.0, ty));
    let step = [(end[0] - start[0]) / count, (end[1] - start[1]) / count];
    ([start[0] + step[0] / 2.0, start[1] + step[1] / 2.0], step)
}
