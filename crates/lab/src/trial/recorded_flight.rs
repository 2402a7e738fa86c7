//! `RecordedFlight`: a folder of frames with the readings of the aircraft's sensors and the truth.

use super::camera_file::read_camera;
use super::error::TrialError;
use super::input_table::{InputRow, InputTable};
use overfly_core::camera::{Attitude, CameraFile, Height, Intrinsics, MAX_ATTITUDE_SIGMA_DEG, View};
use overfly_core::geodesy::{Geodetic, VerticalDatum};
use std::collections::{HashMap, HashSet};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// A flight. Frames are in the order of `flight.csv`.
#[derive(Debug, Clone)]
pub struct RecordedFlight {
    /// The `flight.csv` that was read.
    pub path: PathBuf,
    /// `camera.toml` beside it; that of the first row, where each row names its own.
    pub camera: Intrinsics,
    /// The frames; at least one.
    pub frames: Vec<RecordedFrame>,
}

/// One frame of a recorded flight.
#[derive(Debug, Clone)]
pub struct RecordedFrame {
    /// Line of `flight.csv`, the header being 1.
    pub line: u64,
    /// Name in `flight.csv`; unique in the flight.
    pub image: String,
    /// Path of the image.
    pub path: PathBuf,
    /// Time on the flight's own clock, seconds.
    pub time_s: f64,
    /// The true nadir, if stated.
    pub true_position: Option<Geodetic>,
    /// The true heading, radians clockwise from true north, if stated.
    pub true_heading_rad: Option<f64>,
    /// Height by the altimeter, metres above ground.
    pub height_agl_m: f64,
    /// Height above mean sea level (EGM2008), metres, if stated.
    pub height_msl_m: Option<f64>,
    /// The camera of this row, where it names one of its own.
    pub camera: Option<Arc<Intrinsics>>,
    /// Heading by the compass, radians clockwise from true north.
    pub heading_rad: f64,
    /// How far off nadir the camera looked, as stated.
    pub attitude: Attitude,
}

const NEEDED: [&str; 4] = ["image", "time_s", "height_agl_m", "heading_deg"];
const ANGLE: &str = "a number of degrees in [-360, 360]";
const TILT: &str = "a number of degrees off nadir in (-90, 90), or empty";
const TILT_SIGMA: &str = "a number of degrees in [0, 20], or empty";

impl RecordedFlight {
    /// Reads `flight.csv` and `camera.toml` of a folder, and checks that every image exists. Images are not decoded.
    ///
    /// # Errors
    /// The first problem, with file, line and column.
    pub fn read(folder: &Path) -> Result<Self, TrialError> {
        Self::read_rows(folder, Absurd::Refused)
    }

    /// Reads a flight as [`RecordedFlight::read`] does, but goes on where a sensor's cell is absurd: no number, or one that no sensor
    /// reads. Times, heights, headings, pitches and rolls that are no numbers become NaN.
    ///
    /// # Errors
    /// The first problem in files, columns, images or truth.
    pub fn read_with_absurd_rows(folder: &Path) -> Result<Self, TrialError> {
        Self::read_rows(folder, Absurd::Kept)
    }

    fn read_rows(folder: &Path, absurd: Absurd) -> Result<Self, TrialError> {
        let path = folder.join("flight.csv");
        let table = InputTable::read(&path, &NEEDED)?;
        let beside = folder.join("camera.toml");
        let mut cameras = Cameras::new(folder, if beside.exists() { Some(read_camera(&beside)?) } else { None });
        let mut names = HashSet::new();
        let mut frames = Vec::with_capacity(table.rows().len());
        for row in table.rows() {
            let own = cameras.of_row(&table, row)?;
            let frame = read_row(&table, row, own, absurd)?;
            if !names.insert(frame.image.clone()) {
                return Err(table.bad_cell(row, "image", "each image stands in one row only"));
            }
            frames.push(frame);
        }
        let own = frames.iter().find_map(|frame| frame.camera.as_deref().cloned());
        let camera = match (cameras.beside, own) {
            (Some(beside), _) => beside.intrinsics(),
            (None, Some(own)) => own,
            (None, None) => read_camera(&beside)?.intrinsics(),
        };
        Ok(Self { path, camera, frames })
    }

    /// The same flight with another standard deviation of the attitude, radians, for every frame, whatever the folder states.
    pub fn with_attitude_sigma_rad(mut self, sigma_rad: f64) -> Self {
        self.frames.iter_mut().for_each(|frame| frame.attitude.sigma_rad = sigma_rad);
        self
    }
}

