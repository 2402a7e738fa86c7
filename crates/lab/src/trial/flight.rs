//! `Flight`: a folder of frames with what the aircraft's sensors said and what was true.

use super::table::{Row, Table};
use super::{TrialError, read_camera};
use overfly_core::camera::{Intrinsics, View};
use overfly_core::geodesy::Geodetic;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// A flight, frames in the order of `flight.csv`.
#[derive(Debug, Clone)]
pub struct Flight {
    /// The `flight.csv` that was read.
    pub path: PathBuf,
    /// `camera.toml` beside it.
    pub camera: Intrinsics,
    /// At least one.
    pub frames: Vec<Frame>,
}

/// One frame.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Line of `flight.csv`, the header being 1.
    pub line: u64,
    /// As `flight.csv` names it; unique in the flight.
    pub image: String,
    /// Where the image lies.
    pub path: PathBuf,
    /// Seconds, of the flight's own clock.
    pub time_s: f64,
    /// The true nadir, where stated.
    pub true_position: Option<Geodetic>,
    /// The true heading, radians clockwise from true north, where stated.
    pub true_heading_rad: Option<f64>,
    /// What the altimeter says, metres above ground.
    pub height_agl_m: f64,
    /// What the compass says, radians clockwise from true north.
    pub heading_rad: f64,
    /// Camera off nadir, radians, positive ahead.
    pub pitch_rad: f64,
    /// Camera off nadir, radians, positive left.
    pub roll_rad: f64,
}

const NEEDED: [&str; 6] = ["image", "time_s", "height_agl_m", "heading_deg", "pitch_deg", "roll_deg"];
const ANGLE: &str = "a number of degrees in [-360, 360]";
const TILT: &str = "a number of degrees off nadir in (-90, 90)";

impl Flight {
    /// Reads `flight.csv` and `camera.toml` of a folder, and checks that every image is there (not that it decodes).
    ///
    /// # Errors
    /// Names the file, line and column of the first thing that is wrong.
    pub fn read(folder: &Path) -> Result<Self, TrialError> {
        let path = folder.join("flight.csv");
        let table = Table::read(&path, &NEEDED)?;
        let camera = read_camera(&folder.join("camera.toml"))?;
        let mut names = HashSet::new();
        let mut frames = Vec::with_capacity(table.rows().len());
        for row in table.rows() {
            let frame = read_row(&table, row)?;
            if !names.insert(frame.image.clone()) {
                return Err(table.bad_cell(row, "image", "each image stands in one row only"));
            }
            frames.push(frame);
        }
        Ok(Self { path, camera, frames })
    }
}

impl Frame {
    /// How the camera looked, by the sensors.
    pub fn view(&self, camera: &Intrinsics) -> View {
        View::Posed {
            intrinsics: camera.clone(),
            height_agl_m: self.height_agl_m,
            pitch_rad: self.pitch_rad,
            roll_rad: self.roll_rad,
        }
    }
}

fn read_row(table: &Table, row: &Row) -> Result<Frame, TrialError> {
    let within = |limit: f64| move |v: f64| v.abs() <= limit;
    let latitude_deg =
        table.number_or_empty(row, "true_latitude_deg", "a number of degrees in [-90, 90], or empty", within(90.0))?;
    let longitude_deg = table.number_or_empty(
        row,
        "true_longitude_deg",
        "a number of degrees in [-360, 360], or empty",
        within(360.0),
    )?;
    let true_position = match (latitude_deg, longitude_deg) {
        (Some(lat), Some(lon)) => Some(Geodetic::from_degrees(lat, lon).expect("checked above")),
        (None, None) => None,
        (None, Some(_)) => {
            return Err(table.bad_cell(row, "true_latitude_deg", "stated or empty together with the longitude"));
        }
        (Some(_), None) => {
            return Err(table.bad_cell(row, "true_longitude_deg", "stated or empty together with the latitude"));
        }
    };
    let tilt = |column| table.number(row, column, TILT, |v| v.abs() < 90.0).map(f64::to_radians);
    Ok(Frame {
        line: row.line,
        image: table.text(row, "image").to_owned(),
        path: table.image(row, "image")?,
        time_s: table.number(row, "time_s", "a number of seconds", |_| true)?,
        true_position,
        true_heading_rad: table.number_or_empty(row, "true_heading_deg", ANGLE, within(360.0))?.map(f64::to_radians),
        height_agl_m: table.number(row, "height_agl_m", "a positive number of metres", |v| v > 0.0)?,
        heading_rad: table.number(row, "heading_deg", ANGLE, within(360.0))?.to_radians(),
        pitch_rad: tilt("pitch_deg")?,
        roll_rad: tilt("roll_deg")?,
    })
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
        Flight::read(folder.path()).unwrap_err().to_string()
    }

    #[test]
    fn reads_a_flight_with_and_without_truth() {
        let with = folder(&format!("{HEADER}a.png,1.5,47,8,90,500,91,2,-3\n"), CAMERA);
        let frame = &Flight::read(with.path()).unwrap().frames[0];
        assert_eq!(frame.line, 2);
        assert_eq!(frame.true_position.unwrap(), Geodetic::from_degrees(47.0, 8.0).unwrap());
        assert!(
            (frame.heading_rad.to_degrees() - 91.0).abs() < 1e-12 && (frame.roll_rad.to_degrees() + 3.0).abs() < 1e-12
        );
        let without = folder(&format!("{HEADER}a.png,1.5,,,,500,91,2,-3\n"), CAMERA);
        assert!(Flight::read(without.path()).unwrap().frames[0].true_position.is_none());
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
    fn names_a_missing_column_and_a_bad_camera() {
        let csv = folder("image,time_s\na.png,1\n", CAMERA);
        assert!(Flight::read(csv.path()).unwrap_err().to_string().contains("no column height_agl_m"));
        let row = format!("{HEADER}a.png,1.5,47,8,90,500,91,2,-3\n");
        let camera = folder(&row, "width_px = 8\n");
        assert_eq!(Flight::read(camera.path()).unwrap_err().code(), "not_a_camera");
        let zero = folder(&row, &CAMERA.replace("10.0", "-1.0"));
        assert_eq!(Flight::read(zero.path()).unwrap_err().code(), "not_a_camera");
        assert_eq!(Flight::read(Path::new("no/such/folder")).unwrap_err().code(), "unreadable");
    }
}
