//! `couples`: which layers of a store are compared with each other.

use super::groups::Groups;
use overfly_core::geodesy::GeodeticBounds;

/// Each layer is compared with about so many others, so the work grows with the number of layers and not with its square.
const MOST_OTHERS: usize = 6;

/// Pairs of layers with what `common` says of them, those with the most ground in common first and every layer with its neighbours in the
/// store before others. A layer that has its share of others is compared once more only where it joins two groups of layers that no pair
/// joins. `common` is `None` where two layers have bounds in common and no ground.
///
/// # Errors
/// Those of `common`.
pub fn couples<T, E>(
    bounds: &[GeodeticBounds],
    mut common: impl FnMut(usize, usize) -> Result<Option<T>, E>,
) -> Result<Vec<(usize, usize, T)>, E> {
    let layers = bounds.len();
    let on_ring = |a: usize, b: usize| (b - a).min(layers - (b - a));
    let mut candidates: Vec<_> = (0..layers)
        .flat_map(|a| (a + 1..layers).map(move |b| (overlap_deg2(bounds[a], bounds[b]), a, b)))
        .filter(|(overlap, ..)| *overlap > 0.0)
        .collect();
    candidates.sort_by(|x, y| y.0.total_cmp(&x.0).then_with(|| on_ring(x.1, x.2).cmp(&on_ring(y.1, y.2))));
    let mut others = vec![0; layers];
    let mut groups = Groups::new(layers);
    let mut chosen = Vec::new();
    for (_, a, b) in candidates {
        let has_room = others[a] < MOST_OTHERS && others[b] < MOST_OTHERS;
        if !has_room && groups.is_joined(a, b) {
            continue;
        }
        if let Some(ground) = common(a, b)? {
            groups.join(a, b);
            others[a] += 1;
            others[b] += 1;
            chosen.push((a, b, ground));
        }
    }
    chosen.sort_by_key(|(a, b, _)| (*a, *b));
    Ok(chosen)
}

/// The area that two extents have in common, square degrees.
fn overlap_deg2(a: GeodeticBounds, b: GeodeticBounds) -> f64 {
    let south_to_north = a.north_deg.min(b.north_deg) - a.south_deg.max(b.south_deg);
    let west_to_east = [-360.0, 0.0, 360.0].map(|turn| {
        let east = a.unwrapped_east_deg().min(b.unwrapped_east_deg() + turn);
        (east - a.west_deg.max(b.west_deg + turn)).max(0.0)
    });
    south_to_north.max(0.0) * west_to_east.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(west_deg: f64, edge_deg: f64) -> GeodeticBounds {
        let east_deg = (west_deg + edge_deg + 180.0).rem_euclid(360.0) - 180.0;
        GeodeticBounds { west_deg, south_deg: 0.0, east_deg, north_deg: edge_deg }
    }

    fn chosen(bounds: &[GeodeticBounds]) -> Vec<(usize, usize)> {
        let pairs = couples(bounds, |_, _| Ok::<_, ()>(Some(()))).unwrap();
        pairs.into_iter().map(|(a, b, ())| (a, b)).collect()
    }

    #[test]
    fn few_layers_of_one_place_are_all_compared_and_many_only_with_some() {
        assert!(chosen(&[]).is_empty() && chosen(&[square(0.0, 1.0)]).is_empty());
        for layers in 2..=7 {
            assert_eq!(chosen(&vec![square(0.0, 1.0); layers]).len(), layers * (layers - 1) / 2, "{layers}");
        }
        assert_eq!(chosen(&vec![square(0.0, 1.0); 100]).len(), 300);
    }

    #[test]
    fn two_maps_of_one_place_meet_wherever_they_stand_in_the_store() {
        // 40 places side by side, then the other map of each.
        let places = (0..40).map(|i| square(f64::from(i) * 2.0, 1.0));
        let bounds: Vec<_> = places.clone().chain(places).collect();
        assert_eq!(chosen(&bounds), (0..40).map(|i| (i, i + 40)).collect::<Vec<_>>());
    }

    #[test]
    fn groups_of_layers_that_overlap_a_little_are_joined() {
        let west = (0..10).map(|_| square(0.0, 1.0));
        let bounds: Vec<_> = west.chain((0..10).map(|_| square(0.9, 1.0))).collect();
        let pairs = chosen(&bounds);
        assert!(pairs.iter().any(|(a, b)| *a < 10 && *b >= 10), "{pairs:?}");
        assert!(pairs.len() <= 61, "{}", pairs.len());
    }

    #[test]
    fn bounds_without_ground_take_no_share() {
        // A frame around ten small maps: its bounds hold theirs, its ground does not.
        let mut bounds = vec![square(0.0, 10.0)];
        bounds.extend((0..8).map(|_| square(4.0, 1.0)));
        let pairs = couples(&bounds, |a, _| Ok::<_, ()>((a != 0).then_some(()))).unwrap();
        assert!(pairs.iter().all(|(a, ..)| *a != 0) && pairs.len() >= 24, "{}", pairs.len());
    }

    #[test]
    fn extents_meet_across_the_antimeridian() {
        assert!((overlap_deg2(square(179.5, 1.0), square(-180.0, 1.0)) - 0.5).abs() < 1e-9);
        assert!((overlap_deg2(square(179.5, 1.0), square(179.0, 1.0)) - 0.5).abs() < 1e-9);
        assert_eq!(overlap_deg2(square(0.0, 1.0), square(1.0, 1.0)), 0.0);
        assert_eq!(couples(&[square(0.0, 1.0); 2], |_, _| Err::<Option<()>, _>("unreadable")), Err("unreadable"));
    }
}
