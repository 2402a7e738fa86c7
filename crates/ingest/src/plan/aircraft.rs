//! `Aircraft`: the checked content of `aircraft.toml`; and reading a calibration.

use super::error::PlanError;
use super::text_file::read_text;
use overfly_core::camera::CameraFile;
use overfly_core::coupling::{Calibration, CouplingError, CouplingParameters, DriftGrowth, ground_extent_m};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// An aircraft and its camera.
///
/// The scale of the frames is given in one of three ways: `gsd_m_per_px`; `height_m` and `field_of_view_deg`; or `height_m`
/// and `camera`. The fields `speed_mps`, `min_turn_radius_m` and, without a camera, the frame's size are required; all others
/// are optional.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aircraft {
    /// v: ground speed, m/s.
    pub speed_mps: f64,
    /// R_min: smallest turn radius, metres; `inf` for straight flight only.
    pub min_turn_radius_m: f64,
    /// Columns of a frame, across the heading, pixels.
    pub width_px: Option<f64>,
    /// Rows of a frame, along the heading, pixels.
    pub height_px: Option<f64>,
    /// Ground sample distance of the frames, m/px.
    pub gsd_m_per_px: Option<f64>,
    /// Height above ground, metres.
    pub height_m: Option<f64>,
    /// Full field of view along the heading, degrees.
    pub field_of_view_deg: Option<f64>,
    /// The path of a `camera.toml`, relative to this file.
    pub camera: Option<PathBuf>,
    /// Ground sample distance of the map, m/px [default: the store's, or that of the frames].
    pub map_gsd_m_per_px: Option<f64>,
    /// I: full width of a fix's error, metres [default: six pixels of the map, three to each side].
    pub inaccuracy_m: Option<f64>,
    /// n: matches that agree in a relative registration [default: the calibration's].
    pub matched_count: Option<f64>,
    /// D_U: drift of one relative registration, metres, one-sided [default: the calibration's at `matched_count`].
    pub unit_drift_m: Option<f64>,
    /// Relative error of the stated height. It scales every relative displacement, v t0, and so adds to D_U.
    #[serde(default)]
    pub height_error_ratio: f64,
    /// `linear` (the paper's n D_U) or `square_root`.
    #[serde(default)]
    pub drift_growth: DriftGrowth,
    /// p: measured probability that a fix fails [default: the paper's model, growing with the search's time].
    pub failure_probability: Option<f64>,
    /// Time since the last fix when the parallel or combined mode starts, seconds.
    #[serde(default)]
    pub without_fix_s: f64,
    /// Whether relative and absolute registrations can run at the same time.
    #[serde(default = "yes")]
    pub parallel_registrations: bool,
}

fn yes() -> bool {
    true
}

/// Reads an aircraft file and the camera file that it names. The frame's width and height are set in the result.
///
/// # Errors
/// [`PlanError::Unreadable`], [`PlanError::NotAnAircraft`] with the field.
pub fn read_aircraft(path: &Path) -> Result<Aircraft, PlanError> {
    let refuse = |reason: String| PlanError::NotAnAircraft { path: path.into(), reason };
    let mut aircraft: Aircraft = read_toml(path, refuse)?;
    if let Some(camera) = &aircraft.camera {
        let beside = path.parent().unwrap_or(Path::new("")).join(camera);
        let camera: CameraFile = read_toml(&beside, |reason| refuse(format!("camera {}: {reason}", beside.display())))?;
        camera.check().map_err(|e| refuse(format!("camera {}: {e}", beside.display())))?;
        let Some(height_m) = aircraft.height_m else { return Err(refuse("camera needs height_m".into())) };
        if aircraft.gsd_m_per_px.is_some() || aircraft.field_of_view_deg.is_some() {
            return Err(refuse("camera, gsd_m_per_px and field_of_view_deg exclude each other".into()));
        }
        aircraft.gsd_m_per_px = Some(height_m / camera.focal_length_px);
        aircraft.width_px.get_or_insert(f64::from(camera.width_px));
        aircraft.height_px.get_or_insert(f64::from(camera.height_px));
    }
    aircraft.missing().map_or(Ok(()), |what| Err(refuse(what.into())))?;
    aircraft.parameters(&Calibration::PROJECT, None).map_err(|e| refuse(e.to_string()))?;
    Ok(aircraft)
}

/// Reads a calibration file.
///
/// # Errors
/// [`PlanError::Unreadable`], [`PlanError::NotACalibration`] with the field.
pub fn read_calibration(path: &Path) -> Result<Calibration, PlanError> {
    let refuse = |reason: String| PlanError::NotACalibration { path: path.into(), reason };
    let calibration: Calibration = read_toml(path, refuse)?;
    calibration.check().map_err(|e| refuse(e.to_string()))?;
    Ok(calibration)
}

