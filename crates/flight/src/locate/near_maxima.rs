//! The maxima of T around a place: on a grid of whole pixels, and to a fraction of a pixel.

use super::observation::Observation;
use overfly_core::registration::view_statistic::ViewStatistic;

/// A maximum below this share of the place's T is no rival.
pub const RIVAL_SHARE: f64 = 0.4;
/// Maxima nearer than this to the place belong to its own peak, pixels. A lattice of 4 px, the finest that structure resolves, has its
/// next maximum beyond.
pub const OWN_PEAK_PX: f64 = 3.4;
/// Half edge of the square around the place that is compared on every level, pixels.
pub const NEAR_PX: isize = 12;
/// Step of that comparison, pixels.
const NEAR_STEP_PX: isize = 2;
/// Rows of the view that one compared row stands for.
const NEAR_ROW_STEP: usize = 2;
/// On that grid a rival may lie a pixel off its maximum, which costs it up to this share of its T.
const NEAR_SHARE: f64 = 0.7 * RIVAL_SHARE;
/// Rivals taken from the surroundings of the place on one level: all of a lattice of 4 px that lie within the square, for a coarser level
/// may tell the place from all but its neighbour. Real ground has one or two.
const NEAR_RIVALS: usize = 24;

/// The offsets of the maxima of T around the pose of an observation, apart from its own peak, pixels. The map must reach
/// [`NEAR_PX`] beyond the view.
pub fn near_maxima(observation: &Observation) -> Vec<[f64; 2]> {
    let statistic = ViewStatistic::from_rows(&observation.view_structure, NEAR_ROW_STEP);
    let steps = NEAR_PX / NEAR_STEP_PX;
    let width = (2 * steps + 1) as usize;
    let offset = |i: usize| [(i % width) as isize - steps, (i / width) as isize - steps].map(|k| k * NEAR_STEP_PX);
    let at = |offset: [isize; 2]| {
        let corner = offset.map(|d| (d + observation.margin_px as isize) as usize);
        statistic.at(&observation.map_structure, corner).unwrap_or(0.0) as f32
    };
    let values: Vec<f32> = (0..width * width).map(|i| at(offset(i))).collect();
    let highest = values[width * width / 2];
    let mut maxima: Vec<(f32, [f64; 2])> = local_maxima(&values, width, 1)
        .into_iter()
        .map(|([x, y], value)| (value, offset(y * width + x).map(|d| d as f64)))
        .filter(|(value, [dx, dy])| *value >= NEAR_SHARE as f32 * highest && dx.hypot(*dy) >= OWN_PEAK_PX)
        .collect();
    maxima.sort_by(|a, b| b.0.total_cmp(&a.0));
    maxima.truncate(NEAR_RIVALS);
    maxima.into_iter().map(|(_, offset)| offset).collect()
}

/// A maximum on whole pixels, and the vertex of the parabolas through its neighbours.
pub struct Maximum {
    /// The value on whole pixels.
    pub value: f64,
    /// The vertex, pixels from the maximum.
    pub vertex: [f64; 2],
    /// The value at the vertex.
    pub vertex_value: f64,
}

/// The highest T of an observation within `reach` pixels of its pose, and its offset.
pub fn maximum_around(observation: &Observation, reach: usize) -> Option<([isize; 2], Maximum)> {
    let statistic = ViewStatistic::new(&observation.view_structure);
    let (reach, margin) = (reach as isize, observation.margin_px as isize);
    let at = |[dx, dy]: [isize; 2]| {
        let corner = [(dx + margin) as usize, (dy + margin) as usize];
        statistic.at(&observation.map_structure, corner)
    };
    let offsets = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| [dx, dy]));
    let values = offsets.filter_map(|offset| Some((offset, at(offset)?)));
    let (offset, value) = values.reduce(|a, b| if b.1 > a.1 { b } else { a })?;
    let [along, across] = [[1, 0], [0, 1]].map(|step: [isize; 2]| {
        let beside = |sign: isize| at([offset[0] + sign * step[0], offset[1] + sign * step[1]]);
        let (Some(before), Some(after)) = (beside(-1), beside(1)) else { return [0.0; 2] };
        let (slope, bend) = (0.5 * (after - before), before - 2.0 * value + after);
        if bend < 0.0 { [(-slope / bend).clamp(-0.5, 0.5), -0.5 * slope * slope / bend] } else { [0.0; 2] }
    });
    let vertex_value = value + along[1] + across[1];
    Some((offset, Maximum { value, vertex: [along[0], across[0]], vertex_value }))
}

/// The local maxima of a surface, each the highest within `radius` samples: column, row and value.
pub fn local_maxima(values: &[f32], width: usize, radius: usize) -> Vec<([usize; 2], f32)> {
    let height = values.len() / width.max(1);
    let span = |at: usize, extent: usize| at.saturating_sub(radius)..(at + radius + 1).min(extent);
    let is_maximum = |x: usize, y: usize, value: f32| {
        span(y, height).all(|j| values[j * width..][span(x, width)].iter().all(|other| *other <= value))
    };
    let places = (0..height).flat_map(|y| (0..width).map(move |x| ([x, y], values[y * width + x])));
    places.filter(|&([x, y], value)| value > 0.0 && is_maximum(x, y, value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_local_maximum_is_the_highest_within_its_radius() {
        let mut values = vec![0.1f32; 9 * 7];
        values[2 * 9 + 2] = 1.0;
        values[3 * 9 + 4] = 0.8;
        values[5 * 9 + 7] = 0.5;
        let found = |radius| {
            let mut maxima: Vec<_> = local_maxima(&values, 9, radius).into_iter().filter(|m| m.1 > 0.2).collect();
            maxima.sort_by(|a, b| b.1.total_cmp(&a.1));
            maxima.into_iter().map(|(at, _)| at).collect::<Vec<_>>()
        };
        assert_eq!(found(1), [[2, 2], [4, 3], [7, 5]]);
        assert_eq!(found(2), [[2, 2], [7, 5]]);
    }
}
