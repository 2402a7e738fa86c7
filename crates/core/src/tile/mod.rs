//! The tile matrix: Web Mercator cut into tiles of 512 px. Row 0 is the northernmost (XYZ).

mod bounds;
mod height_grid;
mod id;

pub use bounds::MercatorBounds;
pub use height_grid::HeightGrid;
pub use id::{Gsd, MAX_ZOOM, TILE_SIZE_PX, TileError, TileId, WorldPixel, gsd_at, zoom_for_gsd};
