//! How large a ground view may be.

use overfly_core::camera::GroundGrid;

/// A view larger than this in either direction is taken for one that sees the horizon.
const MAX_VIEW_PX: usize = 4096;

/// Whether a view on a grid is made: of larger ones neither pixels nor heights are read.
pub fn is_drawable(grid: &GroundGrid) -> bool {
    grid.width_px.max(grid.height_px) <= MAX_VIEW_PX
}
