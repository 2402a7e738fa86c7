//! `FixParameters`: a request as callers spell it. The names are those of the command line and of HTTP, and they are checked here.

use super::domain::{ALTITUDE, METRES, POSITIVE};
use super::error::LocateError;
use super::request::{FixRequest, HeadingPrior, PositionPrior, check_view};
use overfly_core::camera::{Attitude, Height, Intrinsics, View};
use overfly_core::geodesy::VerticalDatum;

/// Standard deviation of a stated heading where none is given, degrees.
pub const DEFAULT_HEADING_SIGMA_DEG: f64 = 3.0;
/// Standard deviation of height or ground sample distance where none is given, as a ratio.
pub const DEFAULT_HEIGHT_SIGMA_RATIO: f64 = 0.03;

/// Every parameter of a fix, as given. Degrees and metres, by the names' suffixes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FixParameters {
    /// Most likely nadir, degrees north in [-85.051128, 85.051128]. Without a position the whole layer is searched.
    pub latitude_deg: Option<f64>,
    /// Most likely nadir, degrees east in [-180, 180].
    pub longitude_deg: Option<f64>,
    /// One standard deviation of the position towards east and towards north, metres.
    pub sigma_m: Option<f64>,
    /// Instead of `sigma_m`: one standard deviation towards east, metres.
    pub sigma_east_m: Option<f64>,
    /// One standard deviation towards north, metres.
    pub sigma_north_m: Option<f64>,
    /// Correlation of both; 0 by default.
    pub correlation: Option<f64>,
    /// Azimuth of the image's upper edge, degrees clockwise from true north in [0, 360). Without it all headings are searched.
    pub heading_deg: Option<f64>,
    /// One standard deviation of the heading, degrees in (0, 180]; 3 by default.
    pub heading_sigma_deg: Option<f64>,
    /// How the camera looked.
    pub view: ViewParameters,
    /// One standard deviation of height or ground sample distance, as a ratio in (0, 0.3]; 0.03 by default.
    pub height_sigma_ratio: Option<f64>,
    /// When the image was taken, seconds of any clock; echoed in the answer.
    pub time_s: Option<f64>,
}

impl FixParameters {
    /// Returns the request for a layer.
    ///
    /// # Errors
    /// [`LocateError::Missing`], [`LocateError::Conflict`], [`LocateError::Parameter`] or [`LocateError::Camera`], each with the
    /// name of the parameter.
    pub fn request(&self, layer: &str) -> Result<FixRequest, LocateError> {
        let expected = "ground sample distance, or height_m and camera";
        let request = FixRequest {
            layer: layer.to_owned(),
            position: self.position()?,
            heading: self.heading()?,
            view: self.view.view()?.ok_or(LocateError::Missing { name: "gsd_m_per_px", expected })?,
            scale_sigma_ratio: self.height_sigma_ratio.unwrap_or(DEFAULT_HEIGHT_SIGMA_RATIO),
            time_s: self.time_s,
        };
        request.check()?;
        Ok(request)
    }

    fn position(&self) -> Result<PositionPrior, LocateError> {
        let given = [
            ("sigma_m", self.sigma_m),
            ("sigma_east_m", self.sigma_east_m),
            ("sigma_north_m", self.sigma_north_m),
            ("correlation", self.correlation),
        ];
        let (latitude_deg, longitude_deg) = match (self.latitude_deg, self.longitude_deg) {
            (Some(latitude_deg), Some(longitude_deg)) => (latitude_deg, longitude_deg),
            (Some(_), None) => return missing("longitude_deg", "it is required beside latitude_deg"),
            (None, Some(_)) => return missing("latitude_deg", "it is required beside longitude_deg"),
            (None, None) => {
                return match given.into_iter().find(|(_, value)| value.is_some()) {
                    Some((name, _)) => conflict(name, "an unknown position"),
                    None => Ok(PositionPrior::WholeLayer),
                };
            }
        };
        PositionPrior::from_degrees(latitude_deg, longitude_deg, self.sigmas_m()?, self.correlation.unwrap_or(0.0))
    }

    /// Standard deviations towards east and north.
    fn sigmas_m(&self) -> Result<[f64; 2], LocateError> {
        match (self.sigma_m, self.sigma_east_m, self.sigma_north_m) {
            (Some(_), None, None) if self.correlation.is_some() => conflict("correlation", "sigma_m"),
            (Some(both), None, None) => {
                METRES.check("sigma_m", both)?;
                Ok([both, both])
            }
            (None, Some(east), Some(north)) => Ok([east, north]),
            (None, None, None) => missing("sigma_m", "one standard deviation of the position, metres"),
            (Some(_), ..) => conflict("sigma_m", "sigma_east_m, sigma_north_m"),
            (None, None, Some(_)) => missing("sigma_east_m", "it is required beside sigma_north_m"),
            (None, Some(_), None) => missing("sigma_north_m", "it is required beside sigma_east_m"),
        }
    }

