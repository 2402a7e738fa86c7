//! Terrain: heights in the store, frames laid on their relief, heights above sea, and what a wrong datum must not do.

use overfly_core::camera::Intrinsics;
use overfly_core::geodesy::Geodetic;
use overfly_core::tile::{HeightGrid, WorldPixel};
use overfly_lab::scene::{
    Exposure, FlightPlan, MapWarp, OrthophotoPlan, SceneDate, Sun, TrackPlan, TrueColumns, World, mountains,
    write_heights, write_map,
};
use overfly_store::{Reader, verify};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

const SEED: u64 = 21;
const SIZE_M: f64 = 6500.0;
const FRAMES: usize = 8;
const MAP_ERROR_M: f64 = 2.0;

/// A mountain world's map, its terrain and a flight over it: the files, and the folder that keeps them.
struct Drawn {
    folder: tempfile::TempDir,
}

fn world(number: u32, azimuth_deg: f64) -> World {
    let date = SceneDate { number, changed_share: 0.3, dryness: 0.3, sun: Sun { azimuth_deg, elevation_deg: 48.0 } };
    mountains(SEED, [SIZE_M; 2], &date)
}

fn drawn() -> &'static Drawn {
    static DRAWN: OnceLock<Drawn> = OnceLock::new();
    DRAWN.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let on_map_day = world(1, 150.0);
        let map = OrthophotoPlan {
            gsd_m_per_px: 5.0,
            lean_deg: 5.0,
            sensor_azimuth_deg: 100.0,
            warp: MapWarp { common_m: [1.0, -1.5], local_m: 1.0, wavelength_m: 700.0, seed: 3 },
            exposure: Exposure::SURVEY,
            seed: SEED,
        };
        let pixels = map.draw(&on_map_day, &|_, _| ());
        write_map(&folder.path().join("map/map.jpg"), &pixels, map.size_px(&on_map_day), 5.0, 92).unwrap();
        write_heights(&folder.path().join("dem/dem.tif"), &on_map_day.terrain.surveyed(30.0, 3.0, 5)).unwrap();
        let flight = FlightPlan {
            track: TrackPlan {
                frames: FRAMES,
                line_frames: 4,
                step_m: 500.0,
                speed_mps: 60.0,
                height_m: [2400.0, 2600.0],
                tilt_deg: [12.0, 20.0],
                wobble_deg: 0.6,
                rate_deg_per_s: 1.0,
                is_continuous: false,
                margin_m: 2100.0,
                seed: SEED,
            },
            intrinsics: Intrinsics::centred(320, 240, 520.0),
            exposure: Exposure::SURVEY,
            shutter_s: 0.004,
            readout_s: 0.0,
            quality: 90,
            stated_attitude_sigma_deg: Some(0.2),
            is_lens_stated: true,
            heading_sigma_deg: 1.0,
            height_sigma_ratio: 0.003,
            true_columns: TrueColumns::Nadir,
        };
        flight.fly(&world(2, 200.0), &folder.path().join("flight"), &|_, _| ()).unwrap();
        let here = folder.path();
        summary(here, &format!("build --db flat.gpkg map --horizontal-error-m {MAP_ERROR_M} --date 2020-06-01"));
        std::fs::copy(here.join("flat.gpkg"), here.join("hills.gpkg")).unwrap();
        summary(here, "build --db hills.gpkg --terrain dem --terrain-error-m 3");
        Drawn { folder }
    })
}

impl Drawn {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn folder(&self) -> &Path {
        self.folder.path()
    }
}

fn overfly(folder: &Path, words: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
    command.current_dir(folder).args(words.split(' ')).args(["--quiet", "--json"]).output().unwrap()
}

