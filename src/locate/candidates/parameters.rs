//! The question as callers spell it: the names shared by the command line and HTTP, checked in one place.

use super::{CandidateQuery, CandidatesError};
use crate::geodesy::{Geodetic, MAX_LATITUDE_DEG};
use crate::region::{ImageOnGround, Uncertainty};

/// Every parameter of a question, as given. Degrees and metres, by the names' suffixes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CandidateParameters {
    /// Most likely position of the image's centre, degrees north.
    pub latitude_deg: Option<f64>,
    /// Most likely position of the image's centre, degrees east.
    pub longitude_deg: Option<f64>,
    /// Direction of the image's upper edge, [0, 360).
    pub heading_deg: Option<f64>,
    /// a: the image's ground extent across the heading.
    pub across_m: Option<f64>,
    /// b: the image's ground extent along the heading.
    pub along_m: Option<f64>,
    /// I: full width of the last fix's error.
    pub inaccuracy_m: Option<f64>,
    /// D_T: drift since the last fix, one-sided.
    pub drift_m: Option<f64>,
    /// Instead of inaccuracy and drift: one standard deviation towards east.
    pub sigma_east_m: Option<f64>,
    /// One standard deviation towards north.
    pub sigma_north_m: Option<f64>,
    /// Of both; 0 by default.
    pub correlation: Option<f64>,
    /// sequential (default), parallel or combined.
    pub mode: Option<String>,
    /// Of the parallel mode.
    pub unit_drift_m: Option<f64>,
    /// Of the parallel and the combined mode.
    pub execution_s: Option<f64>,
    /// Of the parallel mode.
    pub relative_s: Option<f64>,
    /// Of the combined mode.
    pub speed_mps: Option<f64>,
    /// Of the combined mode.
    pub min_turn_radius_m: Option<f64>,
    /// Which layer.
    pub layer: Option<String>,
    /// How many of the best to return.
    pub max_tiles: Option<u64>,
    /// Chooses the level.
    pub gsd_m_per_px: Option<f64>,
}

impl CandidateParameters {
    /// The question they ask.
    ///
    /// # Errors
    /// What is missing, out of range or contradictory, by name; modes that are not built.
    pub fn query(self) -> Result<CandidateQuery, CandidatesError> {
        self.refuse_other_modes()?;
        let latitude_deg = in_range("latitude_deg", self.latitude_deg, MAX_LATITUDE_DEG, LATITUDE)?;
        let longitude_deg = in_range("longitude_deg", self.longitude_deg, 180.0, "degrees in [-180, 180]")?;
        let heading_deg = required("heading_deg", self.heading_deg, HEADING)?;
        if !(0.0..360.0).contains(&heading_deg) {
            return Err(CandidatesError::out_of_range("heading_deg", heading_deg, HEADING));
        }
        if self.max_tiles == Some(0) {
            return Err(CandidatesError::out_of_range("max_tiles", 0.0, "a whole number, at least 1"));
        }
        if let Some(gsd) = self.gsd_m_per_px.filter(|gsd| !(gsd.is_finite() && *gsd > 0.0)) {
            return Err(CandidatesError::out_of_range("gsd_m_per_px", gsd, LENGTH));
        }
        Ok(CandidateQuery {
            centre: Geodetic::from_degrees(latitude_deg, longitude_deg)?,
            image: ImageOnGround {
                across_m: required("across_m", self.across_m, LENGTH)?,
                along_m: required("along_m", self.along_m, LENGTH)?,
                heading_rad: heading_deg.to_radians(),
            },
            uncertainty: self.uncertainty()?,
            layer: self.layer,
            max_tiles: self.max_tiles.map(|n| usize::try_from(n).unwrap_or(usize::MAX)),
            gsd_m_per_px: self.gsd_m_per_px,
        })
    }

    fn refuse_other_modes(&self) -> Result<(), CandidatesError> {
        match self.mode.as_deref() {
            None | Some("sequential") => {}
            Some("parallel") => return Err(CandidatesError::ModeNotBuilt { mode: "parallel" }),
            Some("combined") => return Err(CandidatesError::ModeNotBuilt { mode: "combined" }),
            Some(mode) => return Err(CandidatesError::UnknownMode { mode: mode.to_owned() }),
        }
        let foreign = [
            ("unit_drift_m", self.unit_drift_m),
            ("execution_s", self.execution_s),
            ("relative_s", self.relative_s),
            ("speed_mps", self.speed_mps),
            ("min_turn_radius_m", self.min_turn_radius_m),
        ];
        match foreign.into_iter().find(|(_, value)| value.is_some()) {
            Some((name, _)) => Err(CandidatesError::Conflict { name, with: "mode=sequential" }),
            None => Ok(()),
        }
    }