    fn heading(&self) -> Result<Option<HeadingPrior>, LocateError> {
        match (self.heading_deg, self.heading_sigma_deg) {
            (Some(heading_deg), sigma_deg) => {
                HeadingPrior::from_degrees(heading_deg, sigma_deg.unwrap_or(DEFAULT_HEADING_SIGMA_DEG)).map(Some)
            }
            (None, Some(_)) => conflict("heading_sigma_deg", "an unknown heading"),
            (None, None) => Ok(None),
        }
    }
}

/// How the camera looked, as given: a ground sample distance, or a height and a camera.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ViewParameters {
    /// Ground sample distance of the frame, metres per pixel, where the camera looks straight down.
    pub gsd_m_per_px: Option<f64>,
    /// Height above ground, metres; needs `camera`.
    pub height_m: Option<f64>,
    /// Instead of `height_m`: height above mean sea level (EGM2008), metres; needs `camera`, and a store with terrain.
    pub height_msl_m: Option<f64>,
    /// Instead of `height_m`: height above the WGS84 ellipsoid, metres; needs `camera`, and a store with terrain.
    pub height_ellipsoidal_m: Option<f64>,
    /// The camera's intrinsics; need `height_m`.
    pub camera: Option<Intrinsics>,
    /// Pitch off nadir, degrees in [-45, 45], positive ahead; needs `camera`.
    pub pitch_deg: Option<f64>,
    /// Roll off nadir, degrees in [-45, 45], positive to the left; needs `camera`.
    pub roll_deg: Option<f64>,
    /// One standard deviation of pitch and of roll, degrees in [0, 20]; needs `camera`. By default 2 where both are stated, else 5.
    pub attitude_sigma_deg: Option<f64>,
}

impl ViewParameters {
    /// Returns the view; `None` where nothing is given.
    ///
    /// # Errors
    /// As [`FixParameters::request`].
    pub fn view(&self) -> Result<Option<View>, LocateError> {
        let view = match (self.gsd_m_per_px, self.height()?, &self.camera) {
            (None, None, None) => {
                self.refuse_tilt("an unknown camera")?;
                return Ok(None);
            }
            (Some(gsd_m_per_px), None, None) => {
                POSITIVE.check("gsd_m_per_px", gsd_m_per_px)?;
                self.refuse_tilt("gsd_m_per_px")?;
                View::Nadir { gsd_m_per_px }
            }
            (None, Some(height), Some(camera)) => {
                let radians = |angle_deg: Option<f64>| angle_deg.map(f64::to_radians);
                let (pitch_rad, roll_rad) = (radians(self.pitch_deg), radians(self.roll_deg));
                let attitude = Attitude::new(pitch_rad, roll_rad, radians(self.attitude_sigma_deg));
                View::Posed { intrinsics: camera.clone(), height, attitude }
            }
            (None, Some(_), None) => return missing("camera", "it is required beside height_m"),
            (None, None, Some(_)) => return missing("height_m", "it is required beside camera"),
            (Some(_), ..) => return conflict("gsd_m_per_px", "height_m, camera"),
        };
        check_view(&view)?;
        Ok(Some(view))
    }

    /// The height, stated in one way at most.
    fn height(&self) -> Result<Option<Height>, LocateError> {
        match (self.height_m, self.height_msl_m, self.height_ellipsoidal_m) {
            (None, None, None) => Ok(None),
            (Some(height_m), None, None) => {
                POSITIVE.check("height_m", height_m)?;
                Ok(Some(Height::AboveGround(height_m)))
            }
            (None, Some(height_m), None) => {
                ALTITUDE.check("height_msl_m", height_m)?;
                Ok(Some(Height::AboveDatum(VerticalDatum::Egm2008, height_m)))
            }
            (None, None, Some(height_m)) => {
                ALTITUDE.check("height_ellipsoidal_m", height_m)?;
                Ok(Some(Height::AboveDatum(VerticalDatum::Ellipsoid, height_m)))
            }
            (Some(_), Some(_), _) => conflict("height_msl_m", "height_m"),
            (Some(_), ..) => conflict("height_ellipsoidal_m", "height_m"),
            (None, Some(_), Some(_)) => conflict("height_ellipsoidal_m", "height_msl_m"),
        }
    }

    /// Only a camera with a height can be tilted, or known to be untilted.
    fn refuse_tilt(&self, with: &'static str) -> Result<(), LocateError> {
        let tilted = [
            ("pitch_deg", self.pitch_deg),
            ("roll_deg", self.roll_deg),
            ("attitude_sigma_deg", self.attitude_sigma_deg),
        ];
        match tilted.into_iter().find(|(_, angle)| angle.is_some_and(|a| a != 0.0)) {
            Some((name, _)) => conflict(name, with),
            None => Ok(()),
        }
    }
}