/// The summary of a command that succeeds.
fn summary(folder: &Path, words: &str) -> Value {
    let run = overfly(folder, words);
    assert!(run.status.success(), "{words}: {}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_str(String::from_utf8(run.stdout).unwrap().lines().last().unwrap()).unwrap()
}

/// The code and the text of the error of a command that fails.
fn refusal(folder: &Path, words: &str) -> (String, String) {
    let run = overfly(folder, words);
    assert!(!run.status.success(), "{words} is refused");
    let text = String::from_utf8(run.stderr).unwrap();
    let code = text.split(['[', ']']).nth(1).unwrap_or_default().to_owned();
    (code, text)
}

/// A copy of the terrain model with one of its GeoTIFF keys replaced.
fn altered_dem(folder: &Path, key: [u16; 4]) {
    let old: Vec<u8> = [4096u16, 0, 1, 3855].iter().flat_map(|v| v.to_le_bytes()).collect();
    let mut bytes = std::fs::read(drawn().path("dem/dem.tif")).unwrap();
    let at = bytes.windows(8).position(|window| window == old).unwrap();
    bytes[at..at + 8].copy_from_slice(&key.map(u16::to_le_bytes).concat());
    std::fs::write(folder.join("dem.tif"), bytes).unwrap();
}

/// A copy of the terrain model with GDAL's metadata: the directory is written once more, behind the pixels, with tag 42112.
fn dem_with_metadata(folder: &Path, items: &[(&str, &str)]) {
    let items = items.iter().map(|(name, text)| format!("<Item name=\"{name}\" sample=\"0\">{text}</Item>"));
    let text = format!("<GDALMetadata>{}</GDALMetadata>\0", items.collect::<String>());
    let mut bytes = std::fs::read(drawn().path("dem/dem.tif")).unwrap();
    let entries = u16::from_le_bytes(bytes[8..10].try_into().unwrap());
    let directory = bytes[10..10 + 12 * usize::from(entries)].to_vec();
    let text_at = bytes.len() as u32;
    bytes.extend(text.as_bytes());
    bytes.resize(bytes.len().next_multiple_of(2), 0);
    let directory_at = bytes.len() as u32;
    bytes.extend((entries + 1).to_le_bytes());
    bytes.extend(directory);
    bytes.extend([42112u16, 2].map(u16::to_le_bytes).concat());
    bytes.extend([text.len() as u32, text_at, 0].map(u32::to_le_bytes).concat());
    bytes[4..8].copy_from_slice(&directory_at.to_le_bytes());
    std::fs::write(folder.join("dem.tif"), bytes).unwrap();
}

#[test]
fn heights_in_steps_are_metres_and_feet_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let build = "build --db new.gpkg --terrain dem.tif";
    for (item, told) in [
        (("UNITTYPE", "ft"), "another unit than the metre"),
        (("SCALE", "0,1"), "is no number"),
        (("SCALE", "-1"), "upside down"),
        (("OFFSET", "nan"), "is no number"),
    ] {
        dem_with_metadata(here, &[item]);
        let (_, said) = refusal(here, build);
        assert!(said.contains(told) && said.contains("dem.tif"), "{said}");
    }
    dem_with_metadata(here, &[("SCALE", "1.5"), ("OFFSET", "-200"), ("UNITTYPE", "Metre")]);
    summary(here, build);
    let [plain, scaled] = [drawn().path("hills.gpkg"), here.join("new.gpkg")].map(|db| {
        let store = Reader::open(&db).unwrap();
        let (layer, _) = store.terrain().unwrap();
        let middle = WorldPixel::from_geodetic(layer.bounds_deg.middle().unwrap(), layer.base_zoom).unwrap();
        store
            .heights(layer, layer.base_zoom, [middle.x_px as i64 - 90, middle.y_px as i64 - 90], [180, 180])
            .unwrap()
            .heights_m()
            .to_vec()
    });
    // Heights are rounded to 0.2 m before and after they are resampled.
    let known = plain.iter().zip(&scaled).filter(|(plain_m, _)| plain_m.is_finite());
    assert!(known.clone().count() > 10_000);
    for (plain_m, scaled_m) in known {
        assert!((1.5 * plain_m - 200.0 - scaled_m).abs() <= 0.5, "{plain_m} {scaled_m}");
    }
}

