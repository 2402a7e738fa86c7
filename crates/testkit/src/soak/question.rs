//! Questions with known answers, and the check of an answer.

use super::client::{HttpReply, get, post};
use super::malformed::malformed_requests;
use overfly_core::geodesy::{Geodetic, geodesic_between};
use overfly_core::region::Region;
use overfly_core::tile::TileId;
use overfly_flight::locate::candidates::{CandidateParameters, SearchCost, rank};
use overfly_store::{Footprint, Layer, Reader};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;

/// A kind of question.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum QuestionKind {
    Tile,
    Descriptors,
    Candidates,
    Catalogue,
    Fix,
    FixElsewhere,
    FixWide,
    Motion,
    Malformed,
}

/// The right answer to a question.
#[derive(Debug, Clone)]
pub enum ExpectedAnswer {
    /// Bytes with this BLAKE3 hash.
    Bytes(blake3::Hash),
    /// Anything with status 200.
    Good,
    /// An error, 4xx.
    Refusal,
    /// A fix within this many metres of a place, or no fix.
    FixNear(Geodetic, f64),
    /// No fix.
    NoFix,
    /// Image b's centre on image a, pixels right and down, within one; or no motion.
    Motion([f64; 2]),
}

pub struct SoakQuestion {
    pub kind: QuestionKind,
    /// The requested tile, if any.
    pub tile: Option<TileId>,
    pub request: Vec<u8>,
    pub expected: ExpectedAnswer,
}

/// The check of an answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AnswerVerdict {
    Right,
    /// A right answer that is a fix or a motion.
    Found,
    /// 503 with Retry-After.
    Busy,
    /// The service refuses a request that needs more memory than allowed.
    TooMuch,
    Wrong(String),
}

/// Checks an answer.
pub fn judge_answer(question: &SoakQuestion, reply: &HttpReply) -> AnswerVerdict {
    let wrong = |why: String| {
        let body = String::from_utf8_lossy(&reply.body[..reply.body.len().min(400)]).into_owned();
        AnswerVerdict::Wrong(format!("{:?} {:?}: {why}: {} {body}", question.kind, question.tile, reply.status))
    };
    if reply.status == 503 && reply.retry_after && ["busy", "time_limit"].contains(&reply.code().as_str()) {
        return AnswerVerdict::Busy;
    }
    let refused = ["too_many_tiles", "region_too_large", "search_too_wide", "memory_too_small"];
    if (400..600).contains(&reply.status) && refused.contains(&reply.code().as_str()) {
        return AnswerVerdict::TooMuch;
    }
    if let ExpectedAnswer::Refusal = question.expected {
        return if (400..500).contains(&reply.status) { AnswerVerdict::Right } else { wrong("not refused".into()) };
    }
    if reply.status != 200 {
        return wrong("not answered".into());
    }
    let json = || serde_json::from_slice::<serde_json::Value>(&reply.body).unwrap_or_default();
    match &question.expected {
        ExpectedAnswer::Bytes(hash) if blake3::hash(&reply.body) == *hash => AnswerVerdict::Right,
        ExpectedAnswer::Bytes(_) => wrong("other bytes".into()),
        ExpectedAnswer::Good => AnswerVerdict::Right,
        ExpectedAnswer::Refusal => wrong("not refused".into()),
        ExpectedAnswer::NoFix if json()["status"] == "no_fix" => AnswerVerdict::Right,
        ExpectedAnswer::NoFix => wrong("not \"no fix\"".into()),
        ExpectedAnswer::FixNear(truth, within_m) => {
            let json = json();
            let number = |name: &str| json[name].as_f64();
            match (json["status"].as_str(), number("latitude_deg"), number("longitude_deg")) {
                (Some("no_fix"), ..) => AnswerVerdict::Right,
                (Some("fix"), Some(latitude), Some(longitude)) => {
                    let at = Geodetic::from_degrees(latitude, longitude).expect("an answer's position");
                    let off_m = geodesic_between(at, *truth).distance_m;
                    if off_m <= *within_m { AnswerVerdict::Found } else { wrong(format!("{off_m:.1} m off")) }
                }
                _ => wrong("neither fix nor \"no fix\"".into()),
            }
        }
        ExpectedAnswer::Motion([right, down]) => {
            let json = json();
            let at = |k: usize| json["displacement_px"][k].as_f64();
            match (json["status"].as_str(), at(0), at(1)) {
                (Some("motion"), Some(x), Some(y)) if (x - right).hypot(y - down) < 1.0 => AnswerVerdict::Found,
                (Some("no_motion"), ..) => AnswerVerdict::Right,
                _ => wrong(format!("not the motion ({right}, {down})")),
            }
        }
    }
}

