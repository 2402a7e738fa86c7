//! Conversion from areas of images, the unit of the paper, to tiles of a store.

use super::CouplingError;
use super::error::{not_negative, positive};

/// K1 per area of one image, seconds, from a search time per square tile of `tile_m` metres: times a b / tile^2.
///
/// 𝒩 counts images of a x b, into which the paper's map is cut. A store's tiles have another size, so a time per tile must be
/// converted before it is multiplied by 𝒩.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # Example
/// An image of 600 x 400 m has the area of six tiles of 200 m.
/// ```
/// let k1_s = overfly_core::coupling::seconds_per_image(0.02, 200.0, 600.0, 400.0).unwrap();
/// assert!((k1_s - 0.12).abs() < 1e-12);
/// ```
///
/// # References
/// K1 of equation 4.
pub fn seconds_per_image(
    seconds_per_tile: f64,
    tile_m: f64,
    across_m: f64,
    along_m: f64,
) -> Result<f64, CouplingError> {
    let image_m2 = positive("across_m", across_m)? * positive("along_m", along_m)?;
    let tile_m2 = positive("tile_m", tile_m)?.powi(2);
    Ok(positive("seconds_per_tile", seconds_per_tile)? * image_m2 / tile_m2)
}

/// The mean number of tiles that meet a rectangle of `width_m` by `length_m`, over all positions on a grid of tiles of
/// `tile_width_m` by `tile_length_m` that is turned against the rectangle by `turned_rad`.
///
/// (3) counts the area over that of a tile; the rim adds to it. Without a turn the mean is
/// (width / tile width + 1)(length / tile length + 1): 4 for one image on a grid of its own size, where (3) gives 1.
///
/// # Errors
/// [`CouplingError::OutOfDomain`].
///
/// # Example
/// ```
/// let tiles = overfly_core::coupling::mean_tile_count(600.0, 400.0, 600.0, 400.0, 0.0).unwrap();
/// assert_eq!(tiles, 4.0);
/// ```
///
/// # References
/// Extends equation 3. At one offset the rectangle meets the tiles whose corner lies in the rectangle dilated by the mirrored
/// tile. The mean over all offsets is that area over the area of a tile.
pub fn mean_tile_count(
    width_m: f64,
    length_m: f64,
    tile_width_m: f64,
    tile_length_m: f64,
    turned_rad: f64,
) -> Result<f64, CouplingError> {
    let (width_m, length_m) = (not_negative("width_m", width_m)?, not_negative("length_m", length_m)?);
    let (tile_width_m, tile_length_m) =
        (positive("tile_width_m", tile_width_m)?, positive("tile_length_m", tile_length_m)?);
    if !turned_rad.is_finite() {
        return Err(CouplingError::OutOfDomain { name: "turned_rad", value: turned_rad, expected: "finite" });
    }
    let (sin, cos) = (turned_rad.sin().abs(), turned_rad.cos().abs());
    let tile_m2 = tile_width_m * tile_length_m;
    // The tile's extent along the rectangle's two axes.
    let (tile_across_m, tile_along_m) =
        (tile_width_m * cos + tile_length_m * sin, tile_width_m * sin + tile_length_m * cos);
    let dilated_m2 = width_m * length_m + tile_m2 + width_m * tile_along_m + length_m * tile_across_m;
    Ok(dilated_m2 / tile_m2)
}

#[cfg(test)]
mod tests {
    use super::super::nominal_count_sequential;
    use super::*;

    /// Tiles of a grid through `offset` that a rectangle from the origin meets: counted, not computed.
    fn counted(width: f64, length: f64, tile: (f64, f64), offset: (f64, f64)) -> usize {
        let meets = |low: f64, size: f64, extent: f64| low < extent && low + size > 0.0;
        let range = -3..40;
        let columns = range.clone().filter(|c| meets(f64::from(*c) * tile.0 - offset.0, tile.0, width)).count();
        columns * range.filter(|r| meets(f64::from(*r) * tile.1 - offset.1, tile.1, length)).count()
    }

