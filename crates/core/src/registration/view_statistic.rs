//! T of a whole view at single places, straight from its definition in [`super::coarse`].

use super::products::{CHANNELS_SCALE, ENERGIES_SCALE, channels_in_row, energies_in_row};
use crate::feature::Structure;

/// A view prepared for T at single places of a map.
pub struct ViewStatistic<'a> {
    view: &'a Structure,
    /// Rows with structure, each with its first such column and the one beyond the last: a turned frame fills half its rectangle.
    spans: Vec<(usize, usize, usize)>,
}

impl<'a> ViewStatistic<'a> {
    /// Prepares a view.
    pub fn new(view: &'a Structure) -> Self {
        Self::from_rows(view, 1)
    }

    /// Prepares every `step`-th row of a view (at least 1). Neighbouring rows tell almost the same, so T is lower by about the root of
    /// the step and its maxima stay where they are.
    pub fn from_rows(view: &'a Structure, step: usize) -> Self {
        let row = |y: usize| &view.energy[y * view.width_px..(y + 1) * view.width_px];
        let span = |y: usize| {
            let first = row(y).iter().position(|&e| e > 0)?;
            let last = row(y).iter().rposition(|&e| e > 0)?;
            Some((first, last + 1))
        };
        let rows = (0..view.height_px).step_by(step.max(1));
        Self { view, spans: rows.filter_map(|y| span(y).map(|(first, end)| (y, first, end))).collect() }
    }

    /// T where the view's corner lies on the map's pixel (column, row); `None` where the view reaches beyond the map or nothing
    /// can be compared.
    pub fn at(&self, map: &Structure, corner: [usize; 2]) -> Option<f64> {
        let view = self.view;
        if corner[0] + view.width_px > map.width_px || corner[1] + view.height_px > map.height_px {
            return None;
        }
        let (mut sum, mut variance) = (0i64, 0u64);
        for &(y, first, end) in &self.spans {
            let (i, j) = (y * view.width_px + first, (y + corner[1]) * map.width_px + corner[0] + first);
            let (own, under) = (i..i + end - first, j..j + end - first);
            sum += i64::from(channels_in_row(&view.channels[own.clone()], &map.channels[under.clone()]));
            variance += u64::from(energies_in_row(&view.energy[own], &map.energy[under]));
        }
        (variance > 0).then(|| sum as f64 / CHANNELS_SCALE / (variance as f64 / ENERGIES_SCALE).sqrt())
    }
}