fn missing<T>(name: &'static str, expected: &'static str) -> Result<T, LocateError> {
    Err(LocateError::Missing { name, expected })
}

fn conflict<T>(name: &'static str, with: &'static str) -> Result<T, LocateError> {
    Err(LocateError::Conflict { name, with })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Intrinsics {
        Intrinsics::centred(640, 480, 700.0)
    }

    fn nadir() -> FixParameters {
        FixParameters {
            view: ViewParameters { gsd_m_per_px: Some(1.0), ..ViewParameters::default() },
            ..FixParameters::default()
        }
    }

    #[test]
    fn takes_both_ways_of_stating_the_scale() {
        let request = nadir().request("ortho").unwrap();
        assert_eq!((request.position, request.heading), (PositionPrior::WholeLayer, None));
        let view = ViewParameters {
            height_m: Some(500.0),
            camera: Some(camera()),
            pitch_deg: Some(3.0),
            ..ViewParameters::default()
        };
        let posed = FixParameters {
            latitude_deg: Some(47.0),
            longitude_deg: Some(8.0),
            sigma_m: Some(100.0),
            heading_deg: Some(90.0),
            view,
            ..FixParameters::default()
        };
        // Roll is not stated, so the attitude is as good as unknown.
        let View::Posed { attitude, .. } = posed.request("ortho").unwrap().view else { panic!("a pose") };
        assert_eq!((attitude.roll_rad, attitude.sigma_rad), (None, Attitude::UNSTATED.sigma_rad));
    }

    fn refused(change: impl FnOnce(&mut FixParameters)) -> &'static str {
        let mut parameters = nadir();
        change(&mut parameters);
        parameters.request("ortho").unwrap_err().parameter().unwrap()
    }

    #[test]
    fn names_the_scale_at_fault() {
        assert_eq!(refused(|p| p.view.gsd_m_per_px = None), "gsd_m_per_px");
        assert_eq!(refused(|p| p.view.gsd_m_per_px = Some(0.0)), "gsd_m_per_px");
        assert_eq!(refused(|p| p.view.height_m = Some(3.0)), "gsd_m_per_px");
        assert_eq!(refused(|p| (p.view.gsd_m_per_px, p.view.height_m) = (None, Some(3.0))), "camera");
        assert_eq!(refused(|p| (p.view.gsd_m_per_px, p.view.camera) = (None, Some(camera()))), "height_m");
        assert_eq!(refused(|p| p.view.pitch_deg = Some(3.0)), "pitch_deg");
        let posed = |pitch_deg| ViewParameters {
            height_m: Some(3.0),
            camera: Some(camera()),
            pitch_deg: Some(pitch_deg),
            ..ViewParameters::default()
        };
        assert_eq!(refused(|p| p.view = posed(46.0)), "pitch_deg");
        assert_eq!(refused(|p| p.view.attitude_sigma_deg = Some(2.0)), "attitude_sigma_deg");
        let unsure = |sigma_deg| ViewParameters { attitude_sigma_deg: Some(sigma_deg), ..posed(1.0) };
        assert_eq!(refused(|p| p.view = unsure(21.0)), "attitude_sigma_deg");
    }

    #[test]
    fn names_the_prior_at_fault() {
        let place = |p: &mut FixParameters| (p.latitude_deg, p.longitude_deg) = (Some(3.0), Some(4.0));
        assert_eq!(refused(|p| p.latitude_deg = Some(3.0)), "longitude_deg");
        assert_eq!(refused(place), "sigma_m");
        let with_sigma = |p: &mut FixParameters, sigma_m| {
            place(p);
            p.sigma_m = Some(sigma_m);
        };
        assert_eq!(refused(|p| with_sigma(p, -5.0)), "sigma_m");
        assert_eq!(
            refused(|p| {
                with_sigma(p, 5.0);
                p.latitude_deg = Some(86.0);
            }),
            "latitude_deg"
        );
        assert_eq!(
            refused(|p| {
                with_sigma(p, 5.0);
                p.correlation = Some(0.1);
            }),
            "correlation"
        );
        assert_eq!(refused(|p| p.sigma_m = Some(5.0)), "sigma_m");
        assert_eq!(refused(|p| p.heading_deg = Some(360.0)), "heading_deg");
        assert_eq!(refused(|p| p.heading_sigma_deg = Some(3.0)), "heading_sigma_deg");
        assert_eq!(refused(|p| p.height_sigma_ratio = Some(0.0)), "height_sigma_ratio");
    }
}