    #[test]
    fn counted_tiles_follow_the_rim_and_equation_3_is_their_floor() {
        let (a, b) = (600.0, 400.0);
        for (inaccuracy, drift) in [(0.0, 0.0), (30.0, 0.0), (0.0, 150.0), (80.0, 700.0)] {
            let (width, length) = (a + inaccuracy + 2.0 * drift, b + inaccuracy + 2.0 * drift);
            let paper = nominal_count_sequential(a, b, inaccuracy, drift);
            let (steps, mut sum, mut least, mut most) = (200, 0usize, usize::MAX, 0);
            for i in 0..steps {
                for j in 0..steps {
                    // Half a step off the edges, so that touching is never in question.
                    let part = |k: i32| (f64::from(k) + 0.5) / f64::from(steps);
                    let tiles = counted(width, length, (a, b), (part(i) * a, part(j) * b));
                    (sum, least, most) = (sum + tiles, least.min(tiles), most.max(tiles));
                }
            }
            let mean = sum as f64 / f64::from(steps * steps);
            let stated = mean_tile_count(width, length, a, b, 0.0).unwrap();
            assert!((mean - stated).abs() < 0.02 * stated, "{mean} counted, {stated} stated");
            assert!(least as f64 >= paper - 1e-9, "{least} under {paper}");
            assert!(most as f64 <= ((width / a).ceil() + 1.0) * ((length / b).ceil() + 1.0));
        }
        // Without drift: 1 by the paper, 4 at every offset but on the grid's own lines.
        assert_eq!(nominal_count_sequential(a, b, 0.0, 0.0), 1.0);
        assert_eq!(counted(a, b, (a, b), (10.0, 10.0)), 4);
        assert_eq!(counted(a, b, (a, b), (0.0, 0.0)), 1);
    }

    #[test]
    fn with_wide_drift_the_rim_is_lost_in_the_area() {
        let paper = nominal_count_sequential(600.0, 400.0, 0.0, 1e5);
        let tiles = mean_tile_count(2e5 + 600.0, 2e5 + 400.0, 600.0, 400.0, 0.0).unwrap();
        assert!(tiles > paper && tiles < 1.006 * paper);
    }

    #[test]
    fn a_turned_rectangle_meets_the_tiles_counted_by_separating_axes() {
        // Two convex shapes meet unless an edge's direction of one of them separates them.
        let (width, length, tile, turned) = (700.0f64, 300.0f64, 256.0f64, 0.5f64);
        let (sin, cos) = turned.sin_cos();
        let meets = |x: f64, y: f64| {
            let half = tile / 2.0 * (cos + sin);
            let own = [(x * cos + y * sin, width / 2.0 + half), (y * cos - x * sin, length / 2.0 + half)];
            let grid = [
                (x, tile / 2.0 + width / 2.0 * cos + length / 2.0 * sin),
                (y, tile / 2.0 + width / 2.0 * sin + length / 2.0 * cos),
            ];
            own.into_iter().chain(grid).all(|(centre, reach)| centre.abs() < reach)
        };
        let (steps, mut sum) = (160, 0usize);
        for i in 0..steps {
            for j in 0..steps {
                let part = |k: i32| (f64::from(k) + 0.5) / f64::from(steps) * tile;
                sum += (-8..8)
                    .flat_map(|c| (-8..8).map(move |r| (f64::from(c) * tile, f64::from(r) * tile)))
                    .filter(|(x, y)| meets(x + part(i), y + part(j)))
                    .count();
            }
        }
        let mean = sum as f64 / f64::from(steps * steps);
        let stated = mean_tile_count(width, length, tile, tile, turned).unwrap();
        assert!((mean / stated - 1.0).abs() < 0.01, "{mean} counted, {stated} stated");
    }

    #[test]
    fn refuses_tiles_without_extent() {
        assert!(
            mean_tile_count(1.0, 1.0, 0.0, 1.0, 0.0).is_err() && mean_tile_count(1.0, 1.0, 1.0, 1.0, f64::NAN).is_err()
        );
        assert!(seconds_per_image(0.02, 0.0, 1.0, 1.0).is_err());
    }
}