impl RecordedFrame {
    /// The camera of this row, or else that of the flight.
    pub fn camera<'a>(&'a self, flight: &'a Intrinsics) -> &'a Intrinsics {
        self.camera.as_deref().unwrap_or(flight)
    }

    /// The view of the camera by the sensors, `camera` being that of the flight.
    pub fn view(&self, camera: &Intrinsics) -> View {
        self.view_at(camera, Height::AboveGround(self.height_agl_m))
    }

    /// As [`RecordedFrame::view`], by the height above sea where the row states it: over a map with terrain.
    pub fn view_over_terrain(&self, camera: &Intrinsics) -> View {
        let above_sea = self.height_msl_m.map(|height_m| Height::AboveDatum(VerticalDatum::Egm2008, height_m));
        self.view_at(camera, above_sea.unwrap_or(Height::AboveGround(self.height_agl_m)))
    }

    fn view_at(&self, camera: &Intrinsics, height: Height) -> View {
        View::Posed { intrinsics: self.camera(camera).clone(), height, attitude: self.attitude }
    }
}

/// What becomes of a sensor's cell that is absurd.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Absurd {
    /// The flight is not read.
    Refused,
    /// The cell is kept: a number as it is, anything else as NaN.
    Kept,
}

impl Absurd {
    /// A sensor's number by the strict reading, unless it is absurd and kept.
    fn number(
        self,
        table: &InputTable,
        row: &InputRow,
        column: &'static str,
        strict: Result<f64, TrialError>,
    ) -> Result<f64, TrialError> {
        match strict {
            Err(_) if self == Self::Kept => Ok(table.text(row, column).parse().unwrap_or(f64::NAN)),
            strict => strict,
        }
    }
}

/// A pause this many times as long as the median between frames ends a run.
const PAUSE: f64 = 5.0;

/// The pieces of a flight between pauses, in order.
pub fn runs(frames: &[RecordedFrame]) -> Vec<&[RecordedFrame]> {
    let mut gaps: Vec<f64> = frames.windows(2).map(|w| w[1].time_s - w[0].time_s).collect();
    gaps.sort_by(f64::total_cmp);
    let longest_s = gaps.get(gaps.len() / 2).map_or(0.0, |median| PAUSE * median);
    frames.chunk_by(|a, b| b.time_s - a.time_s <= longest_s).collect()
}

/// The camera files of a flight, each read once.
struct Cameras {
    folder: PathBuf,
    beside: Option<CameraFile>,
    known: HashMap<String, (Arc<Intrinsics>, Option<f64>)>,
}

impl Cameras {
    fn new(folder: &Path, beside: Option<CameraFile>) -> Self {
        Self { folder: folder.into(), beside, known: HashMap::new() }
    }

    /// The camera that a row names, and the standard deviation of the attitude that its camera file states, radians.
    fn of_row(
        &mut self,
        table: &InputTable,
        row: &InputRow,
    ) -> Result<(Option<Arc<Intrinsics>>, Option<f64>), TrialError> {
        let name = table.text(row, "camera");
        if name.is_empty() {
            let beside = match &self.beside {
                Some(beside) => beside,
                None => self.beside.insert(read_camera(&self.folder.join("camera.toml"))?),
            };
            return Ok((None, beside.attitude_sigma_deg.map(f64::to_radians)));
        }
        if !self.known.contains_key(name) {
            let path = Path::new(name);
            let is_below = path.components().all(|part| matches!(part, Component::Normal(_)));
            if !is_below {
                return Err(table.bad_cell(row, "camera", "a camera file within the folder of the flight"));
            }
            let camera = read_camera(&self.folder.join(path))?;
            let sigma_rad = camera.attitude_sigma_deg.map(f64::to_radians);
            self.known.insert(name.to_owned(), (Arc::new(camera.intrinsics()), sigma_rad));
        }
        let (camera, sigma_rad) = &self.known[name];
        Ok((Some(camera.clone()), *sigma_rad))
    }
}

