//! `OpenOptions`: what the caller states about a source.

use super::block::BlockCache;
use std::sync::Arc;

/// What the caller states about a source beyond what its file says.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// The EPSG code that overrides (or supplies) the file's CRS.
    pub crs: Option<u32>,
    /// Source values shown as 0 and 255; needed for more than 8 bits.
    pub stretch: Option<(f64, f64)>,
    /// Whether samples are heights, metres: red and green of a pixel are then the higher and the lower byte of its step
    /// (`overfly_store::step_of`).
    pub heights: bool,
    /// The cache of decoded blocks; sources that share one stay within its bound together. Each source has its own by
    /// default.
    pub cache: Option<Arc<BlockCache>>,
}
