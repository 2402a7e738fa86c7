//! The z-score of a correlation peak: the whole view at full resolution, compared at the place found and at places around.
//!
//! The statistic is T of [`super::coarse`]. Ground that repeats itself (parallel fields, rows of houses) has high values
//! elsewhere, which widens the spread and lowers the z-score, as it should.

use super::view_statistic::ViewStatistic;
use crate::feature::Structure;

/// Radius around the place within which other places are compared, pixels. The map must reach this far beyond the view.
pub const REACH_PX: usize = 30;
/// Distance between the places compared: farther than structure is correlated with itself.
const STEP_PX: isize = 10;

/// The z-score of T where `view` lies at `offset_px` on `map`: T there (the best of that pixel and its eight neighbours) less
/// the mean of T around, in standard deviations of T around. `None` where nothing can be compared.
pub fn peak_z_score(view: &Structure, map: &Structure, offset_px: [usize; 2]) -> Option<f64> {
    let reach = REACH_PX as isize;
    let statistic = ViewStatistic::new(view);
    let at = |dx: isize, dy: isize| {
        let x = offset_px[0].checked_add_signed(dx)?;
        let y = offset_px[1].checked_add_signed(dy)?;
        statistic.at(map, [x, y])
    };
    let near = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
    let here = near.filter_map(|(dx, dy)| at(dx, dy)).reduce(f64::max)?;
    let steps = || (-reach / STEP_PX..=reach / STEP_PX).map(|i| i * STEP_PX);
    let around: Vec<f64> = steps()
        .flat_map(|dy| steps().map(move |dx| (dx, dy)))
        .filter(|&(dx, dy)| dx.abs().max(dy.abs()) >= STEP_PX)
        .filter_map(|(dx, dy)| at(dx, dy))
        .collect();
    if around.len() < 20 {
        return None;
    }
    let n = around.len() as f64;
    let mean = around.iter().sum::<f64>() / n;
    let variance = around.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (variance > 0.0).then(|| (here - mean) / variance.sqrt())
}
