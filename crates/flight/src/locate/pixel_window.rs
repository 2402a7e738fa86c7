//! `PixelWindow`: a rectangle of pixels of a level.

/// A window of a level, in pixels of the world at its zoom. Columns may run past the antimeridian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelWindow {
    /// Zoom of the level.
    pub zoom: u8,
    /// First column.
    pub left: i64,
    /// First row.
    pub top: i64,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
}
