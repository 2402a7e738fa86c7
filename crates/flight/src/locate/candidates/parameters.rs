//! The question as callers spell it: the names shared by the command line and HTTP, checked in one place.

use super::error::CandidatesError;
use super::query::CandidateQuery;
use overfly_core::geodesy::{Geodetic, MAX_LATITUDE_DEG};
use overfly_core::region::{ImageOnGround, Uncertainty};

/// Every parameter of a question, as given. Degrees and metres, by the names' suffixes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CandidateParameters {
    /// Most likely position of the image's centre, degrees north; in the combined mode where the last fix was.
    pub latitude_deg: Option<f64>,
    /// The same, degrees east.
    pub longitude_deg: Option<f64>,
    /// Direction of the image's upper edge, [0, 360); in the combined mode where the last fix was.
    pub heading_deg: Option<f64>,
    /// a: the image's ground extent across the heading.
    pub across_m: Option<f64>,
    /// b: the image's ground extent along the heading.
    pub along_m: Option<f64>,
    /// I: full width of the last fix's error.
    pub inaccuracy_m: Option<f64>,
    /// D_T: drift since the last fix, one-sided. Of the sequential mode.
    pub drift_m: Option<f64>,
    /// Instead of inaccuracy and drift: one standard deviation towards east.
    pub sigma_east_m: Option<f64>,
    /// One standard deviation towards north.
    pub sigma_north_m: Option<f64>,
    /// Of both; 0 by default.
    pub correlation: Option<f64>,
    /// sequential (default), parallel or combined.
    pub mode: Option<String>,
    /// D_U: drift of one relative registration, one-sided. Of the parallel mode.
    pub unit_drift_m: Option<f64>,
    /// t_exe: how long the absolute registration before this search ran. Of the parallel and the combined mode.
    pub execution_s: Option<f64>,
    /// t0: time of one relative registration. Of the parallel mode.
    pub relative_s: Option<f64>,
    /// v: ground speed. Of the combined mode.
    pub speed_mps: Option<f64>,
    /// R_min: least turn radius. Of the combined mode.
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
    /// What is missing, out of range or contradictory, by name.
    pub fn query(self) -> Result<CandidateQuery, CandidatesError> {
        let uncertainty = self.uncertainty()?;
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
            uncertainty,
            layer: self.layer,
            max_tiles: self.max_tiles.map(|n| usize::try_from(n).unwrap_or(usize::MAX)),
            gsd_m_per_px: self.gsd_m_per_px,
        })
    }

    fn uncertainty(&self) -> Result<Uncertainty, CandidatesError> {
        let mode = QueryMode::named(self.mode.as_deref())?;
        self.refuse_parameters_of_other_modes(mode)?;
        let inaccuracy_m = || required("inaccuracy_m", self.inaccuracy_m, NOT_NEGATIVE);
        let execution_s = || required("execution_s", self.execution_s, TIME);
        Ok(match mode {
            QueryMode::Sequential if self.by_covariance() => Uncertainty::Covariance {
                sigma_east_m: required("sigma_east_m", self.sigma_east_m, LENGTH)?,
                sigma_north_m: required("sigma_north_m", self.sigma_north_m, LENGTH)?,
                correlation: self.correlation.unwrap_or(0.0),
            },
            QueryMode::Sequential => Uncertainty::Sequential {
                inaccuracy_m: inaccuracy_m()?,
                drift_m: required("drift_m", self.drift_m, NOT_NEGATIVE)?,
            },
            QueryMode::Parallel => Uncertainty::Parallel {
                inaccuracy_m: inaccuracy_m()?,
                unit_drift_m: required("unit_drift_m", self.unit_drift_m, NOT_NEGATIVE)?,
                execution_s: execution_s()?,
                relative_s: required("relative_s", self.relative_s, TIME)?,
            },
            QueryMode::Combined => Uncertainty::Combined {
                inaccuracy_m: inaccuracy_m()?,
                speed_mps: required("speed_mps", self.speed_mps, SPEED)?,
                execution_s: execution_s()?,
                min_turn_radius_m: required("min_turn_radius_m", self.min_turn_radius_m, LENGTH)?,
            },
        })
    }

    fn by_covariance(&self) -> bool {
        self.sigma_east_m.is_some() || self.sigma_north_m.is_some() || self.correlation.is_some()
    }

    fn refuse_parameters_of_other_modes(&self, mode: QueryMode) -> Result<(), CandidatesError> {
        use QueryMode::{Combined, Parallel, Sequential};
        let of: [(&'static str, Option<f64>, &[QueryMode]); 9] = [
            ("drift_m", self.drift_m, &[Sequential]),
            ("unit_drift_m", self.unit_drift_m, &[Parallel]),
            ("execution_s", self.execution_s, &[Parallel, Combined]),
            ("relative_s", self.relative_s, &[Parallel]),
            ("speed_mps", self.speed_mps, &[Combined]),
            ("min_turn_radius_m", self.min_turn_radius_m, &[Combined]),
            ("sigma_east_m", self.sigma_east_m, &[Sequential]),
            ("sigma_north_m", self.sigma_north_m, &[Sequential]),
            ("correlation", self.correlation, &[Sequential]),
        ];
        if let Some((name, ..)) = of.into_iter().find(|(_, value, modes)| value.is_some() && !modes.contains(&mode)) {
            return Err(CandidatesError::Conflict { name, with: mode.parameter() });
        }
        let beside = [("inaccuracy_m", self.inaccuracy_m), ("drift_m", self.drift_m)];
        match beside.into_iter().find(|(_, value)| value.is_some() && self.by_covariance()) {
            Some((name, _)) => {
                Err(CandidatesError::Conflict { name, with: "sigma_east_m, sigma_north_m, correlation" })
            }
            None => Ok(()),
        }
    }
}