    fn uncertainty(&self) -> Result<Uncertainty, CandidatesError> {
        let by_covariance = self.sigma_east_m.is_some() || self.sigma_north_m.is_some() || self.correlation.is_some();
        if !by_covariance {
            return Ok(Uncertainty::Sequential {
                inaccuracy_m: required("inaccuracy_m", self.inaccuracy_m, NOT_NEGATIVE)?,
                drift_m: required("drift_m", self.drift_m, NOT_NEGATIVE)?,
            });
        }
        for (name, value) in [("inaccuracy_m", self.inaccuracy_m), ("drift_m", self.drift_m)] {
            if value.is_some() {
                return Err(CandidatesError::Conflict { name, with: "sigma_east_m, sigma_north_m, correlation" });
            }
        }
        Ok(Uncertainty::Covariance {
            sigma_east_m: required("sigma_east_m", self.sigma_east_m, LENGTH)?,
            sigma_north_m: required("sigma_north_m", self.sigma_north_m, LENGTH)?,
            correlation: self.correlation.unwrap_or(0.0),
        })
    }
}

const LATITUDE: &str = "degrees in [-85.051128, 85.051128], where the tile matrix ends";
const HEADING: &str = "degrees clockwise from true north in [0, 360)";
const LENGTH: &str = "more than 0 and finite";
const NOT_NEGATIVE: &str = "metres, at least 0 and finite";

fn required(name: &'static str, value: Option<f64>, expected: &'static str) -> Result<f64, CandidatesError> {
    value.ok_or(CandidatesError::Missing { name, expected })
}

fn in_range(
    name: &'static str,
    value: Option<f64>,
    limit: f64,
    expected: &'static str,
) -> Result<f64, CandidatesError> {
    let value = required(name, value, expected)?;
    if value.abs() <= limit { Ok(value) } else { Err(CandidatesError::out_of_range(name, value, expected)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complete() -> CandidateParameters {
        CandidateParameters {
            latitude_deg: Some(47.0),
            longitude_deg: Some(8.0),
            heading_deg: Some(30.0),
            across_m: Some(600.0),
            along_m: Some(400.0),
            inaccuracy_m: Some(50.0),
            drift_m: Some(100.0),
            ..Default::default()
        }
    }

    fn refusal(change: impl FnOnce(&mut CandidateParameters)) -> (&'static str, Option<&'static str>) {
        let mut parameters = complete();
        change(&mut parameters);
        let error = parameters.query().unwrap_err();
        (error.code(), error.parameter())
    }

    #[test]
    fn takes_what_is_complete() {
        assert!(complete().query().is_ok());
        let covariance = CandidateParameters {
            inaccuracy_m: None,
            drift_m: None,
            sigma_east_m: Some(100.0),
            sigma_north_m: Some(100.0),
            ..complete()
        };
        assert!(covariance.query().is_ok());
    }

    #[test]
    fn names_what_is_missing_or_wrong() {
        let out = |name| ("parameter_out_of_range", Some(name));
        assert_eq!(refusal(|p| p.drift_m = None), ("parameter_missing", Some("drift_m")));
        assert_eq!(refusal(|p| p.heading_deg = None), ("parameter_missing", Some("heading_deg")));
        assert_eq!(refusal(|p| p.latitude_deg = Some(86.0)), out("latitude_deg"));
        assert_eq!(refusal(|p| p.latitude_deg = Some(f64::NAN)), out("latitude_deg"));
        assert_eq!(refusal(|p| p.longitude_deg = Some(f64::INFINITY)), out("longitude_deg"));
        assert_eq!(refusal(|p| p.heading_deg = Some(360.0)), out("heading_deg"));
        assert_eq!(refusal(|p| p.max_tiles = Some(0)), out("max_tiles"));
        assert_eq!(refusal(|p| p.gsd_m_per_px = Some(-1.0)), out("gsd_m_per_px"));
        assert_eq!(refusal(|p| p.sigma_east_m = Some(1.0)), ("parameter_conflict", Some("inaccuracy_m")));
        assert_eq!(refusal(|p| p.speed_mps = Some(1.0)), ("parameter_conflict", Some("speed_mps")));
        assert_eq!(refusal(|p| p.mode = Some("parallel".into())), ("mode_not_built", Some("mode")));
        assert_eq!(refusal(|p| p.mode = Some("fast".into())), ("mode_unknown", Some("mode")));
    }
}