#[test]
fn frames_on_slopes_are_located_where_a_plane_would_refuse_them() {
    let drawn = drawn();
    let over = "--flight flight --prior-error-m 300 --right-m 40 --height-sigma-ratio 0.01";
    let [flat, hills] =
        ["flat", "hills"].map(|db| summary(drawn.folder(), &format!("evaluate fixes --db {db}.gpkg {over}")));
    let right = |score: &Value| score["right"].as_u64().unwrap();
    assert_eq!((flat["false"].as_u64(), hills["false"].as_u64()), (Some(0), Some(0)));
    assert_eq!(right(&hills), FRAMES as u64, "{hills}");
    assert!(right(&flat) < right(&hills), "{flat}");
    assert!(hills["error_m"]["median"].as_f64() < Some(12.0), "{hills}");
    assert!(hills["ellipse95_coverage"].as_f64() >= Some(0.85), "{hills}");
}

#[test]
fn stored_heights_are_those_of_the_file() {
    let store = Reader::open(&drawn().path("hills.gpkg")).unwrap();
    let (layer, terrain) = store.terrain().unwrap();
    assert_eq!((terrain.vertical_datum.word(), terrain.vertical_error_m), ("egm2008", Some(3.0)));
    assert_eq!(store.imagery_layers().map(|layer| layer.name.as_str()).collect::<Vec<_>>(), ["ortho"]);
    let surveyed = world(1, 150.0).terrain.surveyed(30.0, 3.0, 5);
    let mut compared = 0;
    for line in std::fs::read_to_string(drawn().path("flight/flight.csv")).unwrap().lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
        // The ground under the image's centre, and its height by the renderer, which has no error.
        let (centre, bare_m) = (Geodetic::from_degrees(cells[11], cells[12]).unwrap(), cells[14]);
        let at = WorldPixel::from_geodetic(centre, layer.base_zoom).unwrap();
        let corner = [at.x_px as i64 - 3, at.y_px as i64 - 3];
        let found = store.heights(layer, layer.base_zoom, corner, [8, 8]).unwrap().at(at, layer.base_zoom).unwrap();
        assert!((found - bare_m).abs() < 14.0, "{found} {bare_m}");
        compared += 1;
    }
    assert_eq!(compared, FRAMES);
    let heights = surveyed.heights_m.iter().map(|h| f64::from(*h));
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), h| (low.min(h), high.max(h)));
    let middle = Geodetic::from_degrees(
        layer.bounds_deg.middle().unwrap().latitude_deg(),
        layer.bounds_deg.middle().unwrap().longitude_deg(),
    );
    let middle = WorldPixel::from_geodetic(middle.unwrap(), layer.base_zoom).unwrap();
    let all =
        store.heights(layer, layer.base_zoom, [middle.x_px as i64 - 90, middle.y_px as i64 - 90], [180, 180]).unwrap();
    let known = all.heights_m().iter().filter(|h| h.is_finite()).map(|h| f64::from(*h));
    assert!(known.clone().count() > 10_000 && known.clone().all(|h| h > low - 5.0 && h < high + 5.0));
}

#[test]
fn a_fine_terrain_is_kept_at_5_m_and_read_no_finer_than_asked() {
    let folder = tempfile::tempdir().unwrap();
    write_heights(&folder.path().join("dem.tif"), &world(1, 150.0).terrain.surveyed(2.0, 1.0, 5)).unwrap();
    summary(folder.path(), "build --db new.gpkg --terrain dem.tif");
    let store = Reader::open(&folder.path().join("new.gpkg")).unwrap();
    let (layer, _) = store.terrain().unwrap();
    assert_eq!(layer.base_zoom, 14);
    let middle = layer.bounds_deg.middle().unwrap();
    let window = |zoom: u8, size: usize| {
        let at = WorldPixel::from_geodetic(middle, zoom).unwrap();
        let corner = [at.x_px, at.y_px].map(|px| px as i64 - size as i64 / 2);
        store.heights(layer, zoom, corner, [size; 2]).unwrap()
    };
    let (fine, coarse, too_coarse, finer) = (window(14, 160), window(11, 20), window(3, 2), window(15, 9));
    let at = WorldPixel::from_geodetic(middle, 14).unwrap();
    assert!((fine.at(at, 14).unwrap() - coarse.at(at, 14).unwrap()).abs() < 8.0);
    let unknown = |heights: &HeightGrid| heights.heights_m().iter().all(|height| height.is_nan());
    assert!(coarse.heights_m().iter().all(|height| height.is_finite()) && unknown(&too_coarse) && unknown(&finer));
}