/// All questions, by kind.
pub struct Questions(pub HashMap<QuestionKind, Vec<SoakQuestion>>);

/// Bounds of the ground of `tiles/`, which nothing else in any store resembles: west, south, east, north.
const LANDSCAPE_DEG: [f64; 4] = [15.5951, 48.4803, 15.6335, 48.5020];

/// Numbers of questions.
#[derive(Debug, Clone, Copy)]
pub struct QuestionCounts {
    pub tiles: usize,
    pub candidates: usize,
    pub fixes: usize,
}

impl Questions {
    /// Makes questions about a sound store. The right answers come from the store; those about candidates from
    /// comparing every footprint with the region.
    pub fn new(db: &Path, pool: QuestionCounts, seed: u64) -> Self {
        let reader = Reader::open(db).expect("the sound store opens");
        let layer = &reader.layers()[0];
        let mut dice = StdRng::seed_from_u64(seed);
        let base = reader.footprints(layer, layer.base_zoom).expect("the sound store reads");
        let mut all: HashMap<QuestionKind, Vec<SoakQuestion>> = HashMap::new();
        all.insert(QuestionKind::Tile, tiles(&reader, layer, &base, pool.tiles, &mut dice));
        all.insert(QuestionKind::Descriptors, descriptors(&reader, layer, &base, pool.tiles / 4, &mut dice));
        all.insert(QuestionKind::Candidates, candidates(layer, &base, pool.candidates, &mut dice));
        let paths = [
            "/v1/store",
            "/v1/layers",
            "/v1/coverage",
            "/v1/tiles/ortho/tilejson.json",
            "/healthz",
            "/readyz",
            "/metrics",
        ];
        let plain = |path: &&str| question(QuestionKind::Catalogue, get(path), ExpectedAnswer::Good);
        all.insert(QuestionKind::Catalogue, paths.iter().map(plain).collect());
        let [fixes, elsewhere, wide] = fixes(&reader, layer, &base, pool.fixes, &mut dice);
        all.insert(QuestionKind::Fix, fixes);
        all.insert(QuestionKind::FixElsewhere, elsewhere);
        all.insert(QuestionKind::FixWide, wide);
        all.insert(QuestionKind::Motion, motions(&reader, layer, &base, pool.fixes, &mut dice));
        all.insert(QuestionKind::Malformed, malformed_requests().into_iter().map(malformed).collect());
        Self(all)
    }

    pub fn get(&self, kind: QuestionKind, index: usize) -> &SoakQuestion {
        let of_kind = &self.0[&kind];
        &of_kind[index % of_kind.len()]
    }
}

fn question(kind: QuestionKind, request: Vec<u8>, expected: ExpectedAnswer) -> SoakQuestion {
    SoakQuestion { kind, tile: None, request, expected }
}

fn tiles(reader: &Reader, layer: &Layer, base: &[Footprint], count: usize, dice: &mut StdRng) -> Vec<SoakQuestion> {
    let coarse = reader.footprints(layer, layer.min_zoom).expect("the sound store reads");
    (0..count)
        .map(|i| {
            let from = if i % 5 == 0 { &coarse } else { base };
            let tile = from[dice.random_range(0..from.len())].tile;
            let bytes =
                reader.encoded_tile(layer, tile).expect("the sound store reads").expect("it has the tile").bytes;
            let request = get(&format!("/v1/tiles/{}/{tile}", layer.name));
            SoakQuestion {
                kind: QuestionKind::Tile,
                tile: Some(tile),
                request,
                expected: ExpectedAnswer::Bytes(blake3::hash(&bytes)),
            }
        })
        .collect()
}

