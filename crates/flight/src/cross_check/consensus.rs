//! `consensus`: positions of layers from the shifts between them, robust against a layer that lies elsewhere.

use super::groups::Groups;
use super::pair::median;
use overfly_core::geodesy::Enu;

/// Rounds of medians; a ring of layers needs as many as it has members between two that do not touch.
const ROUNDS: usize = 60;

/// The offset of each layer from the position on which most agree, from shifts (a, b, a's ground less b's, metres): each layer moves to
/// the median of what its neighbours say of it, and the median of all that shifts join is then 0. `None` for a layer without a shift.
pub fn consensus(layers: usize, shifts: &[(usize, usize, Enu)]) -> Vec<Option<Enu>> {
    let mut groups = Groups::new(layers);
    shifts.iter().for_each(|(a, b, _)| groups.join(*a, *b));
    let east = along(&groups, layers, shifts, |shift| shift.east_m);
    let north = along(&groups, layers, shifts, |shift| shift.north_m);
    east.into_iter().zip(north).map(|(east_m, north_m)| Some(Enu { east_m: east_m?, north_m: north_m? })).collect()
}

/// The same along one axis.
fn along(groups: &Groups, layers: usize, shifts: &[(usize, usize, Enu)], axis: fn(&Enu) -> f64) -> Vec<Option<f64>> {
    let mut neighbours = vec![Vec::new(); layers];
    for (a, b, shift) in shifts {
        neighbours[*a].push((*b, axis(shift)));
        neighbours[*b].push((*a, -axis(shift)));
    }
    let mut positions = vec![0.0; layers];
    for _ in 0..ROUNDS {
        for layer in 0..layers {
            let said = neighbours[layer].iter().map(|(other, shift)| positions[*other] + shift).collect();
            positions[layer] = median(said).unwrap_or(0.0);
        }
    }
    let known = |layer: &usize| !neighbours[*layer].is_empty();
    let mut members = vec![Vec::new(); layers];
    (0..layers).filter(known).for_each(|layer| members[groups.first_of(layer)].push(positions[layer]));
    let middles: Vec<_> = members.into_iter().map(|positions| median(positions).unwrap_or(0.0)).collect();
    let offset = |layer: usize| positions[layer] - middles[groups.first_of(layer)];
    (0..layers).map(|layer| Some(layer).filter(known).map(offset)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shift(a: f64, b: f64) -> Enu {
        Enu { east_m: a - b, north_m: b - a }
    }

    #[test]
    fn the_layer_that_lies_elsewhere_is_found_and_moves_no_other() {
        let truth = [0.0, 0.0, 6.0, 0.0, 0.0];
        let pairs = (0..5).flat_map(|a| (a + 1..5).map(move |b| (a, b, shift(truth[a], truth[b])))).collect::<Vec<_>>();
        let found = consensus(5, &pairs);
        for (found, truth) in found.iter().zip(truth) {
            let found = found.unwrap();
            assert!((found.east_m - truth).abs() < 1e-9 && (found.north_m + truth).abs() < 1e-9, "{found:?} {truth}");
        }
    }

    #[test]
    fn of_two_layers_each_has_half_and_one_alone_nothing() {
        let found = consensus(3, &[(0, 1, shift(4.0, 0.0))]);
        assert_eq!(found[0].map(|e| e.east_m), Some(2.0));
        assert_eq!(found[1].map(|e| e.east_m), Some(-2.0));
        assert_eq!(found[2], None);
    }

    #[test]
    fn groups_that_nothing_joins_each_have_their_own_middle() {
        let pairs =
            [(0, 2, shift(4.0, 0.0)), (1, 3, shift(0.0, 10.0)), (1, 4, shift(0.0, 10.0)), (3, 4, shift(0.0, 0.0))];
        let found: Vec<_> = consensus(5, &pairs).into_iter().map(|offset| offset.unwrap().east_m).collect();
        assert_eq!(found, [2.0, -10.0, -2.0, 0.0, 0.0]);
    }

    #[test]
    fn a_ring_of_layers_agrees() {
        let truth = |i: usize| if i == 7 { 9.0 } else { 0.0 };
        let pairs: Vec<_> = (0..20)
            .flat_map(|a| (1..=3).map(move |s| (a, (a + s) % 20)))
            .map(|(a, b)| (a, b, shift(truth(a), truth(b))))
            .collect();
        for (i, found) in consensus(20, &pairs).iter().enumerate() {
            assert!((found.unwrap().east_m - truth(i)).abs() < 1e-9, "{i}: {found:?}");
        }
    }
}
