//! Flies the flight of this repository without GPS: image after image, one position each.
//!
//! ```sh
//! cargo run --release --example navigator
//! ```

use anyhow::Context;
use overfly_core::geodesy::LocalFrame;
use overfly_flight::frame::read_frame;
use overfly_flight::navigate::{FlightImage, NavigateOptions, Navigator, SensorReading};
use overfly_lab::trial::{RecordedFlight, RecordedFrame};
use overfly_testkit::drawn::{built, project};
use std::sync::Arc;

/// A row of flight.csv as the navigator takes it: pixels, time, compass, altimeter, camera, attitude.
fn image(flight: &RecordedFlight, frame: &RecordedFrame) -> anyhow::Result<FlightImage> {
    Ok(FlightImage {
        gray: Arc::new(read_frame(&frame.path)?),
        time_s: frame.time_s,
        reading: SensorReading { heading_rad: frame.heading_rad, height_m: frame.height_agl_m },
        intrinsics: flight.camera.clone(),
        attitude: frame.attitude,
    })
}

fn main() -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let store = built(folder.path(), &project("tiles/epoch_1"));
    let flight = RecordedFlight::read(&project("tiles/flight"))?;
    let options = NavigateOptions::default();

    let (first, rest) = flight.frames.split_first().context("a flight has frames")?;
    let start = first.true_position.context("the flight states where it starts")?;
    let (mut navigator, _) = Navigator::start(&store, &options, start, image(&flight, first)?)?;
    for frame in rest {
        let at = navigator.process_image(image(&flight, frame)?)?;
        let truth = frame.true_position.context("the flight states its truth")?;
        println!(
            "{}  {:.6} {:.6}  {:<10}  {:.1} m off",
            frame.image,
            at.position.latitude_deg(),
            at.position.longitude_deg(),
            at.source.word(),
            LocalFrame::at(truth).enu_from_geodetic(at.position).length_m()
        );
    }
    Ok(())
}