/// `camera`: that which the row names, and the standard deviation of the attitude that its camera file states, for rows that state none.
fn read_row(
    table: &InputTable,
    row: &InputRow,
    (camera, sigma_rad): (Option<Arc<Intrinsics>>, Option<f64>),
    absurd: Absurd,
) -> Result<RecordedFrame, TrialError> {
    let within = |limit: f64| move |v: f64| v.abs() <= limit;
    let true_position = true_position(table, row)?;
    let tilt = |column| match table.number_or_empty(row, column, TILT, |v| v.abs() < 90.0) {
        Ok(angle) => Ok(angle),
        strict => absurd.number(table, row, column, strict.map(|_| 0.0)).map(Some),
    };
    let row_sigma = table
        .number_or_empty(row, "attitude_sigma_deg", TILT_SIGMA, |v| (0.0..=MAX_ATTITUDE_SIGMA_DEG).contains(&v))?;
    let [pitch_rad, roll_rad] = [tilt("pitch_deg")?, tilt("roll_deg")?].map(|angle| angle.map(f64::to_radians));
    let height_m = table.number(row, "height_agl_m", "a positive number of metres", |v| v > 0.0);
    let time_s = table.number(row, "time_s", "a number of seconds", |_| true);
    let heading_deg = table.number(row, "heading_deg", ANGLE, within(360.0));
    Ok(RecordedFrame {
        line: row.line,
        image: table.text(row, "image").to_owned(),
        path: table.image(row, "image")?,
        time_s: absurd.number(table, row, "time_s", time_s)?,
        true_position,
        true_heading_rad: table.number_or_empty(row, "true_heading_deg", ANGLE, within(360.0))?.map(f64::to_radians),
        height_agl_m: absurd.number(table, row, "height_agl_m", height_m)?,
        height_msl_m: table.number_or_empty(row, "height_msl_m", "a number of metres, or empty", |v| v.abs() < 1e5)?,
        camera,
        heading_rad: absurd.number(table, row, "heading_deg", heading_deg)?.to_radians(),
        attitude: Attitude::new(pitch_rad, roll_rad, row_sigma.map(f64::to_radians).or(sigma_rad)),
    })
}

