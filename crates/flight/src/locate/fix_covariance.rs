//! `FixCovariances`: how well a fix knows the ground under the image's centre, and the nadir.

use super::place_estimate::{PlaceEstimate, TiltFound};
use nalgebra::{Matrix2, Vector2};
use overfly_core::camera::{Camera, View};
use overfly_core::geodesy::{BodyFrame, BodyOffset, EnuCovariance};
use overfly_core::tile::Gsd;

/// Changes between two dates (shadows, leaves, walls seen from another side) scatter the windows, but also shift all of them
/// together, which no residual shows: one standard deviation per axis, as a multiple of the scatter. Measured on synthetic ground
/// under another sun, whose truth is exact.
const COMMON_SHIFT_SHARE: f64 = 2.0;
/// Such a shift is caused by the heights of objects, so its bound does not grow with the pixel, metres.
const MAX_COMMON_SHIFT_M: f64 = 1.0;

/// The covariances of a fix, the map's own error included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixCovariances {
    /// Of the ground under the image's centre, which is what registration measures.
    pub image_centre: EnuCovariance,
    /// Of the nadir.
    pub nadir: EnuCovariance,
}

impl FixCovariances {
    /// Returns the covariances of an estimate. `camera` is the stated one at the estimated height, `gsd` the map's at the place,
    /// `map_error_m` the map's own error, one standard deviation per axis, `relief_error_m` that of the ground's height, where the frame
    /// was laid on it: the line of sight meets the ground further along by as much as it leans.
    ///
    /// The nadir is an offset away from the image's centre. It adds the errors of that offset: along it by the height's, across it
    /// by the heading's, and by the attitude's J S J^T, with J the derivative of the offset with respect to pitch and roll. For a
    /// camera that looks straight down the offset is 0 and J the height on each axis. Where the tilt that the windows show leaves the
    /// attitude in doubt, S also holds that tilt.
    pub fn new(
        estimate: &PlaceEstimate,
        tilt: Option<&TiltFound>,
        view: &View,
        camera: &Camera,
        gsd: Gsd,
        [map_error_m, relief_error_m]: [f64; 2],
    ) -> Self {
        let common_m = (COMMON_SHIFT_SHARE * estimate.rms_px * gsd.mean_m_per_px()).min(MAX_COMMON_SHIFT_M);
        let common = Matrix2::identity() * (map_error_m.powi(2) + common_m.powi(2));
        // East runs with the map's columns, north against its rows.
        let enu_from_px = Matrix2::new(gsd.east_m_per_px, 0.0, 0.0, -gsd.north_m_per_px);
        let offset = BodyFrame::from_heading_rad(estimate.heading_rad)
            .enu_from_body(camera.image_centre_in_body().unwrap_or_default());
        let (along, across) =
            (Vector2::new(offset.east_m, offset.north_m), Vector2::new(offset.north_m, -offset.east_m));
        let lean = along / camera.height_agl_m();
        let laid = lean * lean.transpose() * relief_error_m.powi(2);
        let image_centre = enu_from_px * estimate.covariance_px2 * enu_from_px.transpose() + common + laid;
        let moved = along * along.transpose() * estimate.log_height_variance
            + across * across.transpose() * estimate.heading_variance_rad2;
        let doubt = tilt.filter(|tilt| tilt.is_doubtful()).map_or([0.0; 2], |tilt| tilt.off_rad);
        let tilted = tilt_covariance(view, doubt, camera, estimate.heading_rad);
        Self {
            image_centre: EnuCovariance::from_matrix(image_centre),
            nadir: EnuCovariance::from_matrix(image_centre + moved + tilted),
        }
    }
}

/// The covariance that the attitude's uncertainty adds to the offset from the image's centre to the nadir, m^2 in east and north.
/// Zero where no height is known.
fn tilt_covariance(view: &View, doubt_rad: [f64; 2], camera: &Camera, heading_rad: f64) -> Matrix2<f64> {
    let View::Posed { attitude, .. } = view else { return Matrix2::zeros() };
    let per_tilt = camera.image_centre_per_tilt().unwrap_or_else(Matrix2::zeros);
    let turn = BodyFrame::from_heading_rad(heading_rad);
    let enu = |axis: usize| {
        let moved = turn.enu_from_body(BodyOffset { right_m: per_tilt[(0, axis)], ahead_m: per_tilt[(1, axis)] });
        Vector2::new(moved.east_m, moved.north_m)
    };
    let per_tilt = Matrix2::from_columns(&[enu(0), enu(1)]);
    let doubt = Vector2::from(doubt_rad);
    let attitude = Matrix2::identity() * attitude.sigma_rad.powi(2) + doubt * doubt.transpose();
    per_tilt * attitude * per_tilt.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::{Attitude, Height, Intrinsics};

    fn added(pitch_deg: f64, heading_deg: f64, doubt_deg: f64) -> EnuCovariance {
        let attitude = Attitude::new(Some(pitch_deg.to_radians()), Some(0.0), Some(1f64.to_radians()));
        let view = View::Posed {
            intrinsics: Intrinsics::centred(640, 480, 700.0),
            height: Height::AboveGround(2200.0),
            attitude,
        };
        let camera = Camera::new(&view, 640, 480).unwrap();
        EnuCovariance::from_matrix(tilt_covariance(
            &view,
            [doubt_deg.to_radians(), 0.0],
            &camera,
            heading_deg.to_radians(),
        ))
    }

    #[test]
    fn a_degree_at_2200_metres_is_38_metres_straight_down_and_more_off_nadir() {
        let level = added(0.0, 33.0, 0.0).ellipse();
        let degree_m = 2200.0 * 1f64.to_radians();
        assert!((level.semi_major_m - degree_m).abs() < 1e-6 && (level.semi_minor_m - degree_m).abs() < 1e-6);
        // The derivative of h tan(p) is h / cos^2(p); the camera looks east.
        let pitched = added(30.0, 90.0, 0.0);
        assert!((pitched.ee_m2.sqrt() - degree_m / 0.75).abs() < 1e-6, "{pitched:?}");
        // Three degrees of doubt about the pitch widen it along the heading only.
        let doubtful = added(0.0, 90.0, 3.0);
        assert!((doubtful.ee_m2.sqrt() - 10f64.sqrt() * degree_m).abs() < 1e-6, "{doubtful:?}");
        assert!((doubtful.nn_m2.sqrt() - degree_m).abs() < 1e-6, "{doubtful:?}");
    }

    #[test]
    fn without_a_height_the_attitude_adds_nothing() {
        let view = View::Nadir { gsd_m_per_px: 1.0 };
        assert_eq!(tilt_covariance(&view, [0.1; 2], &Camera::new(&view, 64, 48).unwrap(), 0.3), Matrix2::zeros());
    }
}
