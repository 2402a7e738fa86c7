//! What the attackers send: hostile bodies and images, and a store with a hostile tile.

use crate::drawn::{drawn_store, project};
use crate::inflating::{hostile_layer, png_with_profile, zeros};
use crate::soak::client::{get, post};
use overfly_core::tile::{TileId, gsd_at};
use std::path::{Path, PathBuf};

/// What the images inflate to.
const INFLATED_MB: usize = 680;
/// The layer of the hostile tile.
const HOSTILE: &str = "hostile";

/// The requests that attackers send, and the store that is served.
pub struct AttackMaterial {
    /// The drawn landscape, and a layer of one hostile tile.
    pub store: PathBuf,
    /// An export along a zigzag of 600 positions round the earth, 7 KB.
    pub zigzag: Vec<u8>,
    /// An export whose route is 20 MB of small objects.
    pub objects: Vec<u8>,
    /// As `objects`, just within what the service reads.
    pub objects_within: Vec<u8>,
    /// A fix of a PNG whose colour profile inflates.
    pub profile: Vec<u8>,
    /// The hostile tile.
    pub hostile_tile: Vec<u8>,
    /// A fix over the hostile tile.
    pub hostile_fix: Vec<u8>,
    /// A fix without position and heading, at a wrong height, with hints.
    pub hinted_fix: Vec<u8>,
    /// A fix whose frame shows fourteen times the ground of the layer, under any heading.
    pub coarse_fix: Vec<u8>,
}

impl AttackMaterial {
    /// Makes the material; the store in `folder`.
    pub fn make(folder: &Path) -> Self {
        let store = folder.join("attacked.gpkg");
        std::fs::copy(drawn_store().path(), &store).expect("the rig reads and writes its own files");
        let (tile, zeros) = (TileId::new(17, 71_000, 45_000).expect("a tile"), zeros(INFLATED_MB));
        hostile_layer(&store, HOSTILE, tile, &zeros);
        let frame = std::fs::read(project("tiles/flight/frames/019.jpg")).expect("the rig reads its own files");
        let centre = tile.centre();
        let (latitude_deg, longitude_deg) = (centre.latitude_deg(), centre.longitude_deg());
        let here = serde_json::json!({
            "latitude_deg": latitude_deg, "longitude_deg": longitude_deg, "sigma_m": 20.0, "heading_deg": 0.0,
            "gsd_m_per_px": gsd_at(centre, 17).mean_m_per_px(), "layer": HOSTILE,
        });
        let anywhere = serde_json::json!({"gsd_m_per_px": 4.0, "layer": "ortho", "hints": true, "hints_limit_s": 10});
        let coarse =
            serde_json::json!({"gsd_m_per_px": 36.0, "layer": "ortho", "height_sigma_ratio": 0.3, "hints": true});
        let fix = |image: &[u8], request: &serde_json::Value| {
            post("/v1/fixes", &[("image", image), ("request", request.to_string().as_bytes())])
        };
        let profile = png_with_profile(300, &zeros);
        Self {
            store,
            zigzag: export(&zigzag()),
            objects: export(&objects(20_000_000)),
            objects_within: export(&objects(11_900_000)),
            profile: fix(&profile, &here),
            hostile_tile: get(&format!("/v1/tiles/{HOSTILE}/{}/{}/{}", tile.zoom(), tile.column(), tile.row())),
            hostile_fix: fix(&frame, &here),
            hinted_fix: fix(&frame, &anywhere),
            coarse_fix: fix(&frame, &coarse),
        }
    }
}

/// A line that crosses the earth 600 times.
fn zigzag() -> String {
    let positions: Vec<String> = (0..600).map(|i| format!("[{},{:.2}]", i % 2 * 179, f64::from(i) * 0.01)).collect();
    format!(r#"{{"type":"LineString","coordinates":[{}]}}"#, positions.join(","))
}

/// A list of small objects of about so many bytes.
fn objects(bytes: usize) -> String {
    format!("[{}]", vec![r#"{"":0}"#; bytes / 7].join(","))
}

/// The request for an export along a route.
fn export(route: &str) -> Vec<u8> {
    let body = format!(r#"{{"corridor_m":1000,"route":{route}}}"#);
    let head = format!(
        "POST /v1/exports HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
        body.len()
    );
    [head.as_bytes(), body.as_bytes()].concat()
}
