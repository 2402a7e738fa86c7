//! `Cell`: a square of tile pixels and the positions of its corners in the source.
//!
//! Positions are exact at the nodes of a lattice that is fixed to the tile matrix, and bilinear between them. A cell in
//! which the bilinear positions would err by more than [`TOLERANCE_PX`] is split. So the content of a pixel depends on the
//! matrix and the source alone, not on the tile that is requested.

use super::georeference::Georeference;
use overfly_core::tile::WorldPixel;

/// The largest error of bilinear positions, as a share of a source pixel, or of a tile pixel where that is larger.
const TOLERANCE_PX: f64 = 0.02;

/// A square of tile pixels, with source positions at its corners.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    /// Column of the upper-left pixel in the world of the zoom.
    pub x: i64,
    /// Row of the upper-left pixel in the world of the zoom.
    pub y: i64,
    /// Edge in pixels, a power of two.
    pub size: i64,
    /// Source pixel positions at the upper left, upper right, lower left, lower right.
    pub corners: [[f64; 2]; 4],
}

/// How the positions of a cell can be computed.
pub(super) enum CellFit {
    /// No point of the cell can be projected.
    Nowhere,
    /// Bilinear positions are accurate enough.
    Bilinear(Cell),
    /// The cell must be split, or left out where it is one pixel large.
    Bent,
}

/// Fits a cell. Of nine exact positions, four are its corners and five check the bilinear ones.
pub(super) fn fit(georeference: &Georeference, zoom: u8, x: i64, y: i64, size: i64) -> CellFit {
    let half = size as f64 / 2.0;
    let exact: [Option<[f64; 2]>; 9] = std::array::from_fn(|i| {
        let (ix, iy) = ((i % 3) as f64, (i / 3) as f64);
        let world = WorldPixel { x_px: x as f64 + ix * half, y_px: y as f64 + iy * half };
        let point = world.to_geodetic(zoom).ok()?;
        georeference.pixel_from_geodetic(point).map(|(u, v)| [u, v])
    });
    if exact.iter().all(Option::is_none) {
        return CellFit::Nowhere;
    }
    let [Some(nw), Some(ne), Some(sw), Some(se)] = [exact[0], exact[2], exact[6], exact[8]] else {
        return CellFit::Bent;
    };
    let cell = Cell { x, y, size, corners: [nw, ne, sw, se] };
    let (across, down) = cell.shrink();
    let tolerance_px = TOLERANCE_PX * across.min(down).max(1.0);
    // Conformal maps are harmonic: their curvature cancels at the centre, so the edges are checked too.
    for i in [1, 3, 4, 5, 7] {
        let Some(exact) = exact[i] else { return CellFit::Bent };
        let guess = cell.at((i % 3) as f64 / 2.0, (i / 3) as f64 / 2.0);
        let error = (exact[0] - guess[0]).hypot(exact[1] - guess[1]);
        if error.is_nan() || error > tolerance_px {
            return CellFit::Bent;
        }
    }
    CellFit::Bilinear(cell)
}

impl Cell {
    /// Returns the source position at the given shares of the cell's edges.
    pub fn at(&self, tx: f64, ty: f64) -> [f64; 2] {
        let [nw, ne, sw, se] = self.corners;
        std::array::from_fn(|i| {
            let (top, bottom) = (nw[i] + (ne[i] - nw[i]) * tx, sw[i] + (se[i] - sw[i]) * tx);
            top + (bottom - top) * ty
        })
    }

    /// Returns the source pixels under one tile pixel, along the tile's rows and down its columns.
    pub fn shrink(&self) -> (f64, f64) {
        let [nw, ne, sw, se] = self.corners;
        let length = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]).hypot(b[1] - a[1]) / self.size as f64;
        (length(nw, ne).max(length(sw, se)), length(nw, sw).max(length(ne, se)))
    }

    /// Returns the least and the greatest source x and y in the cell.
    pub fn source_bounds(&self) -> ([f64; 2], [f64; 2]) {
        let least = std::array::from_fn(|i| self.corners.iter().map(|c| c[i]).fold(f64::INFINITY, f64::min));
        let most = std::array::from_fn(|i| self.corners.iter().map(|c| c[i]).fold(f64::NEG_INFINITY, f64::max));
        (least, most)
    }

    /// Returns the cell with its positions in a level that has `scale` times as many pixels along each axis.
    pub fn scaled(mut self, scale: [f64; 2]) -> Self {
        for corner in &mut self.corners {
            corner[0] *= scale[0];
            corner[1] *= scale[1];
        }
        self
    }

    /// Returns the origins of the four quarters of a cell.
    pub fn quarters(x: i64, y: i64, size: i64) -> [(i64, i64); 4] {
        let half = size / 2;
        [(x, y), (x + half, y), (x, y + half), (x + half, y + half)]
    }
}
