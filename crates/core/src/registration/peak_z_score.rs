//! The z-score of a correlation peak: the whole view at full resolution, compared at the place found and at places around.
//!
//! The statistic is T of [`super::coarse`]. Ground that repeats itself (parallel fields, rows of houses) has high values
//! elsewhere, which widens the spread and lowers the z-score, as it should.

use super::products::{CHANNELS_SCALE, ENERGIES_SCALE, channels_in_row, energies_in_row};
use crate::feature::Structure;

/// Radius around the place within which other places are compared, pixels. The map must reach this far beyond the view.
pub const REACH_PX: usize = 30;
/// Distance between the places compared: farther than structure is correlated with itself.
const STEP_PX: isize = 10;

/// The z-score of T where `view` lies at `offset_px` on `map`: T there (the best of that pixel and its eight neighbours) less
/// the mean of T around, in standard deviations of T around. `None` where nothing can be compared.
pub fn peak_z_score(view: &Structure, map: &Structure, offset_px: [usize; 2]) -> Option<f64> {
    let reach = REACH_PX as isize;
    let spans = spans(view);
    let at = |dx: isize, dy: isize| {
        let x = offset_px[0].checked_add_signed(dx)?;
        let y = offset_px[1].checked_add_signed(dy)?;
        statistic(view, &spans, map, [x, y])
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

/// For each row, the range from the first column with structure to beyond the last: a turned frame fills half its rectangle.
fn spans(view: &Structure) -> Vec<(usize, usize)> {
    let row = |y: usize| &view.energy[y * view.width_px..(y + 1) * view.width_px];
    let span = |y: usize| {
        let first = row(y).iter().position(|&e| e > 0)?;
        let last = row(y).iter().rposition(|&e| e > 0)?;
        Some((first, last + 1))
    };
    (0..view.height_px).map(|y| span(y).unwrap_or((0, 0))).collect()
}

fn statistic(view: &Structure, spans: &[(usize, usize)], map: &Structure, at: [usize; 2]) -> Option<f64> {
    if at[0] + view.width_px > map.width_px || at[1] + view.height_px > map.height_px {
        return None;
    }
    let (mut sum, mut variance) = (0i64, 0u64);
    for (y, &(first, end)) in spans.iter().enumerate() {
        let (i, j) = (y * view.width_px + first, (y + at[1]) * map.width_px + at[0] + first);
        let (own, under) = (i..i + end - first, j..j + end - first);
        sum += i64::from(channels_in_row(&view.channels[own.clone()], &map.channels[under.clone()]));
        variance += u64::from(energies_in_row(&view.energy[own], &map.energy[under]));
    }
    (variance > 0).then(|| sum as f64 / CHANNELS_SCALE / (variance as f64 / ENERGIES_SCALE).sqrt())
}
