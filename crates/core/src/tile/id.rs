//! `TileId`: zoom, column and row of a tile, with its exact extent and ground sample distance.

use super::MercatorBounds;
use crate::geodesy::{GeodesyError, Geodetic, GeodeticBounds, MercatorPoint, WORLD_M, ground_scale};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Edge of a tile in pixels.
pub const TILE_SIZE_PX: u32 = 512;
/// The finest zoom: 512 px tiles of 9 mm pixels at the equator.
pub const MAX_ZOOM: u8 = 23;

/// Why a tile does not exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TileError {
    /// The zoom is beyond [`MAX_ZOOM`].
    #[error("zoom {zoom} is beyond the finest, {MAX_ZOOM}")]
    Zoom {
        /// The given zoom.
        zoom: u32,
    },
    /// The column or row is outside the matrix of that zoom.
    #[error("tile {column}/{row} lies outside the {size} x {size} tiles of zoom {zoom}")]
    Index {
        /// Zoom level.
        zoom: u8,
        /// The given column.
        column: u32,
        /// The given row.
        row: u32,
        /// Number of tiles along an edge at that zoom.
        size: u32,
    },
    /// The position is beyond the tile matrix.
    #[error(transparent)]
    Position(#[from] GeodesyError),
}

/// Ground sample distance of a map's pixels, true metres, separately towards east and north.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gsd {
    /// Metres per pixel towards east.
    pub east_m_per_px: f64,
    /// Metres per pixel towards north.
    pub north_m_per_px: f64,
}

impl Gsd {
    /// The geometric mean of both directions, metres per pixel.
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
    /// Makes the tile at a zoom, column (x) and row (y, 0 is the northernmost).
    ///
    /// # Errors
    /// [`TileError`] where the zoom, column or row is outside the matrix.
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

    /// The tile of a zoom that contains a position.
    ///
    /// # Errors
    /// [`TileError::Position`] beyond 85.05 degrees, [`TileError::Zoom`].
    pub fn containing(point: Geodetic, zoom: u8) -> Result<Self, TileError> {
        let pixel = WorldPixel::from_geodetic(point, zoom)?;
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

    /// The tile one level coarser that contains this one; `None` at zoom 0.
    pub fn parent(self) -> Option<Self> {
        (self.zoom > 0).then(|| Self { zoom: self.zoom - 1, column: self.column / 2, row: self.row / 2 })
    }

    /// The four tiles one level finer: north-west, north-east, south-west, south-east; `None` at [`MAX_ZOOM`].
    pub fn children(self) -> Option<[Self; 4]> {
        let child = |dx, dy| Self { zoom: self.zoom + 1, column: self.column * 2 + dx, row: self.row * 2 + dy };
        (self.zoom < MAX_ZOOM).then(|| [child(0, 0), child(1, 0), child(0, 1), child(1, 1)])
    }

    /// The exact extent in the projection.
    pub fn mercator_bounds(self) -> MercatorBounds {
        let span_m = tile_span_m(self.zoom);
        let min_x_m = -WORLD_M / 2.0 + f64::from(self.column) * span_m;
        let max_y_m = WORLD_M / 2.0 - f64::from(self.row) * span_m;
        MercatorBounds { min_x_m, min_y_m: max_y_m - span_m, max_x_m: min_x_m + span_m, max_y_m }
    }

    /// The exact extent in degrees. The eastern edge of the last column is 180, not -180.
    pub fn bounds(self) -> GeodeticBounds {
        let size = f64::from(1u32 << self.zoom);
        let longitude = |column: u32| f64::from(column) / size * 360.0 - 180.0;
        let latitude = |row: u32| {
            let n = std::f64::consts::PI * (1.0 - 2.0 * f64::from(row) / size);
            n.sinh().atan().to_degrees()
        };
        GeodeticBounds {
            west_deg: longitude(self.column),
            south_deg: latitude(self.row + 1),
            east_deg: longitude(self.column + 1),
            north_deg: latitude(self.row),
        }
    }

    /// The point in the middle of the projected extent.
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
    /// let t = overfly_core::tile::TileId::new(16, 32768, 32768).unwrap();
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

/// A position in the pixels of the whole world at one zoom. The north-west corner is (0, 0), the centre of the first pixel
/// (0.5, 0.5). x may exceed the world's width where an extent crosses the antimeridian.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WorldPixel {
    /// Columns east of the antimeridian.
    pub x_px: f64,
    /// Rows south of the world's northern edge.
    pub y_px: f64,
}

impl WorldPixel {
    /// Makes the pixel position of a point at a zoom.
    ///
    /// # Errors
    /// [`GeodesyError::BeyondMercator`] beyond 85.05 degrees.
    pub fn from_geodetic(point: Geodetic, zoom: u8) -> Result<Self, GeodesyError> {
        let m = MercatorPoint::from_geodetic(point)?;
        let px_per_m = 1.0 / pixel_span_m(zoom);
        Ok(Self { x_px: (m.x_m + WORLD_M / 2.0) * px_per_m, y_px: (WORLD_M / 2.0 - m.y_m) * px_per_m })
    }

    /// The point at this pixel position of a zoom.
    ///
    /// # Errors
    /// [`GeodesyError`] where a coordinate is not finite.
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

/// The coarsest zoom with pixels at `point` of at most `gsd_m_per_px` on the ground, and at most [`MAX_ZOOM`]. A tolerance
/// of 2 % keeps a source that already lies on the matrix at its own zoom.
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
        fn the_tile_of_a_point_contains_it(lat in -85.0..85.0f64, lon in -180.0..180.0f64, zoom in 0u8..=MAX_ZOOM) {
            let p = Geodetic::from_degrees(lat, lon).unwrap();
            let b = TileId::containing(p, zoom).unwrap().bounds();
            let eps = 1e-9;
            prop_assert!(b.west_deg - eps <= lon && lon <= b.east_deg + eps);
            prop_assert!(b.south_deg - eps <= lat && lat <= b.north_deg + eps);
        }

        #[test]
        fn the_parent_of_a_child_is_the_tile(zoom in 0u8..MAX_ZOOM, x in 0.0..1.0f64, y in 0.0..1.0f64) {
            let size = f64::from(1u32 << zoom);
            let tile = TileId::new(zoom, (x * size) as u32, (y * size) as u32).unwrap();
            for child in tile.children().unwrap() {
                prop_assert_eq!(child.parent(), Some(tile));
            }
        }
    }

    #[test]
    fn refuses_a_tile_outside_the_matrix() {
        assert!(TileId::new(24, 0, 0).is_err());
        assert!(TileId::new(3, 8, 0).is_err());
        assert!(TileId::containing(Geodetic::from_degrees(86.0, 0.0).unwrap(), 3).is_err());
    }
}
