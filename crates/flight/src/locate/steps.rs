//! How a search is cut into steps: everywhere in the area, or around the places that the cells name.

use super::area::SearchArea;
use super::coarse_search::{self, Hypothesis};
use super::pose::Pose;
use super::request::LocateError;
use super::wide::WideSearch;

/// Bound on correlated pixels times hypotheses: some minutes on one core.
const MOST_PLACES: f64 = 5e9;
/// Beyond so many correlated pixels times hypotheses (a second on one core) the layer's cells are searched first.
const MOST_EVERYWHERE: f64 = 3e7;

/// What is to be searched, one step after the other until a verdict is sure.
pub enum Steps<'a> {
    /// The whole area under some headings and scales.
    Everywhere(Vec<Vec<Hypothesis>>),
    /// Around places that the wide search found.
    Around {
        /// It.
        wide: &'a WideSearch<'a>,
        /// The places of each step.
        parts: Vec<Vec<Pose>>,
        /// The places, headings and scales that the whole search stands for.
        places: f64,
    },
}

impl<'a> Steps<'a> {
    /// Makes the wide search; `hypotheses` is what a search of everything would have tried.
    ///
    /// # Errors
    /// [`LocateError::GivenUp`].
    pub fn around(
        wide: &'a WideSearch<'a>,
        area: &SearchArea,
        hypotheses: usize,
        threads: usize,
        wanted: &dyn Fn() -> bool,
    ) -> Result<Self, LocateError> {
        let (parts, pixels) = wide.places(area, threads, wanted)?;
        Ok(Self::Around { wide, parts, places: pixels * hypotheses as f64 })
    }

    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Everywhere(parts) => parts.len(),
            Self::Around { parts, .. } => parts.len(),
        }
    }
}

/// What a search of everything would compare.
#[derive(Debug, Clone, Copy)]
pub struct Width {
    /// Pixels correlated.
    pub pixels: f64,
    /// Under each of so many headings and scales.
    pub hypotheses: usize,
}

impl Width {
    /// Of an area for a view that reaches `reach_px` from its nadir.
    pub fn of(area: &SearchArea, reach_px: f64, hypotheses: usize) -> Self {
        // What one correlation covers: the places, and the view's reach around them.
        let side = |px: usize| px as f64 + 2.0 * reach_px;
        let blocks = area.blocks(coarse_search::BLOCK_PX);
        Self { pixels: blocks.iter().map(|b| side(b.width_px) * side(b.height_px)).sum(), hypotheses }
    }

    fn product(&self) -> f64 {
        self.pixels * self.hypotheses as f64
    }

    /// Whether the cells are quicker.
    pub fn is_wide(&self) -> bool {
        self.product() > MOST_EVERYWHERE
    }

    /// The steps of a search of everything, refused where it would take too long.
    ///
    /// # Errors
    /// [`LocateError::TooWide`].
    pub fn check(&self, parts: [Vec<Hypothesis>; 2]) -> Result<Vec<Vec<Hypothesis>>, LocateError> {
        let Self { pixels, hypotheses } = *self;
        if self.product() > MOST_PLACES {
            return Err(LocateError::TooWide { pixels, hypotheses, limit: MOST_PLACES });
        }
        Ok(parts.into_iter().filter(|p| !p.is_empty()).collect())
    }
}