fn read_toml<T: DeserializeOwned>(path: &Path, refuse: impl Fn(String) -> PlanError) -> Result<T, PlanError> {
    let text = read_text(path).map_err(|cause| PlanError::Unreadable { path: path.into(), cause })?;
    toml::from_str(&text).map_err(|e| refuse(e.to_string().trim().replace('\n', " ")))
}

fn missing(name: &'static str, expected: &'static str) -> CouplingError {
    CouplingError::OutOfDomain { name, value: f64::NAN, expected }
}

impl Aircraft {
    /// What the file must state and does not, or states twice.
    fn missing(&self) -> Option<&'static str> {
        match (self.gsd_m_per_px, self.height_m, self.field_of_view_deg) {
            (Some(_), _, Some(_)) => return Some("leave out field_of_view_deg where gsd_m_per_px is stated"),
            (None, Some(_), None) | (None, None, _) => {
                return Some("state gsd_m_per_px, or height_m with field_of_view_deg, or height_m with camera");
            }
            _ => {}
        }
        match (self.width_px, self.height_px) {
            (None, _) => Some("state width_px, or a camera that states it"),
            (_, None) => Some("state height_px, or a camera that states it"),
            _ => None,
        }
    }

    /// Returns the columns and rows of a frame, pixels.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] where they are not stated.
    pub fn frame_px(&self) -> Result<[f64; 2], CouplingError> {
        let whole = |name, value: Option<f64>| {
            let value = value.unwrap_or(f64::NAN);
            let holds = (1.0..=1e6).contains(&value);
            let expected = "pixels of the frame, or a camera that states them";
            if holds { Ok(value) } else { Err(CouplingError::OutOfDomain { name, value, expected }) }
        };
        Ok([whole("width_px", self.width_px)?, whole("height_px", self.height_px)?])
    }

    /// Returns the ground sample distance of the frames, m/px.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] where it is not stated, or stated twice.
    pub fn frame_gsd_m_per_px(&self) -> Result<f64, CouplingError> {
        match (self.gsd_m_per_px, self.height_m, self.field_of_view_deg) {
            (Some(gsd), _, None) => Ok(gsd),
            (None, Some(height_m), Some(field_deg)) => {
                Ok(ground_extent_m(height_m, field_deg.to_radians())? / self.frame_px()?[1])
            }
            (Some(_), _, Some(_)) => Err(missing("field_of_view_deg", "left out where gsd_m_per_px is given")),
            (None, ..) => {
                Err(missing("gsd_m_per_px", "given, or height_m with field_of_view_deg, or height_m with camera"))
            }
        }
    }

    /// Returns the parameters of the coupling models for a calibration and a ground sample distance of the map, m/px; by
    /// default the file's, else that of the frames.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] with the first field that is not stated or out of range.
    pub fn parameters(
        &self,
        calibration: &Calibration,
        map_gsd_m_per_px: Option<f64>,
    ) -> Result<CouplingParameters, CouplingError> {
        let [width_px, height_px] = self.frame_px()?;
        let gsd = self.frame_gsd_m_per_px()?;
        let in_range = |name, value: f64, low: f64, high: f64, expected| {
            let holds = (low..=high).contains(&value);
            if holds { Ok(value) } else { Err(CouplingError::OutOfDomain { name, value, expected }) }
        };
        in_range("gsd_m_per_px", gsd, 1e-6, 1e6, "a number from 1e-6 to 1e6")?;
        in_range("speed_mps", self.speed_mps, 1e-9, 1e9, "a number from 1e-9 to 1e9")?;
        in_range("height_error_ratio", self.height_error_ratio, 0.0, 1.0, "a ratio from 0 to 1")?;
        in_range("without_fix_s", self.without_fix_s, 0.0, 1e9, "seconds, from 0")?;
        let map_gsd = map_gsd_m_per_px.or(self.map_gsd_m_per_px).unwrap_or(gsd);
        in_range("map_gsd_m_per_px", map_gsd, 1e-6, 1e6, "a number from 1e-6 to 1e6")?;
        let (across_m, along_m) = (width_px * gsd, height_px * gsd);
        let relative_s = calibration.relative_s(width_px, height_px)?;
        let matched = self.matched_count.unwrap_or(calibration.images.matched_count);
        let drift_m = match self.unit_drift_m {
            Some(stated) => stated,
            None => calibration.unit_drift_m(width_px, height_px, gsd, matched)?,
        };
        let parameters = CouplingParameters {
            across_m,
            along_m,
            inaccuracy_m: self.inaccuracy_m.unwrap_or(6.0 * map_gsd),
            unit_drift_m: drift_m + self.height_error_ratio * self.speed_mps * relative_s,
            drift_growth: self.drift_growth,
            seconds_per_tile: calibration.seconds_per_image(map_gsd, across_m, along_m)?,
            search_constant_s: calibration.search.search_constant_s,
            relative_s,
            speed_mps: self.speed_mps,
            min_turn_radius_m: self.min_turn_radius_m,
            failure_probability: self.failure_probability,
        };
        parameters.check()?;
        Ok(parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: &str = "speed_mps = 30\nmin_turn_radius_m = 400\nwidth_px = 640\nheight_px = 480\n";

    fn read(text: &str) -> Result<Aircraft, PlanError> {
        let folder = tempfile::tempdir().unwrap();
        let camera = "width_px = 320\nheight_px = 240\nfocal_length_px = 400\nprincipal_point_px = [160, 120]\n";
        std::fs::write(folder.path().join("camera.toml"), camera).unwrap();
        let path = folder.path().join("aircraft.toml");
        std::fs::write(&path, text).unwrap();
        read_aircraft(&path)
    }

    #[test]
    fn the_three_ways_to_state_the_scale_agree() {
        // 90 degrees at 240 m see 480 m in 480 rows: 1 m/px. So does a focal length of 400 px at 400 m.
        let ways = [
            format!("{PLAIN}gsd_m_per_px = 1\n"),
            format!("{PLAIN}height_m = 240\nfield_of_view_deg = 90\n"),
            format!("{PLAIN}height_m = 400\ncamera = \"camera.toml\"\n"),
        ];
        for way in ways {
            let p = read(&way).unwrap().parameters(&Calibration::PROJECT, None).unwrap();
            assert!((p.across_m - 640.0).abs() < 1e-9 && (p.along_m - 480.0).abs() < 1e-9, "{way}");
            assert!((p.inaccuracy_m - 6.0).abs() < 1e-9);
        }
        let small =
            read("speed_mps = 30\nmin_turn_radius_m = inf\nheight_m = 400\ncamera = \"camera.toml\"\n").unwrap();
        assert_eq!(small.frame_px(), Ok([320.0, 240.0]));
    }

    #[test]
    fn names_the_file_and_the_invalid_field() {
        let broken = [
            (format!("{PLAIN}gsd_m_per_px = nan\n"), "gsd_m_per_px"),
            (format!("{PLAIN}gsd_m_per_px = 1\nspeed_kmh = 3\n"), "speed_kmh"),
            (format!("{PLAIN}gsd_m_per_px = 1\nunit_drift_m = -1\n"), "unit_drift_m"),
            (format!("{PLAIN}gsd_m_per_px = 1\nheight_error_ratio = nan\n"), "height_error_ratio"),
            (format!("{PLAIN}gsd_m_per_px = 1\nfailure_probability = 2\n"), "failure_probability"),
            (format!("{PLAIN}gsd_m_per_px = 1\nfield_of_view_deg = 20\n"), "field_of_view_deg"),
            (format!("{PLAIN}height_m = 300\nfield_of_view_deg = 180\n"), "field_of_view_rad"),
            (PLAIN.replace("30", "nan") + "gsd_m_per_px = 1\n", "speed_mps"),
            (PLAIN.replace("width_px = 640\n", "gsd_m_per_px = 1\n"), "width_px"),
            (PLAIN.into(), "gsd_m_per_px"),
            (format!("{PLAIN}camera = \"camera.toml\"\n"), "height_m"),
        ];
        for (text, field) in broken {
            let error = read(&text).unwrap_err();
            assert_eq!(error.code(), "not_an_aircraft");
            assert!(error.to_string().contains(field) && error.to_string().contains("aircraft.toml"), "{error}");
        }
        let missing = read(&format!("{PLAIN}height_m = 3\ncamera = \"none.toml\"\n")).unwrap_err();
        assert!(missing.code() == "unreadable" && missing.to_string().contains("none.toml"), "{missing}");
    }

    #[test]
    fn a_wrong_height_adds_its_share_of_every_displacement_to_the_drift() {
        let base = format!("{PLAIN}gsd_m_per_px = 1\nunit_drift_m = 0.25\n");
        let p = read(&format!("{base}height_error_ratio = 0.02\n")).unwrap();
        let p = p.parameters(&Calibration::PROJECT, None).unwrap();
        assert!((p.unit_drift_m - 0.25 - 0.02 * 30.0 * p.relative_s).abs() < 1e-12);
    }
}
