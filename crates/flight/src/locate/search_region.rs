//! The positions to search: those of the prior, grown by what the attitude's uncertainty displaces the ground that is seen.

use super::request::{FixRequest, PositionPrior};
use overfly_core::camera::{Camera, View};

/// The ground seen is expected within this many standard deviations of the attitude.
const REACH_SIGMAS: f64 = 3.0;

/// Returns the nadirs at which a camera of the assumed attitude may show what the frame shows: the prior's nadirs, displaced by an
/// error of pitch and roll of one standard deviation `attitude.sigma_rad` each. A Gaussian's variances grow by the square of what
/// one standard deviation displaces, a square's half width by three times that.
///
/// # Cost
/// A search takes time as its area: a square of half width W takes (1 + 3 h s / W)^2 times as long at a height h and a standard
/// deviation s in radians. With 500 m at 2,200 m that is 2.1 for 2 degrees and 4.6 for 5; at 500 m 1.2 and 1.6.
pub fn searched_position(request: &FixRequest, camera: &Camera) -> PositionPrior {
    let displaced_m = displacement_sigma_m(&request.view, camera);
    if displaced_m == 0.0 {
        return request.position;
    }
    match request.position {
        PositionPrior::Gaussian { centre, sigma_east_m, sigma_north_m, correlation } => {
            let [east_m, north_m] = [sigma_east_m, sigma_north_m].map(|sigma_m| sigma_m.hypot(displaced_m));
            let correlation = correlation * (sigma_east_m / east_m) * (sigma_north_m / north_m);
            PositionPrior::Gaussian { centre, sigma_east_m: east_m, sigma_north_m: north_m, correlation }
        }
        PositionPrior::Square { centre, half_width_m } => {
            PositionPrior::Square { centre, half_width_m: half_width_m + attitude_reach_m(&request.view, camera) }
        }
        PositionPrior::WholeLayer => PositionPrior::WholeLayer,
    }
}

/// How far beyond its prior a search reaches because pitch and roll may be off, metres.
pub fn attitude_reach_m(view: &View, camera: &Camera) -> f64 {
    REACH_SIGMAS * displacement_sigma_m(view, camera)
}

/// The largest displacement of the ground under the image's centre, over all directions of tilt, by one standard deviation of the
/// attitude, metres. Zero where no height is known: the prior is then of the image's centre.
fn displacement_sigma_m(view: &View, camera: &Camera) -> f64 {
    match view {
        View::Nadir { .. } => 0.0,
        View::Posed { attitude, .. } => {
            let per_tilt = camera.image_centre_per_tilt().map_or(0.0, |slopes| slopes.singular_values()[0]);
            per_tilt * attitude.sigma_rad
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::{Attitude, Height, Intrinsics};
    use overfly_core::geodesy::Geodetic;

    fn searched(position: PositionPrior, pitch_deg: f64, sigma_deg: f64) -> PositionPrior {
        let attitude = Attitude::new(Some(pitch_deg.to_radians()), Some(0.0), Some(sigma_deg.to_radians()));
        let view = View::Posed {
            intrinsics: Intrinsics::centred(640, 480, 700.0),
            height: Height::AboveGround(2200.0),
            attitude,
        };
        let camera = Camera::new(&view, 640, 480).unwrap();
        let request =
            FixRequest { layer: "ortho".into(), position, heading: None, view, scale_sigma_ratio: 0.03, time_s: None };
        searched_position(&request, &camera)
    }

    #[test]
    fn the_region_grows_by_three_sigma_times_the_height() {
        let centre = Geodetic::from_degrees(47.0, 8.0).unwrap();
        let square = PositionPrior::Square { centre, half_width_m: 500.0 };
        assert_eq!(searched(square, 0.0, 0.0), square);
        let degree_m = 2200.0 * 1f64.to_radians();
        let PositionPrior::Square { half_width_m, .. } = searched(square, 0.0, 5.0) else { panic!("a square") };
        assert!((half_width_m - 500.0 - 15.0 * degree_m).abs() < 1e-6);
        // Off nadir the ground moves by the square of the secant more.
        let PositionPrior::Square { half_width_m, .. } = searched(square, 30.0, 1.0) else { panic!("a square") };
        assert!((half_width_m - 500.0 - 3.0 * degree_m / 0.75).abs() < 1e-6);
    }

    #[test]
    fn a_gaussian_grows_in_quadrature_and_keeps_its_covariance() {
        let prior = PositionPrior::from_degrees(47.0, 8.0, [100.0, 50.0], 0.5).unwrap();
        let PositionPrior::Gaussian { sigma_east_m, sigma_north_m, correlation, .. } = searched(prior, 0.0, 2.0) else {
            panic!("a Gaussian")
        };
        let displaced_m = 2200.0 * 2f64.to_radians();
        assert!((sigma_east_m - 100f64.hypot(displaced_m)).abs() < 1e-6);
        assert!((correlation * sigma_east_m * sigma_north_m - 0.5 * 100.0 * 50.0).abs() < 1e-6);
        assert_eq!(searched(PositionPrior::WholeLayer, 0.0, 5.0), PositionPrior::WholeLayer);
    }
}
