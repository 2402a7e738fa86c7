//! `TileId`: zoom, column and row, and what follows from them exactly.

use super::{GeodeticBounds, MercatorBounds};
use crate::geodesy::{GeodesyError, Geodetic, MercatorPoint, WORLD_M, ground_scale};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Edge of a tile in pixels.
pub const TILE_SIZE_PX: u32 = 512;
/// The finest zoom: 512 px tiles of 9 mm pixels at the equator.
pub const MAX_ZOOM: u8 = 23;

/// Why a tile cannot be named.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TileError {
    /// Zoom beyond [`MAX_ZOOM`].
    #[error("zoom {zoom} is beyond the finest, {MAX_ZOOM}")]
    Zoom {
        /// What was given.
        zoom: u32,
    },
    /// Column or row outside the matrix of that zoom.
    #[error("tile {column}/{row} lies outside the {size} x {size} tiles of zoom {zoom}")]
    Index {
        /// Zoom level.
        zoom: u8,
        /// Column given.
        column: u32,
        /// Row given.
        row: u32,
        /// Tiles along an edge at that zoom.
        size: u32,
    },
    /// The position has no tile.
    #[error(transparent)]
    Position(#[from] GeodesyError),
}

/// Ground sample distance of a map's pixels, true metres, east and north separately.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gsd {
    /// Metres per pixel towards east.
    pub east_m_per_px: f64,
    /// Metres per pixel towards north.
    pub north_m_per_px: f64,
}

impl Gsd {
    /// Geometric mean of both directions, metres per pixel.
    pub fn mean_m_per_px(self) -> f64 {
        (self.east_m_per_px * self.north_m_per_px).sqrt()
    }
}

/// One tile of the matrix. Ordered by zoom, then row, then column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct TileId {
    zoom: u8,
    column: u32,
    row: u32,
}

impl TileId {
    /// The tile at zoom, column (x) and row (y, 0 north).
    ///
    /// # Errors
    /// Where zoom or an index lies outside the matrix.
    pub fn new(zoom: u8, column: u32, row: u32) -> Result<Self, TileError> {
        if zoom > MAX_ZOOM {
            return Err(TileError::Zoom { zoom: zoom.into() });
        }
        let size = 1u32 << zoom;
        if column >= size || row >= size {
            return Err(TileError::Index { zoom, column, row, size });
        }
        Ok(Self { zoom, column, row })
    }

    /// The tile that holds a position.
    ///
    /// # Errors
    /// Beyond 85.05 degrees.
    pub fn containing(point: Geodetic, zoom: u8) -> Result<Self, TileError> {
        let pixel = WorldPixel::of(point, zoom)?;
        let last = (1u32 << zoom) - 1;
        let index = |v: f64| ((v / f64::from(TILE_SIZE_PX)).floor().max(0.0) as u32).min(last);
        Self::new(zoom, index(pixel.x_px), index(pixel.y_px))
    }

    /// Zoom level.
    pub fn zoom(self) -> u8 {
        self.zoom
    }

    /// Column, counted from the antimeridian eastwards.
    pub fn column(self) -> u32 {
        self.column
    }

    /// Row, counted from the north.
    pub fn row(self) -> u32 {
        self.row
    }

    /// The tile one level coarser that holds this one; `None` at zoom 0.
    pub fn parent(self) -> Option<Self> {
        (self.zoom > 0).then(|| Self { zoom: self.zoom - 1, column: self.column / 2, row: self.row / 2 })
    }

    /// The four tiles one level finer, north-west, north-east, south-west, south-east; `None` at [`MAX_ZOOM`].
    pub fn children(self) -> Option<[Self; 4]> {
        let child = |dx, dy| Self { zoom: self.zoom + 1, column: self.column * 2 + dx, row: self.row * 2 + dy };
        (self.zoom < MAX_ZOOM).then(|| [child(0, 0), child(1, 0), child(0, 1), child(1, 1)])
    }

    /// Exact extent in the projection.
    pub fn mercator_bounds(self) -> MercatorBounds {
        let span_m = tile_span_m(self.zoom);
        let min_x_m = -WORLD_M / 2.0 + f64::from(self.column) * span_m;
        let max_y_m = WORLD_M / 2.0 - f64::from(self.row) * span_m;
        MercatorBounds { min_x_m, min_y_m: max_y_m - span_m, max_x_m: min_x_m + span_m, max_y_m }
    }

    /// Exact extent in degrees; the eastern edge of the last column is 180, not -180.
    pub fn bounds(self) -> GeodeticBounds {
        let size = f64::from(1u32 << self.zoom);
        let longitude = |column: u32| f64::from(column) / size * 360.0 - 180.0;
        let latitude = |row: u32| {
            let n = std::f64::consts::PI * (1.0 - 2.0 * f64::from(row) / size);
            n.sinh().atan().to_degrees()
        };
        GeodeticBounds {
            west: longitude(self.column),
            south: latitude(self.row + 1),
            east: longitude(self.column + 1),
            north: latitude(self.row),
        }
    }