fn descriptors(
    reader: &Reader,
    layer: &Layer,
    base: &[Footprint],
    count: usize,
    dice: &mut StdRng,
) -> Vec<SoakQuestion> {
    (0..count.max(1))
        .map(|_| {
            let tile = base[dice.random_range(0..base.len())].tile;
            let bytes = reader.descriptors(layer, tile).expect("the sound store reads").expect("it has the tile");
            let request = get(&format!("/v1/tiles/{}/{tile}/descriptors", layer.name));
            let expected = ExpectedAnswer::Bytes(blake3::hash(&bytes));
            SoakQuestion { kind: QuestionKind::Descriptors, tile: Some(tile), request, expected }
        })
        .collect()
}

/// Regions of every mode and many sizes.
fn candidates(layer: &Layer, base: &[Footprint], count: usize, dice: &mut StdRng) -> Vec<SoakQuestion> {
    (0..count)
        .map(|i| {
            let place = base[dice.random_range(0..base.len())].tile.centre();
            // Mostly as large as in flight, sometimes much larger.
            let size_m = 10f64.powf(dice.random_range(1.3..if i % 10 == 0 { 4.5 } else { 3.2 }));
            let known = CandidateParameters {
                latitude_deg: Some(place.latitude_deg()),
                longitude_deg: Some(place.longitude_deg()),
                heading_deg: Some(dice.random_range(0.0..359.0)),
                across_m: Some(400.0),
                along_m: Some(300.0),
                ..CandidateParameters::default()
            };
            let parameters = match i % 4 {
                0 => CandidateParameters { inaccuracy_m: Some(20.0), drift_m: Some(size_m), ..known },
                1 => CandidateParameters {
                    sigma_east_m: Some(size_m / 3.0),
                    sigma_north_m: Some(size_m / 4.0),
                    correlation: Some(0.4),
                    ..known
                },
                2 => CandidateParameters {
                    mode: Some("parallel".into()),
                    inaccuracy_m: Some(20.0),
                    unit_drift_m: Some(size_m / 20.0),
                    execution_s: Some(2.0),
                    relative_s: Some(0.1),
                    ..known
                },
                _ => CandidateParameters {
                    mode: Some("combined".into()),
                    inaccuracy_m: Some(20.0),
                    speed_mps: Some(size_m.min(3000.0) / 4.0),
                    execution_s: Some(4.0),
                    min_turn_radius_m: Some(300.0),
                    ..known
                },
            };
            let text = query(&parameters);
            let asked = parameters.query().expect("the sound store reads");
            let expected = match Region::new(asked.centre, asked.image, asked.uncertainty) {
                Ok(region) => {
                    let cost = SearchCost::new(layer, layer.base_zoom, asked.centre, asked.image);
                    let answer = rank(&layer.name, base.iter(), &region, None, &cost);
                    ExpectedAnswer::Bytes(blake3::hash(&serde_json::to_vec(&answer).expect("an answer is JSON")))
                }
                Err(_) => ExpectedAnswer::Refusal,
            };
            question(QuestionKind::Candidates, get(&format!("/v1/candidates?{text}")), expected)
        })
        .collect()
}

fn query(p: &CandidateParameters) -> String {
    let mut pairs: Vec<String> = [
        ("latitude_deg", p.latitude_deg),
        ("longitude_deg", p.longitude_deg),
        ("heading_deg", p.heading_deg),
        ("across_m", p.across_m),
        ("along_m", p.along_m),
        ("inaccuracy_m", p.inaccuracy_m),
        ("drift_m", p.drift_m),
        ("sigma_east_m", p.sigma_east_m),
        ("sigma_north_m", p.sigma_north_m),
        ("correlation", p.correlation),
        ("unit_drift_m", p.unit_drift_m),
        ("execution_s", p.execution_s),
        ("relative_s", p.relative_s),
        ("speed_mps", p.speed_mps),
        ("min_turn_radius_m", p.min_turn_radius_m),
    ]
    .into_iter()
    .filter_map(|(name, value)| value.map(|v| format!("{name}={v}")))
    .collect();
    pairs.extend(p.mode.as_ref().map(|m| format!("mode={m}")));
    pairs.join("&")
}

/// The middle of a tile as an aircraft straight above it sees it.
fn frame(tile: &image::DynamicImage, corner: [u32; 2]) -> Vec<u8> {
    let mut png = Cursor::new(Vec::new());
    tile.crop_imm(corner[0], corner[1], 320, 240)
        .to_rgb8()
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("a tile is a picture");
    png.into_inner()
}

