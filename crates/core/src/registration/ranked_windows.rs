//! `RankedWindows`: the windows of a view with the rank scores of their correlation surfaces.

use super::rank_score::{MEAN_RANK_SCORE, RankScorer};
use super::windows::WindowSurface;
use nalgebra::Vector2;

/// The windows of a view with their rank scores: several votes may be held on them.
#[derive(Debug, Clone, PartialEq)]
pub struct RankedWindows {
    /// Of each window, pixels of the view.
    pub centres_px: Vec<Vector2<f64>>,
    /// Of each window, row by row, less their mean by chance.
    pub scores: Vec<Vec<f32>>,
}

impl RankedWindows {
    /// Ranks the surfaces of the windows, which must cover every displacement of at most the vote's radius on each axis, row by row.
    pub fn new(surfaces: &[WindowSurface]) -> Self {
        let mut scorer = RankScorer::default();
        let centred = |surface: &WindowSurface| {
            let mut scores = scorer.scores(&surface.scores);
            scores.iter_mut().for_each(|score| *score -= MEAN_RANK_SCORE);
            scores
        };
        Self {
            scores: surfaces.iter().map(centred).collect(),
            centres_px: surfaces.iter().map(|surface| surface.centre_px.into()).collect(),
        }
    }
}