/// The true nadir, if stated.
fn true_position(table: &InputTable, row: &InputRow) -> Result<Option<Geodetic>, TrialError> {
    let within = |limit: f64| move |v: f64| v.abs() <= limit;
    let latitude_deg =
        table.number_or_empty(row, "true_latitude_deg", "a number of degrees in [-90, 90], or empty", within(90.0))?;
    let longitude_deg = table.number_or_empty(
        row,
        "true_longitude_deg",
        "a number of degrees in [-360, 360], or empty",
        within(360.0),
    )?;
    match (latitude_deg, longitude_deg) {
        (Some(lat), Some(lon)) => Ok(Some(Geodetic::from_degrees(lat, lon).expect("checked above"))),
        (None, None) => Ok(None),
        (None, Some(_)) => Err(table.bad_cell(row, "true_latitude_deg", "stated or empty together with the longitude")),
        (Some(_), None) => Err(table.bad_cell(row, "true_longitude_deg", "stated or empty together with the latitude")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "image,time_s,true_latitude_deg,true_longitude_deg,true_heading_deg,height_agl_m,heading_deg,pitch_deg,roll_deg\n";
    const CAMERA: &str = "width_px = 8\nheight_px = 6\nfocal_length_px = 10.0\nprincipal_point_px = [4.0, 3.0]\n";

    fn folder(csv: &str, camera: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("flight.csv"), csv).unwrap();
        std::fs::write(folder.path().join("camera.toml"), camera).unwrap();
        std::fs::write(folder.path().join("a.png"), b"not looked into").unwrap();
        folder
    }

    fn complaint(row: &str) -> String {
        let folder = folder(&format!("{HEADER}{row}"), CAMERA);
        RecordedFlight::read(folder.path()).unwrap_err().to_string()
    }

    #[test]
    fn reads_a_flight_with_and_without_truth() {
        let with = folder(&format!("{HEADER}a.png,1.5,47,8,90,500,91,2,-3\n"), CAMERA);
        let frame = &RecordedFlight::read(with.path()).unwrap().frames[0];
        assert_eq!(frame.line, 2);
        assert_eq!(frame.true_position.unwrap(), Geodetic::from_degrees(47.0, 8.0).unwrap());
        assert!(
            (frame.heading_rad.to_degrees() - 91.0).abs() < 1e-12
                && (frame.attitude.roll_rad.unwrap().to_degrees() + 3.0).abs() < 1e-12
        );
        let without = folder(&format!("{HEADER}a.png,1.5,,,,500,91,2,-3\n"), CAMERA);
        assert!(RecordedFlight::read(without.path()).unwrap().frames[0].true_position.is_none());
    }

    #[test]
    fn a_row_overrides_the_camera_file_and_a_caller_both() {
        let sigma_deg = |header: &str, cells: &str, camera: &str| {
            let header = HEADER.replace("pitch_deg,roll_deg", header);
            let folder = folder(&format!("{header}a.png,0,47,8,90,500,91{cells}\n"), &format!("{CAMERA}{camera}"));
            let flight = RecordedFlight::read(folder.path()).unwrap();
            (flight.frames[0].attitude.sigma_rad.to_degrees() * 1e6).round() / 1e6
        };
        let (tilt, both) = ("pitch_deg,roll_deg", "pitch_deg,roll_deg,attitude_sigma_deg");
        assert_eq!(sigma_deg(tilt, ",0,0", ""), 2.0);
        assert_eq!(sigma_deg(tilt, ",0,", ""), 5.0);
        assert_eq!(sigma_deg("nothing", ",", ""), 5.0);
        assert_eq!(sigma_deg(tilt, ",0,0", "attitude_sigma_deg = 0.5\n"), 0.5);
        assert_eq!(sigma_deg(both, ",0,0,3", "attitude_sigma_deg = 0.5\n"), 3.0);
        assert_eq!(sigma_deg(both, ",0,0,", "attitude_sigma_deg = 0.5\n"), 0.5);
        let stated = folder(&format!("{HEADER}a.png,0,47,8,90,500,91,0,0\n"), CAMERA);
        let flight = RecordedFlight::read(stated.path()).unwrap().with_attitude_sigma_rad(0.0);
        assert_eq!(flight.frames[0].attitude, Attitude::exact(0.0, 0.0));
        let absurd =
            folder(&format!("{HEADER}a.png,0,47,8,90,500,91,0,0\n"), &format!("{CAMERA}attitude_sigma_deg = 30\n"));
        assert_eq!(RecordedFlight::read(absurd.path()).unwrap_err().code(), "not_a_camera");
    }

    #[test]
    fn names_file_line_and_column_of_what_is_wrong() {
        let said = complaint("a.png,0,47,8,90,500,91,2,3\na.png,0,47,8,90,NaN,91,2,3\n");
        assert!(said.contains("flight.csv line 3: height_agl_m = \"NaN\""), "{said}");
        assert!(complaint("a.png,0,97,8,90,500,91,2,3\n").contains("line 2: true_latitude_deg = \"97\""));
        assert!(complaint("a.png,0,47,,90,500,91,2,3\n").contains("true_longitude_deg"));
        assert!(complaint("a.png,0,47,8,90,-1,91,2,3\n").contains("a positive number of metres"));
        assert!(complaint("a.png,0,47,8,90,500,91,90,3\n").contains("pitch_deg"));
        assert!(complaint("b.png,0,47,8,90,500,91,2,3\n").contains("line 2: there is no image"));
        assert!(complaint("a.png,0,47,8,90,500,91,2,3\na.png,0,47,8,90,500,91,2,3\n").contains("one row only"));
        assert!(complaint("a.png,0,47\n").contains("line 2"));
        assert!(complaint("").contains("no rows"));
    }

    #[test]
    fn a_flight_with_an_absurd_row_is_read_where_it_is_flown() {
        let rows = "a.png,0,47,8,90,500,91,2,3\nb.png,soon,47,8,90,-5,1e9,NaN,95\n";
        let folder = folder(&format!("{HEADER}{rows}"), CAMERA);
        std::fs::write(folder.path().join("b.png"), b"").unwrap();
        assert!(RecordedFlight::read(folder.path()).is_err());
        let flight = RecordedFlight::read_with_absurd_rows(folder.path()).unwrap();
        let [sound, absurd] = &flight.frames[..] else { panic!("two frames") };
        assert_eq!((sound.time_s, sound.height_agl_m), (0.0, 500.0));
        assert!(absurd.time_s.is_nan() && absurd.height_agl_m == -5.0 && absurd.heading_rad > 1e6);
        assert!(absurd.attitude.pitch_rad.unwrap().is_nan() && absurd.attitude.roll_rad.unwrap() > 1.6);
    }

    #[test]
    fn names_a_missing_column_and_a_bad_camera() {
        let csv = folder("image,time_s\na.png,1\n", CAMERA);
        assert!(RecordedFlight::read(csv.path()).unwrap_err().to_string().contains("no column height_agl_m"));
        let row = format!("{HEADER}a.png,1.5,47,8,90,500,91,2,-3\n");
        let camera = folder(&row, "width_px = 8\n");
        assert_eq!(RecordedFlight::read(camera.path()).unwrap_err().code(), "not_a_camera");
        let zero = folder(&row, &CAMERA.replace("10.0", "-1.0"));
        assert_eq!(RecordedFlight::read(zero.path()).unwrap_err().code(), "not_a_camera");
        assert_eq!(RecordedFlight::read(Path::new("no/such/folder")).unwrap_err().code(), "unreadable");
    }
}