#[test]
fn a_height_above_sea_is_believed_with_terrain_and_refused_without() {
    let drawn = drawn();
    let text = std::fs::read_to_string(drawn.path("flight/flight.csv")).unwrap();
    let cells: Vec<&str> = text.lines().nth(1).unwrap().split(',').collect();
    let [image, heading, pitch, roll] = [cells[0], cells[6], cells[7], cells[8]];
    let [latitude, longitude, height] = [cells[2], cells[3], cells[19]].map(|cell| cell.parse::<f64>().unwrap());
    let fix = |db: &str, height: String| {
        format!(
            "fix --db {db}.gpkg --image flight/{image} --latitude-deg {latitude} --longitude-deg {longitude} --sigma-m 100 \
             --heading-deg {heading} --camera flight/camera.toml --pitch-deg {pitch} --roll-deg {roll} {height}"
        )
    };
    let found = summary(drawn.folder(), &fix("hills", format!("--height-msl-m {height}")));
    assert_eq!(found["status"].as_str(), Some("fix"));
    // The geoid lies some 45 m above the ellipsoid there: 2 % of the height, which windows measure.
    let ellipsoidal = summary(drawn.folder(), &fix("hills", format!("--height-ellipsoidal-m {}", height + 45.0)));
    assert_eq!(ellipsoidal["status"].as_str(), Some("fix"));
    let (code, said) = refusal(drawn.folder(), &fix("flat", format!("--height-msl-m {height}")));
    assert_eq!(code, "no_terrain", "{said}");
    let run = overfly(drawn.folder(), &fix("hills", format!("--height-msl-m {}", height + 1500.0)));
    assert_eq!(run.status.code(), Some(3), "an altimeter that is 1500 m off gives no fix");
    let (code, said) = refusal(drawn.folder(), &fix("hills", "--height-msl-m 10".into()));
    assert_eq!(code, "below_ground", "{said}");
    let (_, said) = refusal(drawn.folder(), &fix("hills", "--height-msl-m 9 --height-m 3".into()));
    assert!(said.contains("cannot be used with"), "{said}");
}

#[test]
fn a_datum_is_never_guessed() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let build = "build --db new.gpkg --terrain dem.tif";
    altered_dem(here, [4096, 0, 1, 0]);
    let (code, said) = refusal(here, build);
    assert!(code == "no_vertical_datum" && said.contains("--terrain-datum") && said.contains("dem.tif"), "{said}");
    altered_dem(here, [4096, 0, 1, 5703]);
    assert!(refusal(here, build).1.contains("EPSG:5703"));
    let (code, said) = refusal(here, &format!("{build} --terrain-datum egm96"));
    assert!(code == "other_vertical_datum" && said.contains("EPSG:5703"), "{said}");
    altered_dem(here, [4096, 0, 1, 5773]);
    let (code, said) = refusal(here, &format!("{build} --terrain-datum egm2008"));
    assert!(code == "other_vertical_datum" && said.contains("above egm96"), "{said}");
    for unit in [9002, 32_767] {
        altered_dem(here, [4099, 0, 1, unit]);
        let (_, said) = refusal(here, &format!("{build} --terrain-datum egm96"));
        assert!(said.contains("another unit than the metre"), "{said}");
    }
    assert!(!here.join("new.gpkg").exists(), "nothing was written");
    altered_dem(here, [4096, 0, 1, 0]);
    let built = summary(here, &format!("{build} --terrain-datum ellipsoid"));
    assert_eq!(built["layer"].as_str(), Some("terrain"));
    let again = summary(here, &format!("{build} --terrain-datum ellipsoid"));
    assert_eq!((again["computed_tiles"].as_u64(), &again["digest"]), (Some(0), &built["digest"]));
    let (code, said) = refusal(here, &format!("{build} --terrain-datum egm96"));
    assert!(code == "other_vertical_datum" && said.contains("--replace-terrain"), "{said}");
    let other = summary(here, &format!("{build} --terrain-datum egm96 --replace-terrain"));
    assert_ne!(other["digest"], built["digest"], "the digest binds the datum");
}

