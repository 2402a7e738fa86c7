//! Locates one camera frame on a store and prints the fix.
//!
//! ```sh
//! cargo run --release --example locate               # over the tiles of this repository
//! cargo run --release --example locate -- map.gpkg   # over a store of the same ground
//! ```

use overfly_core::camera::{Attitude, CameraFile, Height, View};
use overfly_core::geodesy::Geodetic;
use overfly_flight::frame::read_frame;
use overfly_flight::locate::candidates::default_layer;
use overfly_flight::locate::{Answer, FixRequest, HeadingPrior, PositionPrior, locate};
use overfly_store::Reader;
use overfly_testkit::drawn::{built, project};

fn main() -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let store = match std::env::args().nth(1) {
        Some(path) => Reader::open(path.as_ref())?,
        None => built(folder.path(), &project("tiles/epoch_1")),
    };
    let frame = read_frame(&project("tiles/flight/frames/019.jpg"))?;
    let camera: CameraFile = toml::from_str(&std::fs::read_to_string(project("tiles/flight/camera.toml"))?)?;

    // What the aircraft knows: its position to 200 m, its heading to 3 degrees, its height to 3 %, its attitude.
    let request = FixRequest {
        layer: default_layer(&store)?.name.clone(),
        position: PositionPrior::Gaussian {
            centre: Geodetic::from_degrees(48.4915, 15.6160)?,
            sigma_east_m: 200.0,
            sigma_north_m: 200.0,
            correlation: 0.0,
        },
        heading: Some(HeadingPrior { heading_rad: 271.6f64.to_radians(), sigma_rad: 3f64.to_radians() }),
        view: View::Posed {
            intrinsics: camera.intrinsics(),
            height: Height::AboveGround(500.4),
            attitude: Attitude::new(Some(1.17f64.to_radians()), Some(0.0), Some(0.1f64.to_radians())),
        },
        scale_sigma_ratio: 0.03,
        time_s: None,
    };
    match locate(&store, &frame, &request, 2)? {
        Answer::Fix(fix) => {
            println!(
                "below the camera: {:.7} {:.7} degrees",
                fix.position.latitude_deg(),
                fix.position.longitude_deg()
            );
            println!(
                "covariance:       {:.3?} m^2 (east-east, east-north, north-north)",
                [fix.covariance.ee_m2, fix.covariance.en_m2, fix.covariance.nn_m2]
            );
            println!("heading:          {:.2} degrees", fix.heading.degrees());
            println!("false with probability {:.1e}", fix.false_fix_probability);
        }
        // No fix is an answer, not an error: the aircraft flies on by dead reckoning.
        Answer::NoFix(none) => println!("no fix: {:?}: {}", none.reason, none.detail),
    }
    Ok(())
}
