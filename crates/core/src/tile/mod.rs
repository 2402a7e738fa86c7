//! The tile matrix: Web Mercator cut into tiles of 512 px, row 0 north (XYZ).

mod bounds;
mod id;

pub use bounds::{GeodeticBounds, MercatorBounds};
pub use id::{Gsd, MAX_ZOOM, TILE_SIZE_PX, TileError, TileId, WorldPixel, gsd_at, zoom_for_gsd};