/// The coupling modes by their names in `mode`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum QueryMode {
    Sequential,
    Parallel,
    Combined,
}

impl QueryMode {
    fn named(name: Option<&str>) -> Result<Self, CandidatesError> {
        match name {
            None | Some("sequential") => Ok(Self::Sequential),
            Some("parallel") => Ok(Self::Parallel),
            Some("combined") => Ok(Self::Combined),
            Some(mode) => Err(CandidatesError::UnknownMode { mode: mode.to_owned() }),
        }
    }

    fn parameter(self) -> &'static str {
        match self {
            Self::Sequential => "mode=sequential",
            Self::Parallel => "mode=parallel",
            Self::Combined => "mode=combined",
        }
    }
}

const LATITUDE: &str = "degrees in [-85.051128, 85.051128], where the tile matrix ends";
const HEADING: &str = "degrees clockwise from true north in [0, 360)";
const LENGTH: &str = "more than 0 and finite";
const NOT_NEGATIVE: &str = "metres, at least 0 and finite";
const TIME: &str = "seconds, more than 0 and finite";
const SPEED: &str = "metres per second, more than 0 and finite";

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
        assert_eq!(refusal(|p| p.mode = Some("fast".into())), ("mode_unknown", Some("mode")));
    }

    fn parallel() -> CandidateParameters {
        CandidateParameters {
            mode: Some("parallel".into()),
            drift_m: None,
            unit_drift_m: Some(1.0),
            execution_s: Some(2.0),
            relative_s: Some(0.1),
            ..complete()
        }
    }

    fn combined() -> CandidateParameters {
        CandidateParameters {
            mode: Some("combined".into()),
            drift_m: None,
            speed_mps: Some(50.0),
            execution_s: Some(2.0),
            min_turn_radius_m: Some(300.0),
            ..complete()
        }
    }

    #[test]
    fn each_mode_takes_its_own() {
        let uncertainty = |parameters: CandidateParameters| parameters.query().unwrap().uncertainty;
        assert_eq!(
            uncertainty(parallel()),
            Uncertainty::Parallel { inaccuracy_m: 50.0, unit_drift_m: 1.0, execution_s: 2.0, relative_s: 0.1 }
        );
        assert_eq!(
            uncertainty(combined()),
            Uncertainty::Combined { inaccuracy_m: 50.0, speed_mps: 50.0, execution_s: 2.0, min_turn_radius_m: 300.0 }
        );
    }

    #[test]
    fn each_mode_needs_all_of_its_own() {
        let without = |mode: fn() -> CandidateParameters, forget: fn(&mut CandidateParameters), name: &'static str| {
            let mut parameters = mode();
            forget(&mut parameters);
            let error = parameters.query().unwrap_err();
            assert_eq!((error.code(), error.parameter()), ("parameter_missing", Some(name)));
        };
        without(parallel, |p| p.inaccuracy_m = None, "inaccuracy_m");
        without(parallel, |p| p.unit_drift_m = None, "unit_drift_m");
        without(parallel, |p| p.execution_s = None, "execution_s");
        without(parallel, |p| p.relative_s = None, "relative_s");
        without(combined, |p| p.inaccuracy_m = None, "inaccuracy_m");
        without(combined, |p| p.speed_mps = None, "speed_mps");
        without(combined, |p| p.execution_s = None, "execution_s");
        without(combined, |p| p.min_turn_radius_m = None, "min_turn_radius_m");
    }

    #[test]
    fn no_mode_takes_what_belongs_to_another() {
        let with = |mode: fn() -> CandidateParameters, add: fn(&mut CandidateParameters), name: &'static str| {
            let mut parameters = mode();
            add(&mut parameters);
            let error = parameters.query().unwrap_err();
            assert_eq!((error.code(), error.parameter()), ("parameter_conflict", Some(name)));
        };
        with(complete, |p| p.execution_s = Some(1.0), "execution_s");
        with(complete, |p| p.min_turn_radius_m = Some(1.0), "min_turn_radius_m");
        with(parallel, |p| p.drift_m = Some(1.0), "drift_m");
        with(parallel, |p| p.speed_mps = Some(1.0), "speed_mps");
        with(parallel, |p| p.sigma_east_m = Some(1.0), "sigma_east_m");
        with(combined, |p| p.drift_m = Some(1.0), "drift_m");
        with(combined, |p| p.relative_s = Some(1.0), "relative_s");
        with(combined, |p| p.correlation = Some(0.1), "correlation");
    }
}
