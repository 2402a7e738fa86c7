//! What the scenes promise: projection, threads, lean, shadow, shores, truth on relief. Tolerances in metres, pixels, cells.

use super::building::{Building, Roof};
use super::cells::Cells;
use super::objects::SceneObject;
use super::pose::{LensTable, SceneCamera, ScenePose, geodetic_at};
use super::sample::{GROUND, Sample, WATER};
use super::*;
use overfly_core::camera::{Attitude, Camera, Height, Intrinsics, View};
use overfly_core::geodesy::{BodyFrame, LocalFrame};

const NOON: Sun = Sun { azimuth_deg: 135.0, elevation_deg: 45.0 };

fn clear() -> Exposure {
    Exposure {
        defocus_px: 0.0,
        motion_px: [0.0; 2],
        vignette: 0.0,
        gain: [1.0; 3],
        gamma: 1.0,
        haze: 0.0,
        noise: 0.0,
        sharpening: 0.0,
    }
}

/// Level grey ground of 200 x 200 m at 50 m, with objects.
fn plain(objects: &[SceneObject], buildings: Vec<Building>, cell_m: f64) -> World {
    let terrain = Terrain::new([200.0; 2], 10.0, |_, _| 50.0);
    let grey = |_: f64, _: f64| Sample { colour: [120.0; 3], top_m: 50.0, kind: GROUND };
    World::new(Cells::paint([200.0; 2], cell_m, grey, objects), terrain, None, buildings, NOON)
}

/// A block of 20 x 20 m and 10 m height in the middle, its level roof red.
fn block() -> Building {
    Building {
        centre: [100.0; 2],
        half_m: [10.0; 2],
        along: [1.0, 0.0],
        base_m: 50.0,
        eave_m: 10.0,
        rise_m: 0.0,
        roof: Roof::Gable,
        roof_colour: [220.0, 40.0, 40.0],
        wall_colour: [60.0, 60.0, 200.0],
        seed: 1,
        fittings_seed: 1,
    }
}

fn is_red([r, g, _]: [f32; 3]) -> bool {
    r > 2.0 * g
}

#[test]
fn a_ground_point_is_seen_where_the_camera_model_says() {
    let mut lens = Intrinsics::centred(400, 300, 380.0);
    lens.distortion = [-0.05, 0.01, 0.0005, -0.0004, 0.0];
    let pose = ScenePose { place: [104.0, 96.0], z_m: 150.0, heading_rad: 0.7, pitch_rad: 0.15, roll_rad: -0.1 };
    let view = View::Posed {
        intrinsics: lens.clone(),
        height: Height::AboveGround(100.0),
        attitude: Attitude::exact(0.15, -0.1),
    };
    let model = Camera::new(&view, 400, 300).unwrap();
    let camera = SceneCamera::new(&pose);
    let world = plain(&[], Vec::new(), 1.0);
    let enu = LocalFrame::at(geodetic_at(pose.place));
    for pixel in [[200.0, 150.0], [40.5, 60.0], [371.0, 222.0]] {
        let ground = world.ground_under_ray(camera.origin(), camera.direction(lens.ray_from_frame(pixel)));
        let offset = enu.enu_from_geodetic(geodetic_at([ground[0], ground[1]]));
        let seen = model.frame_from_body(BodyFrame::from_heading_rad(0.7).body_from_enu(offset)).unwrap();
        // A millimetre on the ground is 0.004 px.
        assert!((seen[0] - pixel[0]).hypot(seen[1] - pixel[1]) < 0.01, "{pixel:?} {seen:?}");
    }
    // The table of rays is bilinear between the corners of a pixel.
    let [exact, table] = [lens.ray_from_frame([371.5, 222.25]), LensTable::new(&lens).ray(371, 222, [0.5, 0.25])];
    assert!((exact[0] - table[0]).hypot(exact[1] - table[1]) * 380.0 < 1e-3);
}