#[test]
fn imagery_is_no_terrain_and_terrain_no_imagery() {
    let drawn = drawn();
    let (_, said) = refusal(drawn.folder(), "build --db new.gpkg --terrain map --terrain-datum egm96");
    assert!(said.contains("map.jpg"), "{said}");
    let (code, said) = refusal(drawn.folder(), "build --db hills.gpkg map --layer terrain --horizontal-error-m 2");
    assert!(code == "no_such_layer" && said.contains("heights"), "{said}");
    let (code, said) =
        refusal(drawn.folder(), "fix --db hills.gpkg --image flight/frames/0000.jpg --gsd-m-per-px 5 --layer terrain");
    assert!(code == "no_such_layer" && said.contains("heights"), "{said}");
}

#[test]
fn an_export_carries_the_terrain_and_gives_the_same_fixes() {
    let drawn = drawn();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("flight.gpkg");
    let text = std::fs::read_to_string(drawn.path("flight/flight.csv")).unwrap();
    let places = text.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
    let line: Vec<[f64; 2]> = places.map(|cells| [cells[3], cells[2]].map(|cell| cell.parse().unwrap())).collect();
    let route = folder.path().join("route.geojson");
    std::fs::write(&route, serde_json::json!({"type": "LineString", "coordinates": line}).to_string()).unwrap();
    summary(
        drawn.folder(),
        &format!("export --db hills.gpkg --route {} --corridor-m 1500 --out {}", route.display(), out.display()),
    );
    let found = verify(&out, &|_, _| ()).unwrap();
    assert!(found.ok, "{:?}", found.problems);
    let [whole, part] = [drawn.path("hills.gpkg"), out.clone()].map(|path| Reader::open(&path).unwrap());
    let (stated, exported) = (whole.terrain().unwrap().1, part.terrain().unwrap());
    assert_eq!((stated, exported.0.tiles > 0), (exported.1, true));
    let over = "--flight flight --prior-error-m 200 --right-m 40 --height-sigma-ratio 0.01";
    let score = |db: &Path| summary(drawn.folder(), &format!("evaluate fixes --db {} {over}", db.display()));
    let (a, b) = (score(&drawn.path("hills.gpkg")), score(&out));
    assert_eq!((&a["right"], &a["error_m"]), (&b["right"], &b["error_m"]));
}

#[test]
fn merged_renamed_and_removed_terrain_keeps_its_heights() {
    let drawn = drawn();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let [flat, hills] = ["flat.gpkg", "hills.gpkg"].map(|name| drawn.path(name));
    summary(here, &format!("merge --out both.gpkg {} {}", flat.display(), hills.display()));
    let heights = |path: &Path| {
        let store = Reader::open(path).unwrap();
        let (layer, terrain) = store.terrain().map(|(layer, terrain)| (layer.clone(), *terrain)).unwrap();
        let middle = layer.bounds_deg.middle().unwrap();
        let at = WorldPixel::from_geodetic(middle, layer.base_zoom).unwrap();
        let window =
            store.heights(&layer, layer.base_zoom, [at.x_px as i64 - 20, at.y_px as i64 - 20], [40, 40]).unwrap();
        (window.heights_m().to_vec(), terrain)
    };
    let both = here.join("both.gpkg");
    let same = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()));
    assert!(same(&heights(&hills).0, &heights(&both).0) && heights(&hills).1 == heights(&both).1);
    summary(here, "layer rename --db both.gpkg terrain hills");
    assert!(same(&heights(&hills).0, &heights(&both).0));
    assert!(verify(&both, &|_, _| ()).unwrap().ok);
    summary(here, "layer remove --db both.gpkg hills --yes");
    assert!(Reader::open(&both).unwrap().terrain().is_none());
    let found = verify(&both, &|_, _| ()).unwrap();
    assert!(found.ok, "{:?}", found.problems);
}
