//! `FixRequest`: what a caller asks of `locate`, and the domain of every parameter.

use super::domain::{
    ALTITUDE, ATTITUDE_SIGMA, CORRELATION, HEADING, HEADING_SIGMA, HEIGHT_SIGMA, LATITUDE, LONGITUDE, METRES,
};
use super::error::LocateError;
use overfly_core::camera::{Camera, Height, View};
use overfly_core::geodesy::Geodetic;

/// What is known of the position of the nadir; of the image's centre, where the view states no height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PositionPrior {
    /// A Gaussian: the 99.7 % ellipse is searched.
    Gaussian {
        /// Most likely nadir.
        centre: Geodetic,
        /// One standard deviation towards east, metres in [0.001, 1e7].
        sigma_east_m: f64,
        /// One standard deviation towards north, metres in [0.001, 1e7].
        sigma_north_m: f64,
        /// Correlation of both, in [-0.999, 0.999].
        correlation: f64,
    },
    /// Anywhere in a north-up square.
    Square {
        /// Centre of the square.
        centre: Geodetic,
        /// Half the edge of the square, metres in [0.001, 1e7].
        half_width_m: f64,
    },
    /// Anywhere on the layer.
    WholeLayer,
}

impl PositionPrior {
    /// Returns a Gaussian around a position in degrees, latitude in [-85.051128, 85.051128] and longitude in [-180, 180], with
    /// one standard deviation towards east and north, metres.
    ///
    /// # Errors
    /// [`LocateError::Parameter`].
    pub fn from_degrees(
        latitude_deg: f64,
        longitude_deg: f64,
        sigma_m: [f64; 2],
        correlation: f64,
    ) -> Result<Self, LocateError> {
        LATITUDE.check("latitude_deg", latitude_deg)?;
        LONGITUDE.check("longitude_deg", longitude_deg)?;
        let centre = Geodetic::from_degrees(latitude_deg, longitude_deg).expect("both are in range");
        let [sigma_east_m, sigma_north_m] = sigma_m;
        let prior = Self::Gaussian { centre, sigma_east_m, sigma_north_m, correlation };
        prior.check()?;
        Ok(prior)
    }

    fn check(&self) -> Result<(), LocateError> {
        match *self {
            Self::Gaussian { sigma_east_m, sigma_north_m, correlation, .. } => {
                METRES.check("sigma_east_m", sigma_east_m)?;
                METRES.check("sigma_north_m", sigma_north_m)?;
                CORRELATION.check("correlation", correlation)
            }
            Self::Square { half_width_m, .. } => METRES.check("half_width_m", half_width_m),
            Self::WholeLayer => Ok(()),
        }
    }
}

/// A stated heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingPrior {
    /// Azimuth of the image's upper edge, radians clockwise from true north; any finite angle.
    pub heading_rad: f64,
    /// One standard deviation, radians in (0, pi].
    pub sigma_rad: f64,
}

impl HeadingPrior {
    /// Returns a heading in degrees clockwise from true north, in [0, 360), with one standard deviation in (0, 180].
    ///
    /// # Errors
    /// [`LocateError::Parameter`].
    pub fn from_degrees(heading_deg: f64, sigma_deg: f64) -> Result<Self, LocateError> {
        HEADING.check("heading_deg", heading_deg)?;
        HEADING_SIGMA.check("heading_sigma_deg", sigma_deg)?;
        Ok(Self { heading_rad: heading_deg.to_radians(), sigma_rad: sigma_deg.to_radians() })
    }

    fn check(&self) -> Result<(), LocateError> {
        if !self.heading_rad.is_finite() {
            HEADING.check("heading_deg", self.heading_rad)?;
        }
        HEADING_SIGMA.check("heading_sigma_deg", self.sigma_rad.to_degrees())
    }
}

/// A request for one absolute registration.
#[derive(Debug, Clone, PartialEq)]
pub struct FixRequest {
    /// Name of the layer to search, or [`overfly_store::ANY_LAYER`]: all layers, the newest first, older ones only on no fix.
    pub layer: String,
    /// What is known of the position.
    pub position: PositionPrior,
    /// What is known of the heading; `None`: all headings are searched.
    pub heading: Option<HeadingPrior>,
    /// How the camera looked. Pitch and roll lie within 45 degrees of nadir, their standard deviation in [0, 20] degrees.
    pub view: View,
    /// One standard deviation of the height (or ground sample distance) as a ratio, in (0, 0.3].
    pub scale_sigma_ratio: f64,
    /// When the image was taken, seconds of any clock; echoed in the answer.
    pub time_s: Option<f64>,
}

impl FixRequest {
    /// Refuses parameters that are not finite or out of range.
    ///
    /// # Errors
    /// [`LocateError::Parameter`], and [`LocateError::Camera`] for the view; both name the parameter.
    pub fn check(&self) -> Result<(), LocateError> {
        self.position.check()?;
        if let Some(heading) = &self.heading {
            heading.check()?;
        }
        check_view(&self.view)?;
        HEIGHT_SIGMA.check("height_sigma_ratio", self.scale_sigma_ratio)?;
        match self.time_s {
            Some(time_s) if !time_s.is_finite() => {
                Err(LocateError::Parameter { name: "time_s", value: time_s, expected: "must be a finite number" })
            }
            _ => Ok(()),
        }
    }
}

