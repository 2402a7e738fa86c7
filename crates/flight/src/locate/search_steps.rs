//! `SearchSteps`: the coarse stage of a registration, in steps that end as soon as a fix is sure.

use super::camera_pose::CameraPose;
use super::coarse_peaks::CoarsePeaks;
use super::coarse_search;
use super::error::LocateError;
use super::hypotheses::Hypothesis;
use super::map::Map;
use super::prepare::PreparedFrame;
use super::search_context::SearchContext;
use super::wide::WideSearch;

/// The steps of a coarse search, likeliest first.
pub enum SearchSteps<'a> {
    /// The whole area, each step under some headings and scales.
    Everywhere(Vec<Vec<Hypothesis>>),
    /// Around the places that the wide search found.
    Around {
        /// The wide search.
        wide: WideSearch<'a>,
        /// The places of each step.
        parts: Vec<Vec<CameraPose>>,
        /// Places times hypotheses that the wide search covered.
        places: f64,
    },
}

impl<'a> SearchSteps<'a> {
    /// Plans the search of a prepared frame. Where the area is large and the layer has cells, this makes the wide search.
    ///
    /// # Errors
    /// [`LocateError::Store`], [`LocateError::Cancelled`], [`LocateError::TooWide`], [`LocateError::MemoryLimit`].
    pub fn plan(context: &SearchContext<'a>, prepared: &PreparedFrame<'a>) -> Result<Self, LocateError> {
        let wide = match prepared.cell_level {
            Some(level) => {
                let bounds = prepared.area.mercator_bounds(prepared.reach_px);
                WideSearch::new(context, &prepared.frame, level, prepared.centre, &bounds)?
            }
            None => None,
        };
        let Some(wide) = wide else {
            prepared.extent.check()?;
            return Ok(Self::Everywhere(prepared.hypotheses.iter().filter(|p| !p.is_empty()).cloned().collect()));
        };
        let (parts, pixels) = wide.places(&prepared.area, context.threads, context.cancellation)?;
        let places = pixels * prepared.extent.hypotheses as f64;
        Ok(Self::Around { wide, parts, places })
    }

    /// Whether a wide search was made.
    pub fn is_wide(&self) -> bool {
        matches!(self, Self::Around { .. })
    }

    /// Number of steps.
    pub fn len(&self) -> usize {
        match self {
            Self::Everywhere(parts) => parts.len(),
            Self::Around { parts, .. } => parts.len(),
        }
    }

    /// Makes one step and returns all peaks found so far: `before` are those of the steps before.
    ///
    /// # Errors
    /// [`LocateError::Store`], [`LocateError::Cancelled`].
    pub fn search(
        &self,
        step: usize,
        before: CoarsePeaks,
        context: &SearchContext<'_>,
        map: &Map<'_>,
        prepared: &PreparedFrame<'_>,
    ) -> Result<CoarsePeaks, LocateError> {
        let (frame, threads, cancellation) = (&prepared.frame, context.threads, context.cancellation);
        cancellation.check()?;
        match self {
            Self::Everywhere(parts) => {
                let found = coarse_search::search(map, frame, &prepared.area, &parts[step], threads, cancellation)?;
                Ok(before.merged_with(found))
            }
            Self::Around { wide, parts, places } => {
                let zoom = prepared.levels.coarse;
                let found = wide.search_around(map, frame, &parts[step], zoom, threads, cancellation)?;
                Ok(CoarsePeaks { places: *places, ..before.merged_with(found) })
            }
        }
    }
}