/// Whole base tiles of the known landscape.
fn landscape(reader: &Reader, layer: &Layer, base: &[Footprint]) -> Vec<(TileId, image::DynamicImage)> {
    let [west, south, east, north] = LANDSCAPE_DEG;
    let inside = |f: &&Footprint| {
        let b = f.tile.bounds();
        b.west_deg >= west
            && b.east_deg <= east
            && b.south_deg >= south
            && b.north_deg <= north
            && f.valid_fraction == 1.0
    };
    let image = |f: &Footprint| {
        let bytes = reader.encoded_tile(layer, f.tile).expect("the sound store reads").expect("it has the tile").bytes;
        (f.tile, image::load_from_memory(&bytes).expect("a tile is a picture"))
    };
    base.iter().filter(inside).map(image).collect()
}

/// Frames over their ground; frames searched elsewhere, or of nothing; frames with hardly any prior.
fn fixes(
    reader: &Reader,
    layer: &Layer,
    base: &[Footprint],
    count: usize,
    dice: &mut StdRng,
) -> [Vec<SoakQuestion>; 3] {
    let known = landscape(reader, layer, base);
    assert!(!known.is_empty(), "the store shows nothing of the drawn landscape");
    let (mut fixes, mut elsewhere, mut wide) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..count {
        let (tile, image) = &known[dice.random_range(0..known.len())];
        let (truth, gsd) = (tile.centre(), tile.gsd().mean_m_per_px());
        let [north, east] = [dice.random_range(-6e-4..6e-4), dice.random_range(-8e-4..8e-4)];
        let sound = frame(image, [96, 136]);
        let near = serde_json::json!({
            "latitude_deg": truth.latitude_deg() + north, "longitude_deg": truth.longitude_deg() + east,
            "sigma_m": 60.0, "heading_deg": 1.5, "gsd_m_per_px": gsd, "time_s": 12.5,
        });
        let ask = |image: &[u8], request: &serde_json::Value| {
            post("/v1/fixes", &[("image", image), ("request", request.to_string().as_bytes())])
        };
        fixes.push(question(QuestionKind::Fix, ask(&sound, &near), ExpectedAnswer::FixNear(truth, 5.0)));
        let mirrored = image.fliph();
        elsewhere.push(question(
            QuestionKind::FixElsewhere,
            ask(&frame(&mirrored, [96, 136]), &near),
            ExpectedAnswer::NoFix,
        ));
        let far = base[dice.random_range(0..base.len())].tile;
        let mut lost = near.clone();
        lost["latitude_deg"] = far.centre().latitude_deg().into();
        lost["longitude_deg"] = far.centre().longitude_deg().into();
        elsewhere.push(question(QuestionKind::FixElsewhere, ask(&sound, &lost), ExpectedAnswer::FixNear(truth, 5.0)));
        let turned = serde_json::json!({"gsd_m_per_px": gsd, "height_sigma_ratio": 0.02});
        wide.push(question(QuestionKind::FixWide, ask(&sound, &turned), ExpectedAnswer::FixNear(truth, 5.0)));
        let mut vague = near.clone();
        vague.as_object_mut().expect("a question is an object").remove("heading_deg");
        vague["sigma_m"] = 900.0.into();
        wide.push(question(QuestionKind::FixWide, ask(&sound, &vague), ExpectedAnswer::FixNear(truth, 5.0)));
    }
    [fixes, elsewhere, wide]
}

fn motions(reader: &Reader, layer: &Layer, base: &[Footprint], count: usize, dice: &mut StdRng) -> Vec<SoakQuestion> {
    let known = landscape(reader, layer, base);
    (0..count)
        .map(|_| {
            let image = &known[dice.random_range(0..known.len())].1;
            let shift = [dice.random_range(0..80u32), dice.random_range(0..60u32)];
            let (a, b) = (frame(image, [80, 100]), frame(image, [80 + shift[0], 100 + shift[1]]));
            let request = post("/v1/motions", &[("image_a", &a), ("image_b", &b)]);
            question(QuestionKind::Motion, request, ExpectedAnswer::Motion(shift.map(f64::from)))
        })
        .collect()
}

fn malformed(request: Vec<u8>) -> SoakQuestion {
    question(QuestionKind::Malformed, request, ExpectedAnswer::Refusal)
}
