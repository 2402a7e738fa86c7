//! Writes `flight.csv` and `camera.toml`: the truth and the sensors' readings.

use crate::sight::{DISTORTION, FOCAL_PX, HEIGHT_PX, PRINCIPAL_PX, SightPose, WIDTH_PX};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;
use std::path::Path;

/// Rows of `flight.csv`.
pub struct Log {
    csv: String,
}

impl Default for Log {
    fn default() -> Self {
        let header = "image,time_s,true_latitude_deg,true_longitude_deg,true_heading_deg,height_agl_m,heading_deg,pitch_deg,roll_deg\n";
        Self { csv: header.into() }
    }
}

impl Log {
    /// Enters a frame: its truth, and a heading and a height with sensor noise of 1 degree and 1 %.
    pub fn enter(&mut self, image: &str, pose: &SightPose, rng: &mut ChaCha8Rng) {
        let normal = |rng: &mut ChaCha8Rng| (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let said_height_m = pose.height_m * (1.0 + 0.01 * normal(rng));
        let said_heading_deg = (pose.heading_rad.to_degrees() + normal(rng)).rem_euclid(360.0);
        writeln!(
            self.csv,
            "{image},{:.2},{:.9},{:.9},{:.4},{said_height_m:.2},{said_heading_deg:.2},{:.3},{:.3}",
            pose.time_s,
            pose.nadir.latitude_deg(),
            pose.nadir.longitude_deg(),
            pose.heading_rad.to_degrees(),
            pose.pitch_rad.to_degrees(),
            pose.roll_rad.to_degrees(),
        )
        .expect("writing to a string does not fail");
    }

    /// Writes both files.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        std::fs::write(folder.join("flight.csv"), &self.csv)?;
        std::fs::write(
            folder.join("camera.toml"),
            // flight.csv holds pitch and roll to the thousandth of a degree, and nothing else is wrong with them.
            format!(
                "# Drawn by examples/generate_tiles: pinhole with the OpenCV distortion model (k1, k2, p1, p2, k3), pixels from the\n\
                 # image's corner. Ground sample distance = height_agl_m / focal_length_px.\n\
                 width_px = {WIDTH_PX}\nheight_px = {HEIGHT_PX}\nfocal_length_px = {FOCAL_PX:.1}\n\
                 principal_point_px = {PRINCIPAL_PX:?}\ndistortion = {DISTORTION:?}\n\
                 attitude_sigma_deg = 0.001\n"
            ),
        )?;
        Ok(())
    }
}