    /// The point in the middle of the tile (of its projected extent).
    pub fn centre(self) -> Geodetic {
        let b = self.mercator_bounds();
        MercatorPoint { x_m: (b.min_x_m + b.max_x_m) / 2.0, y_m: (b.min_y_m + b.max_y_m) / 2.0 }
            .to_geodetic()
            .expect("a tile's centre lies inside the projection")
    }

    /// True ground sample distance at the tile's centre.
    ///
    /// # Example
    /// Level 16 of 512 px tiles at the equator: 1.194 m.
    /// ```
    /// let t = crate::tile::TileId::new(16, 32768, 32768).unwrap();
    /// assert!((t.gsd().east_m_per_px - 1.194_328_566).abs() < 1e-6);
    /// ```
    pub fn gsd(self) -> Gsd {
        gsd_at(self.centre(), self.zoom)
    }
}

impl PartialOrd for TileId {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for TileId {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.zoom, self.row, self.column).cmp(&(other.zoom, other.row, other.column))
    }
}

impl fmt::Display for TileId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/{}", self.zoom, self.column, self.row)
    }
}

/// A position in the pixels of the whole world at one zoom, (0, 0) the north-west corner, the first pixel's centre
/// at (0.5, 0.5). x may run beyond the world's width for what crosses the antimeridian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldPixel {
    /// Columns from the antimeridian.
    pub x_px: f64,
    /// Rows from the north.
    pub y_px: f64,
}

impl WorldPixel {
    /// Where a point lies at a zoom.
    ///
    /// # Errors
    /// Beyond 85.05 degrees.
    pub fn of(point: Geodetic, zoom: u8) -> Result<Self, GeodesyError> {
        let m = MercatorPoint::from_geodetic(point)?;
        let px_per_m = 1.0 / pixel_span_m(zoom);
        Ok(Self { x_px: (m.x_m + WORLD_M / 2.0) * px_per_m, y_px: (WORLD_M / 2.0 - m.y_m) * px_per_m })
    }

    /// The point at this pixel of a zoom.
    ///
    /// # Errors
    /// Where a coordinate is not finite.
    pub fn to_geodetic(self, zoom: u8) -> Result<Geodetic, GeodesyError> {
        let span_m = pixel_span_m(zoom);
        MercatorPoint { x_m: self.x_px * span_m - WORLD_M / 2.0, y_m: WORLD_M / 2.0 - self.y_px * span_m }.to_geodetic()
    }
}

/// True ground sample distance of a zoom's pixels at a point.
pub fn gsd_at(point: Geodetic, zoom: u8) -> Gsd {
    let scale = ground_scale(point.latitude_rad());
    Gsd { east_m_per_px: pixel_span_m(zoom) * scale.east, north_m_per_px: pixel_span_m(zoom) * scale.north }
}

/// The coarsest zoom whose pixels at `point` are no larger than `gsd_m_per_px` on the ground (within 2 %, so that a
/// source on the matrix itself is not doubled), at most [`MAX_ZOOM`].
pub fn zoom_for_gsd(point: Geodetic, gsd_m_per_px: f64) -> u8 {
    (0..=MAX_ZOOM).find(|&zoom| gsd_at(point, zoom).mean_m_per_px() <= gsd_m_per_px * 1.02).unwrap_or(MAX_ZOOM)
}

fn tile_span_m(zoom: u8) -> f64 {
    WORLD_M / f64::from(1u32 << zoom)
}

fn pixel_span_m(zoom: u8) -> f64 {
    tile_span_m(zoom) / f64::from(TILE_SIZE_PX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn holds_the_point_it_was_named_for(lat in -85.0..85.0f64, lon in -180.0..180.0f64, zoom in 0u8..=MAX_ZOOM) {
            let p = Geodetic::from_degrees(lat, lon).unwrap();
            let b = TileId::containing(p, zoom).unwrap().bounds();
            let eps = 1e-9;
            prop_assert!(b.west - eps <= lon && lon <= b.east + eps && b.south - eps <= lat && lat <= b.north + eps);
        }

        #[test]
        fn children_name_their_parent(zoom in 0u8..MAX_ZOOM, x in 0.0..1.0f64, y in 0.0..1.0f64) {
            let size = f64::from(1u32 << zoom);
            let tile = TileId::new(zoom, (x * size) as u32, (y * size) as u32).unwrap();
            for child in tile.children().unwrap() {
                prop_assert_eq!(child.parent(), Some(tile));
            }
        }
    }

    #[test]
    fn refuses_what_lies_outside_the_matrix() {
        assert!(TileId::new(24, 0, 0).is_err());
        assert!(TileId::new(3, 8, 0).is_err());
        assert!(TileId::containing(Geodetic::from_degrees(86.0, 0.0).unwrap(), 3).is_err());
    }
}