/// Refuses a view that no camera over the ground can have.
pub(super) fn check_view(view: &View) -> Result<(), LocateError> {
    let View::Posed { intrinsics, height, attitude } = view else {
        Camera::new(view, 1, 1)?;
        return Ok(());
    };
    let above_ground = match height {
        Height::AboveGround(_) => view.clone(),
        // How high above ground that is follows from the terrain.
        Height::AboveDatum(_, height_m) => {
            ALTITUDE.check("height_msl_m", *height_m)?;
            View::Posed { intrinsics: intrinsics.clone(), height: Height::AboveGround(1.0), attitude: *attitude }
        }
    };
    Camera::new(&above_ground, intrinsics.width_px, intrinsics.height_px)?;
    ATTITUDE_SIGMA.check("attitude_sigma_deg", attitude.sigma_rad.to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::{Attitude, Intrinsics};
    use std::f64::consts::TAU;

    fn request() -> FixRequest {
        FixRequest {
            layer: "ortho".into(),
            position: PositionPrior::from_degrees(47.0, 8.0, [100.0, 50.0], 0.5).unwrap(),
            heading: Some(HeadingPrior::from_degrees(359.9, 3.0).unwrap()),
            view: View::Nadir { gsd_m_per_px: 1.0 },
            scale_sigma_ratio: 0.03,
            time_s: Some(1.0),
        }
    }

    fn refused(change: impl FnOnce(&mut FixRequest)) -> &'static str {
        let mut request = request();
        assert!(request.check().is_ok());
        change(&mut request);
        request.check().unwrap_err().parameter().unwrap()
    }

    #[test]
    fn refuses_what_is_out_of_range_by_name() {
        let gaussian = |sigma_east_m, correlation| {
            let centre = Geodetic::from_degrees(47.0, 8.0).unwrap();
            PositionPrior::Gaussian { centre, sigma_east_m, sigma_north_m: 1.0, correlation }
        };
        assert_eq!(refused(|r| r.position = gaussian(0.0, 0.0)), "sigma_east_m");
        assert_eq!(refused(|r| r.position = gaussian(f64::NAN, 0.0)), "sigma_east_m");
        assert_eq!(refused(|r| r.position = gaussian(1.0, 1.0)), "correlation");
        assert_eq!(
            refused(|r| r.heading = Some(HeadingPrior { heading_rad: f64::NAN, sigma_rad: 0.1 })),
            "heading_deg"
        );
        assert_eq!(
            refused(|r| r.heading = Some(HeadingPrior { heading_rad: 1.0, sigma_rad: 0.0 })),
            "heading_sigma_deg"
        );
        assert_eq!(refused(|r| r.scale_sigma_ratio = 0.0), "height_sigma_ratio");
        assert_eq!(refused(|r| r.view = View::Nadir { gsd_m_per_px: -1.0 }), "gsd_m_per_px");
        assert_eq!(refused(|r| r.time_s = Some(f64::INFINITY)), "time_s");
    }

    #[test]
    fn pitch_and_roll_lie_within_45_degrees() {
        let posed = |pitch_deg: f64, roll_deg: f64| View::Posed {
            intrinsics: Intrinsics::centred(640, 480, 700.0),
            height: Height::AboveGround(500.0),
            attitude: Attitude::exact(pitch_deg.to_radians(), roll_deg.to_radians()),
        };
        assert_eq!(refused(|r| r.view = posed(46.0, 0.0)), "pitch_deg");
        assert_eq!(refused(|r| r.view = posed(0.0, -46.0)), "roll_deg");
        assert!(FixRequest { view: posed(45.0, -45.0), ..request() }.check().is_ok());
    }

    #[test]
    fn the_standard_deviation_of_the_attitude_is_checked() {
        let with_sigma = |sigma_deg: f64| View::Posed {
            intrinsics: Intrinsics::centred(640, 480, 700.0),
            height: Height::AboveGround(500.0),
            attitude: Attitude::new(None, None, Some(sigma_deg.to_radians())),
        };
        for sigma_deg in [-0.1, 20.1, f64::NAN] {
            assert_eq!(refused(|r| r.view = with_sigma(sigma_deg)), "attitude_sigma_deg");
        }
        for sigma_deg in [0.0, 20.0] {
            assert!(FixRequest { view: with_sigma(sigma_deg), ..request() }.check().is_ok());
        }
    }

    #[test]
    fn a_heading_in_degrees_is_in_0_to_360_and_in_radians_any_angle() {
        for heading_deg in [-0.1, 360.0, f64::NAN] {
            assert_eq!(HeadingPrior::from_degrees(heading_deg, 3.0).unwrap_err().parameter(), Some("heading_deg"));
        }
        for sigma_deg in [0.0, 180.1] {
            assert_eq!(HeadingPrior::from_degrees(0.0, sigma_deg).unwrap_err().parameter(), Some("heading_sigma_deg"));
        }
        let heading = Some(HeadingPrior { heading_rad: TAU, sigma_rad: std::f64::consts::PI });
        assert!(FixRequest { heading, ..request() }.check().is_ok());
    }

    #[test]
    fn a_position_lies_within_the_tile_matrix() {
        let refused = |latitude_deg, longitude_deg| {
            PositionPrior::from_degrees(latitude_deg, longitude_deg, [1.0; 2], 0.0).unwrap_err().parameter()
        };
        assert_eq!(refused(86.0, 0.0), Some("latitude_deg"));
        assert_eq!(refused(0.0, 181.0), Some("longitude_deg"));
    }
}
