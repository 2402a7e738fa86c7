//! Lists the tiles to search when the last fix was good to 20 m and up to 250 m of drift may have come since.
//!
//! ```sh
//! cargo run --release --example candidates               # over the tiles of this repository
//! cargo run --release --example candidates -- map.gpkg   # over a store of the same ground
//! ```

use overfly_core::geodesy::Geodetic;
use overfly_core::region::{ImageOnGround, Uncertainty};
use overfly_flight::locate::candidates::{CandidateQuery, candidates};
use overfly_store::Reader;
use overfly_testkit::drawn::{built, project};

fn main() -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let store = match std::env::args().nth(1) {
        Some(path) => Reader::open(path.as_ref())?,
        None => built(folder.path(), &project("tiles/epoch_1")),
    };
    let query = CandidateQuery {
        centre: Geodetic::from_degrees(48.4915, 15.6160)?,
        image: ImageOnGround { across_m: 400.0, along_m: 300.0, heading_rad: 270f64.to_radians() },
        uncertainty: Uncertainty::Sequential { inaccuracy_m: 20.0, drift_m: 250.0 },
        layer: None,
        max_tiles: None,
        gsd_m_per_px: None,
    };
    let found = candidates(&store, &query)?;
    for tile in &found.tiles {
        println!("{:<24} probability {:.4}, {} keypoints", tile.id, tile.probability, tile.keypoints);
    }
    println!("{} tiles hold the centre of the image with probability {:.4}", found.tiles.len(), found.containment);
    println!("about {:.3} s to search", found.estimated_s);
    Ok(())
}
