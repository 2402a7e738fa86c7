//! `SearchExtent`: how much a search of the whole area would compare.

use super::area::SearchArea;
use super::coarse_search::BLOCK_PX;
use super::error::LocateError;

/// Upper bound on correlated pixels times hypotheses: some minutes on one core.
const MAX_COMPARISONS: f64 = 5e9;
/// Beyond this many correlated pixels times hypotheses (a second on one core) the layer's cells are searched first.
const WIDE_COMPARISONS: f64 = 3e7;

/// Correlated pixels times hypotheses per second of one thread.
const COMPARISONS_PER_S: f64 = 8e7;
/// What a fix takes besides its coarse search: tiles of the map, refinement, verification; seconds of one thread.
const CONSTANT_S: f64 = 0.06;

/// The estimated time of a fix, seconds of one thread, for so many correlated pixels times hypotheses.
///
/// Measured on the drawn landscape (`tiles/`, a cold store, 2 GHz server), 7e5 to 1e8 comparisons: 0.06 to 1.2 s, each within a factor
/// of 1.7 of the estimate. A fix that is sure of its first step takes less, at best the constant and a fifth of the rest.
pub fn estimated_s(comparisons: f64) -> f64 {
    CONSTANT_S + comparisons / COMPARISONS_PER_S
}

/// The size of a coarse search.
#[derive(Debug, Clone, Copy)]
pub struct SearchExtent {
    /// Pixels correlated.
    pub pixels: f64,
    /// Headings and scales, each of which is correlated with every pixel.
    pub hypotheses: usize,
}

impl SearchExtent {
    /// Returns the extent of a search of an area with a view that reaches `reach_px` from its middle.
    pub fn new(area: &SearchArea, reach_px: f64, hypotheses: usize) -> Self {
        // One correlation covers the places of a block and the view's reach around them.
        let side = |px: usize| px as f64 + 2.0 * reach_px;
        let blocks = area.blocks(BLOCK_PX);
        Self { pixels: blocks.iter().map(|b| side(b.width_px) * side(b.height_px)).sum(), hypotheses }
    }

    /// Correlated pixels times hypotheses.
    pub fn comparisons(&self) -> f64 {
        self.pixels * self.hypotheses as f64
    }

    /// Whether a wide search over cells is quicker.
    pub fn is_wide(&self) -> bool {
        self.comparisons() > WIDE_COMPARISONS
    }

    /// Refuses a search of the whole area that would take too long.
    ///
    /// # Errors
    /// [`LocateError::TooWide`].
    pub fn check(&self) -> Result<(), LocateError> {
        let Self { pixels, hypotheses } = *self;
        if self.comparisons() > MAX_COMPARISONS {
            return Err(LocateError::TooWide { pixels, hypotheses, limit: MAX_COMPARISONS });
        }
        Ok(())
    }
}
