//! Bounds as the R-tree and the tile matrix need them.

use overfly_core::geodesy::WORLD_M;
use overfly_core::tile::MercatorBounds;

/// Moving a bound by whole worlds rounds it. It is widened by this margin before the exact check, metres of the projection.
const ROUNDING_M: f64 = 1e-6;

/// Splits bounds into windows whose x lies inside the world: usually one, two across the antimeridian.
pub(super) fn windows_on_the_map(bounds: &MercatorBounds) -> Vec<MercatorBounds> {
    let half_m = WORLD_M / 2.0;
    if bounds.max_x_m - bounds.min_x_m >= WORLD_M {
        return vec![MercatorBounds { min_x_m: -half_m, max_x_m: half_m, ..*bounds }];
    }
    let world =
        MercatorBounds { min_x_m: -half_m, min_y_m: f64::NEG_INFINITY, max_x_m: half_m, max_y_m: f64::INFINITY };
    let first = ((bounds.min_x_m + half_m) / WORLD_M).floor();
    [first, first + 1.0]
        .into_iter()
        .map(|worlds| {
            let rounding_m = if worlds == 0.0 { 0.0 } else { ROUNDING_M };
            MercatorBounds {
                min_x_m: bounds.min_x_m - worlds * WORLD_M - rounding_m,
                max_x_m: bounds.max_x_m - worlds * WORLD_M + rounding_m,
                ..*bounds
            }
        })
        .filter(|window| window.intersects(&world))
        .collect()
}

/// Returns min x, max x, min y, max y, each moved outward by more than the rounding of a 32-bit float (2 m at the edge of the
/// world), which the R-tree uses.
pub(super) fn rounded_outward(bounds: &MercatorBounds) -> [f64; 4] {
    let margin_m = |v: f64| v.abs() * f64::from(f32::EPSILON) + ROUNDING_M;
    [
        bounds.min_x_m - margin_m(bounds.min_x_m),
        bounds.max_x_m + margin_m(bounds.max_x_m),
        bounds.min_y_m - margin_m(bounds.min_y_m),
        bounds.max_y_m + margin_m(bounds.max_y_m),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_at_the_antimeridian() {
        let at = |min_x_m, max_x_m| MercatorBounds { min_x_m, min_y_m: 0.0, max_x_m, max_y_m: 1.0 };
        let half_m = WORLD_M / 2.0;
        assert_eq!(windows_on_the_map(&at(-5.0, 5.0)), [at(-5.0, 5.0)]);
        let across = windows_on_the_map(&at(half_m - 100.0, half_m + 50.0));
        assert_eq!(across.len(), 2);
        assert!((across[1].max_x_m - (-half_m + 50.0)).abs() < 1e-3);
        let west = windows_on_the_map(&at(-half_m - 50.0, -half_m + 100.0));
        assert_eq!(west.len(), 2);
        assert!((west[0].min_x_m - (half_m - 50.0)).abs() < 1e-3);
        assert_eq!(windows_on_the_map(&at(-WORLD_M, WORLD_M)).len(), 1);
        assert!(windows_on_the_map(&at(f64::NAN, 1.0)).is_empty());
    }
}