#[test]
fn a_step_ahead_and_up_of_the_nadir_is_projected_as_by_hand() {
    // Heading east, pitch p: a point straight below appears below the centre by f tan p.
    let (p, f) = (8f64.to_radians(), 500.0);
    let pose = ScenePose {
        place: [100.0; 2],
        z_m: 150.0,
        heading_rad: std::f64::consts::FRAC_PI_2,
        pitch_rad: p,
        roll_rad: 0.0,
    };
    let camera = SceneCamera::new(&pose);
    let down = camera.direction([0.0, p.tan()]);
    assert!(down[0].hypot(down[1]) / down[2].abs() < 1e-9, "{down:?}");
    // And the centre looks 100 tan p ahead: to the east, but for the meridian convergence of about half a degree.
    let intrinsics = Intrinsics::centred(100, 100, f);
    let [x, y, z] = camera.ground_under_centre(&plain(&[], Vec::new(), 1.0), &intrinsics);
    let ahead_m = 100.0 * p.tan();
    assert!((x - 100.0 - ahead_m).abs() < 0.02 && (y - 100.0).abs() < 0.15 && (z - 50.0).abs() < 1e-3, "{x} {y} {z}");
    let right = SceneCamera::new(&ScenePose { roll_rad: 0.1, pitch_rad: 0.0, ..pose }).direction([0.0; 2]);
    assert!(right[1] < 0.0, "rolled left with the heading east it looks north: {right:?}");
}

#[test]
fn roofs_lean_away_from_the_sensor_and_walls_show_towards_it() {
    let building = block();
    let world = plain(&[SceneObject::Building(0, building.clone())], vec![building], 0.25);
    let plan = OrthophotoPlan {
        gsd_m_per_px: 0.5,
        lean_deg: 20.0,
        sensor_azimuth_deg: 90.0,
        warp: MapWarp::NONE,
        exposure: clear(),
        seed: 1,
    };
    let pixels = plan.draw(&world, &|_, _| ());
    // Row 80 m lies in the shadow of nothing: the red runs from 90 m to 110 m, moved west by the height times tan 20.
    let row = &pixels[3 * 400 * 200..3 * 400 * 201];
    let red: Vec<f64> = (0..400)
        .filter(|&c| is_red([0, 1, 2].map(|k| f32::from(row[3 * c + k]))))
        .map(|c| (c as f64 + 0.5) * 0.5)
        .collect();
    let moved_m = 10.0 * 20f64.to_radians().tan();
    assert!((red[0] - (90.0 - moved_m)).abs() < 0.6, "{red:?}");
    assert!((red[red.len() - 1] - (110.0 - moved_m)).abs() < 0.6, "{red:?}");
    // East of the roof, towards the sensor, the wall.
    let wall = ((110.0 - 0.5 * moved_m) / 0.5) as usize;
    assert!(row[3 * wall + 2] > row[3 * wall], "{:?}", &row[3 * wall..3 * wall + 3]);
    // A warp of 5 m to the east: the map shows at a place what lies 5 m east of it.
    let warped = OrthophotoPlan { warp: MapWarp { common_m: [5.0, 0.0], ..MapWarp::NONE }, lean_deg: 0.0, ..plan };
    let pixels = warped.draw(&world, &|_, _| ());
    let at = |x_m: f64| [0, 1, 2].map(|k| f32::from(pixels[3 * (200 * 400 + (x_m / 0.5) as usize) + k]));
    assert!(is_red(at(86.0)) && !is_red(at(107.0)));
}

#[test]
fn shadows_fall_away_from_the_sun() {
    let building = block();
    let world = plain(&[SceneObject::Building(0, building.clone())], vec![building], 0.5);
    let light = |x: f64, y: f64| world.cells.colours[world.cells.index((x / 0.5) as i64, (y / 0.5) as i64)][1];
    // The sun stands in the south-east at 45 degrees: 10 m of height shade 10 m to the north-west and no more.
    assert!(light(86.0, 86.0) < 70 && light(114.0, 114.0) > 100);
    assert!(light(80.0, 80.0) > 100, "beyond 7 m north and west it is light again");
}

#[test]
fn water_that_rises_moves_all_shores_by_ten_to_thirty_metres() {
    let date = SceneDate { number: 1, changed_share: 0.5, dryness: 0.3, sun: NOON };
    let size_m = [2400.0; 2];
    let is_water = |rise_m: f64| {
        let world = lakes(3, size_m, &date, rise_m, 0.7);
        world.cells.kinds.iter().map(|kind| *kind == WATER).collect::<Vec<_>>()
    };
    let (low, high) = (is_water(0.0), is_water(0.7));
    assert!(low.iter().zip(&high).all(|(l, h)| *h || !*l), "no cell dries when the water rises");
    let columns = (size_m[0] / LAKES_CELL_M) as usize;
    let count = |wet: &[bool]| wet.iter().filter(|w| **w).count() as f64;
    // Borders between neighbours overestimate a shore's length by 4 / pi on average.
    let borders = |wet: &[bool]| {
        (columns..wet.len()).filter(|&i| wet[i] != wet[i - 1]).count() as f64
            + (columns..wet.len()).filter(|&i| wet[i] != wet[i - columns]).count() as f64
    };
    let shore_m = 0.5 * (borders(&low) + borders(&high)) * LAKES_CELL_M * std::f64::consts::FRAC_PI_4;
    let moved_m = (count(&high) - count(&low)) * LAKES_CELL_M * LAKES_CELL_M / shore_m;
    assert!((10.0..30.0).contains(&moved_m), "{moved_m}");
}

