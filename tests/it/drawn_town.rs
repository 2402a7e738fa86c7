//! Frames of a tilted camera over a town whose map leans another way, on another day: the soft vote locates them, and never falsely.

use overfly_core::camera::Intrinsics;
use overfly_lab::scene::{
    Exposure, FlightPlan, MapWarp, OrthophotoPlan, SceneDate, Sun, TrackPlan, TrueColumns, town, write_map,
};
use std::path::Path;
use std::process::Command;

const SEED: u64 = 12;
const SIZE_M: f64 = 560.0;
const FRAMES: usize = 15;

fn date(number: u32, dryness: f32, azimuth_deg: f64) -> SceneDate {
    SceneDate { number, changed_share: 0.5, dryness, sun: Sun { azimuth_deg, elevation_deg: 37.0 } }
}

/// A map with an error of 3 m that leans by 20 degrees.
fn draw_map(folder: &Path) {
    let world = town(SEED, [SIZE_M; 2], &date(1, 0.15, 142.0));
    let plan = OrthophotoPlan {
        gsd_m_per_px: 0.3,
        lean_deg: 20.0,
        sensor_azimuth_deg: 80.0,
        warp: MapWarp { common_m: [2.0, -2.2], local_m: 1.0, wavelength_m: 130.0, seed: 3 },
        exposure: Exposure::SURVEY,
        seed: SEED,
    };
    let pixels = plan.draw(&world, &|_, _| ());
    write_map(&folder.join("map/map.jpg"), &pixels, plan.size_px(&world), plan.gsd_m_per_px, 92).unwrap();
}

/// Frames from 100 to 120 m, tilted by 3 to 12 degrees that `flight.csv` does not state.
fn draw_flight(folder: &Path) {
    let world = town(SEED, [SIZE_M; 2], &date(2, 0.6, 236.0));
    let plan = FlightPlan {
        track: TrackPlan {
            frames: FRAMES,
            line_frames: 3,
            step_m: 30.0,
            speed_mps: 10.0,
            height_m: [100.0, 120.0],
            tilt_deg: [3.0, 12.0],
            wobble_deg: 0.8,
            rate_deg_per_s: 5.0,
            is_continuous: false,
            margin_m: 180.0,
            seed: SEED,
        },
        intrinsics: Intrinsics::centred(800, 600, 672.0),
        exposure: Exposure::DRONE,
        shutter_s: 0.008,
        readout_s: 0.03,
        quality: 88,
        stated_attitude_sigma_deg: None,
        is_lens_stated: false,
        heading_sigma_deg: 2.0,
        height_sigma_ratio: 0.02,
        true_columns: TrueColumns::Centre,
    };
    plan.fly(&world, &folder.join("flight"), &|_, _| ()).unwrap();
}

/// The summary of a command with `--json`.
fn summary(folder: &Path, words: &str) -> serde_json::Value {
    let run = Command::new(env!("CARGO_BIN_EXE_overfly"))
        .current_dir(folder)
        .args(words.split(' '))
        .args(["--quiet", "--json"])
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let text = String::from_utf8(run.stdout).unwrap();
    serde_json::from_str(text.lines().last().unwrap()).unwrap()
}

#[test]
fn frames_over_a_town_that_leans_are_located_and_mirrored_ones_are_not() {
    let folder = tempfile::tempdir().unwrap();
    draw_map(folder.path());
    draw_flight(folder.path());
    summary(folder.path(), "build --db town.gpkg map --horizontal-error-m 3 --date 2020-06-01");
    let over = "--db town.gpkg --flight flight --attitude-sigma-deg 8 --prior-error-m 60 --right-m 15";
    let found = summary(folder.path(), &format!("evaluate fixes {over} --truth centre"));
    assert_eq!((found["frames"].as_u64(), found["false"].as_u64()), (Some(FRAMES as u64), Some(0)), "{found}");
    // The hard vote alone locates three.
    assert!(found["right"].as_u64() >= Some(7), "{found}");
    let trials = "--trials 24 --kinds mirrored,turned --regions 1 --unknown-heading-share 0";
    let negatives = summary(folder.path(), &format!("evaluate negatives {over} {trials}"));
    assert_eq!(negatives["accepted"].as_u64(), Some(0), "{negatives}");
}