#[test]
fn the_truth_of_the_centre_lies_on_the_slope() {
    // Ground that rises by 0.3 towards the east.
    let terrain = Terrain::new([2000.0; 2], 10.0, |x, _| 0.3 * x);
    let slope = |x: f64, _: f64| Sample { colour: [90.0; 3], top_m: (0.3 * x) as f32, kind: GROUND };
    let world = World::new(Cells::paint([2000.0; 2], 10.0, slope, &[]), terrain, None, Vec::new(), NOON);
    let (tilt, heading) = (0.2f64, std::f64::consts::FRAC_PI_2);
    let pose = ScenePose { place: [800.0, 1000.0], z_m: 1240.0, heading_rad: heading, pitch_rad: tilt, roll_rad: 0.0 };
    let [x, _, z] = SceneCamera::new(&pose).ground_under_centre(&world, &Intrinsics::centred(40, 30, 50.0));
    // 1000 m above the ground: the ray meets it where d tan(90 - tilt) falls by 1000 - 0.3 d. The grid's metre is 0.99963 m.
    let scale = 0.99963;
    let expected_m = 1000.0 * scale * tilt.tan() / (1.0 + 0.3 * scale * tilt.tan());
    assert!((x - 800.0 - expected_m).abs() < 0.05, "{x} {expected_m}");
    assert!((z - 0.3 * x).abs() < 0.01);
}

/// A small flight over a small world of lakes.
fn small_flight() -> FlightPlan {
    FlightPlan {
        track: TrackPlan {
            frames: 5,
            line_frames: 3,
            step_m: 60.0,
            speed_mps: 30.0,
            height_m: [500.0, 600.0],
            tilt_deg: [2.0, 8.0],
            wobble_deg: 0.5,
            rate_deg_per_s: 3.0,
            is_continuous: false,
            margin_m: 300.0,
            seed: 9,
        },
        intrinsics: Intrinsics::centred(80, 60, 90.0),
        exposure: Exposure { noise: 3.0, sharpening: 0.5, defocus_px: 0.6, ..clear() },
        shutter_s: 0.01,
        readout_s: 0.03,
        quality: 85,
        stated_attitude_sigma_deg: None,
        is_lens_stated: true,
        heading_sigma_deg: 1.0,
        height_sigma_ratio: 0.01,
        true_columns: TrueColumns::Centre,
    }
}

#[test]
fn one_thread_and_two_write_the_same_bytes() {
    let date = SceneDate { number: 2, changed_share: 0.5, dryness: 0.3, sun: NOON };
    let files = |threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let world = lakes(5, [1000.0; 2], &date, 0.0, 0.3);
            small_flight().fly(&world, folder.path(), &|_, _| ()).unwrap();
            write_heights(&folder.path().join("dem.tif"), &world.terrain).unwrap();
        });
        let names = ["flight.csv", "camera.toml", "dem.tif", "frames/0000.jpg", "frames/0004.jpg"];
        names.map(|name| std::fs::read(folder.path().join(name)).unwrap())
    };
    let (one, two) = (files(1), files(2));
    assert!(one == two);
}

#[test]
fn a_flight_is_read_as_any_other_and_states_no_tilt() {
    let date = SceneDate { number: 2, changed_share: 0.5, dryness: 0.3, sun: NOON };
    let folder = tempfile::tempdir().unwrap();
    let world = lakes(5, [1000.0; 2], &date, 0.0, 0.3);
    small_flight().fly(&world, folder.path(), &|_, _| ()).unwrap();
    let flight = crate::trial::RecordedFlight::read(folder.path()).unwrap();
    assert_eq!(flight.frames.len(), 5);
    for frame in &flight.frames {
        assert_eq!(frame.attitude.assumed_rad(), [0.0; 2]);
        assert!(
            frame.true_position.is_some() && (450.0..650.0).contains(&frame.height_agl_m),
            "{}",
            frame.height_agl_m
        );
    }
}
