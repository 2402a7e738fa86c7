//! The C interface answers as the library does, refuses bad arguments, and its header is the committed one.

use overfly_capi::*;
use overfly_core::camera::{Attitude, Height, Intrinsics, View};
use overfly_core::geodesy::Geodetic;
use overfly_core::pixels::Gray;
use overfly_flight::frame::read_frame;
use overfly_flight::locate::candidates::{CandidateParameters, candidates};
use overfly_flight::locate::{Answer, Fix, FixRequest, HeadingPrior, PositionPrior, locate};
use overfly_testkit::drawn::{drawn_store, project};
use std::ffi::{CStr, CString, c_char};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::ptr::{null, null_mut};

const FRAME: &str = "tiles/flight/frames/019.jpg";

fn text(pointer: *const c_char) -> String {
    assert!(!pointer.is_null());
    unsafe { CStr::from_ptr(pointer) }.to_str().unwrap().to_owned()
}

fn store() -> *mut overfly_store {
    let path = CString::new(drawn_store().path().to_str().unwrap()).unwrap();
    let mut store = null_mut();
    assert_eq!(unsafe { overfly_store_open(path.as_ptr(), &mut store) }, overfly_status::OVERFLY_OK);
    store
}

fn decoded() -> *mut overfly_frame {
    let bytes = std::fs::read(project(FRAME)).unwrap();
    let mut frame = null_mut();
    let status = unsafe { overfly_frame_decode(bytes.as_ptr(), bytes.len(), &mut frame) };
    assert_eq!(status, overfly_status::OVERFLY_OK);
    frame
}

/// `tiles/flight/camera.toml`.
fn camera() -> overfly_camera {
    overfly_camera {
        width_px: 320,
        height_px: 240,
        focal_length_px: 400.0,
        principal_point_px: [161.3, 118.9],
        distortion: [-0.06, 0.015, 0.0004, -0.0003, 0.0],
    }
}

fn request(camera: &overfly_camera) -> overfly_fix_request {
    overfly_fix_request {
        latitude_deg: 48.4915,
        longitude_deg: 15.6160,
        sigma_m: 200.0,
        heading_deg: 271.6,
        camera,
        height_m: 500.4,
        pitch_deg: 1.17,
        roll_deg: 0.0,
        attitude_sigma_deg: 0.1,
        ..overfly_fix_request_new()
    }
}

/// The library's own answer to [`request`] for the decoded frame.
fn expected() -> Fix {
    located(&read_frame(&project(FRAME)).unwrap())
}

/// The library's own answer to [`request`].
fn located(frame: &Gray) -> Fix {
    let camera = camera();
    let request = FixRequest {
        layer: "ortho".into(),
        position: PositionPrior::Gaussian {
            centre: Geodetic::from_degrees(48.4915, 15.6160).unwrap(),
            sigma_east_m: 200.0,
            sigma_north_m: 200.0,
            correlation: 0.0,
        },
        heading: Some(HeadingPrior { heading_rad: 271.6f64.to_radians(), sigma_rad: 3f64.to_radians() }),
        view: View::Posed {
            intrinsics: Intrinsics {
                width_px: 320,
                height_px: 240,
                focal_length_px: 400.0,
                principal_point_px: camera.principal_point_px,
                distortion: camera.distortion,
            },
            height: Height::AboveGround(500.4),
            attitude: Attitude::new(Some(1.17f64.to_radians()), Some(0.0), Some(0.1f64.to_radians())),
        },
        scale_sigma_ratio: 0.03,
        time_s: None,
    };
    match locate(drawn_store(), frame, &request, 1).unwrap() {
        Answer::Fix(fix) => fix,
        none => panic!("{none:?}"),
    }
}

fn empty_fix() -> overfly_fix {
    unsafe { std::mem::zeroed() }
}

#[test]
fn a_frame_is_located_as_the_library_locates_it() {
    let (store, frame, camera, expected) = (store(), decoded(), camera(), expected());
    let mut fix = empty_fix();
    let status = unsafe { overfly_locate(store, frame, &request(&camera), &mut fix, null_mut()) };
    assert_eq!(status, overfly_status::OVERFLY_OK);
    assert_eq!(&fix.layer[..6], b"ortho\0".map(|c| c as std::ffi::c_char));
    assert_eq!((fix.map_error_m, fix.map_error_known), (expected.map_error_m, expected.map_error_known));
    assert_eq!(
        (fix.latitude_deg, fix.longitude_deg),
        (expected.position.latitude_deg(), expected.position.longitude_deg())
    );
    let covariance = expected.covariance;
    let [ee, en, nn] = [covariance.ee_m2, covariance.en_m2, covariance.nn_m2];
    assert_eq!([fix.covariance_ee_m2, fix.covariance_en_m2, fix.covariance_nn_m2], [ee, en, nn]);
    let image_centre = expected.image_centre_covariance;
    assert_eq!(fix.image_centre_covariance_ee_m2, image_centre.ee_m2);
    assert_eq!(fix.image_centre_latitude_deg, expected.image_centre.latitude_deg());
    assert_eq!(fix.position_of, overfly_position_of::OVERFLY_NADIR);
    assert!(image_centre.ee_m2 < ee, "the nadir carries the attitude");
    assert_eq!((fix.inliers as usize, fix.heading_deg), (expected.inliers, expected.heading.degrees()));
    unsafe {
        overfly_frame_free(frame);
        overfly_store_free(store);
    }
}

#[test]
fn gray_pixels_with_a_stride_are_the_same_frame() {
    let gray = read_frame(&project(FRAME)).unwrap();
    let (width, height, stride) = (gray.width_px(), gray.height_px(), gray.width_px() + 13);
    let mut pixels = vec![77u8; stride * (height - 1) + width];
    for y in 0..height {
        for x in 0..width {
            pixels[y * stride + x] = gray.at(x, y).round() as u8;
        }
    }
    let (store, camera, mut frame, mut fix) = (store(), camera(), null_mut(), empty_fix());
    unsafe {
        let status = overfly_frame_from_gray(pixels.as_ptr(), width as u32, height as u32, stride, &mut frame);
        assert_eq!(status, overfly_status::OVERFLY_OK);
        assert_eq!(overfly_locate(store, frame, &request(&camera), &mut fix, null_mut()), overfly_status::OVERFLY_OK);
        overfly_frame_free(frame);
        overfly_store_free(store);
    }
    let rounded = gray.values().iter().map(|level| level.round()).collect();
    let expected = located(&Gray::from_values(width, height, rounded).unwrap());
    assert_eq!(
        (fix.latitude_deg, fix.longitude_deg),
        (expected.position.latitude_deg(), expected.position.longitude_deg())
    );
}

#[test]
fn no_fix_is_an_answer_with_a_reason() {
    let (store, frame, camera) = (store(), decoded(), camera());
    let far = overfly_fix_request { latitude_deg: 10.0, ..request(&camera) };
    let mut none: overfly_no_fix = unsafe { std::mem::zeroed() };
    let status = unsafe { overfly_locate(store, frame, &far, &mut empty_fix(), &mut none) };
    assert_eq!(status, overfly_status::OVERFLY_NO_FIX);
    assert_eq!(text(none.reason.as_ptr()), "outside_map");
    assert!(!text(none.detail.as_ptr()).is_empty());
    unsafe {
        overfly_frame_free(frame);
        overfly_store_free(store);
    }
}

#[test]
fn candidates_are_those_of_the_library() {
    let store = store();
    let request = overfly_candidate_request {
        latitude_deg: 48.4915,
        longitude_deg: 15.6160,
        heading_deg: 270.0,
        across_m: 400.0,
        along_m: 300.0,
        inaccuracy_m: 20.0,
        drift_m: 250.0,
        ..overfly_candidate_request_new()
    };
    let parameters = CandidateParameters {
        latitude_deg: Some(48.4915),
        longitude_deg: Some(15.6160),
        heading_deg: Some(270.0),
        across_m: Some(400.0),
        along_m: Some(300.0),
        inaccuracy_m: Some(20.0),
        drift_m: Some(250.0),
        ..Default::default()
    };
    let expected = candidates(drawn_store(), &parameters.query().unwrap()).unwrap();
    let mut found = null_mut();
    unsafe {
        assert_eq!(overfly_candidates_find(store, &request, &mut found), overfly_status::OVERFLY_OK);
        let tiles = std::slice::from_raw_parts((*found).tiles, (*found).length);
        let ours: Vec<_> = tiles.iter().map(|t| (t.zoom, t.column, t.row, t.probability)).collect();
        let theirs: Vec<_> = expected.tiles.iter().map(|t| (u32::from(t.z), t.x, t.y, t.probability)).collect();
        assert!(ours.len() > 3);
        assert_eq!(ours, theirs);
        assert_eq!((*found).containment, expected.containment);
        overfly_candidates_free(found);
        let elsewhere = overfly_candidate_request { latitude_deg: 10.0, ..request };
        assert_eq!(overfly_candidates_find(store, &elsewhere, &mut found), overfly_status::OVERFLY_OK);
        assert!((*found).length == 0 && !(*found).tiles.is_null());
        overfly_candidates_free(found);
        overfly_store_free(store);
    }
}

/// The code word of a call that must fail.
fn refused(status: overfly_status) -> String {
    assert_eq!(status, overfly_status::OVERFLY_FAILED);
    assert!(!text(overfly_last_error_message()).is_empty());
    text(overfly_last_error_code())
}

#[test]
fn null_and_bad_arguments_are_errors() {
    let (store, frame, camera) = (store(), decoded(), camera());
    let (mut no_store, mut no_frame, mut no_tiles) = (store, frame, null_mut());
    let pixels = [0u8; 16];
    unsafe {
        assert_eq!(refused(overfly_store_open(null(), &mut no_store)), "bad_argument");
        assert!(no_store.is_null(), "a failed call sets the out parameter to null");
        assert_eq!(refused(overfly_store_open(c"x".as_ptr(), null_mut())), "bad_argument");
        assert_eq!(refused(overfly_store_open(c"no/such.gpkg".as_ptr(), &mut no_store)), "store_not_found");
        assert_eq!(refused(overfly_store_open(c"\xff".as_ptr(), &mut no_store)), "bad_argument");
        assert_eq!(refused(overfly_frame_decode(null(), 4, &mut no_frame)), "bad_argument");
        assert!(no_frame.is_null());
        assert_eq!(refused(overfly_frame_decode(pixels.as_ptr(), 16, &mut no_frame)), "not_an_image");
        for (pointer, width, height, stride) in [
            (null(), 4, 4, 4),
            (pixels.as_ptr(), 4, 4, 3),
            (pixels.as_ptr(), 0, 4, 4),
            (pixels.as_ptr(), 4, 0, 4),
            (pixels.as_ptr(), u32::MAX, u32::MAX, usize::MAX),
            (pixels.as_ptr(), 4, 4, usize::MAX),
        ] {
            let status = overfly_frame_from_gray(pointer, width, height, stride, &mut no_frame);
            assert_eq!(refused(status), "bad_argument", "{width} {height} {stride}");
        }
        let good = request(&camera);
        let mut fix = empty_fix();
        let none = null_mut();
        assert_eq!(refused(overfly_locate(null(), frame, &good, &mut fix, none)), "bad_argument");
        assert_eq!(refused(overfly_locate(store, null(), &good, &mut fix, none)), "bad_argument");
        assert_eq!(refused(overfly_locate(store, frame, null(), &mut fix, none)), "bad_argument");
        assert_eq!(refused(overfly_locate(store, frame, &good, null_mut(), none)), "bad_argument");
        let bad = [
            overfly_fix_request { sigma_m: f64::NAN, ..good },
            overfly_fix_request { latitude_deg: 91.0, ..good },
            overfly_fix_request { gsd_m_per_px: 1.0, ..good },
            overfly_fix_request { camera: null(), ..good },
        ];
        for request in bad {
            let code = refused(overfly_locate(store, frame, &request, &mut fix, none));
            assert!(code.contains("parameter"), "{code}");
        }
        let all_zero: overfly_fix_request = std::mem::zeroed();
        refused(overfly_locate(store, frame, &all_zero, &mut fix, none));
        let unknown = overfly_fix_request { layer: c"none".as_ptr(), ..good };
        assert_eq!(refused(overfly_locate(store, frame, &unknown, &mut fix, none)), "no_such_layer");
        let nothing = overfly_candidate_request_new();
        assert_eq!(refused(overfly_candidates_find(store, &nothing, &mut no_tiles)), "parameter_missing");
        assert_eq!(refused(overfly_candidates_find(store, null(), &mut no_tiles)), "bad_argument");
        overfly_store_free(null_mut());
        overfly_frame_free(null_mut());
        overfly_candidates_free(null_mut());
        overfly_frame_free(frame);
        overfly_store_free(store);
    }
    assert_eq!(text(overfly_version()), env!("CARGO_PKG_VERSION"));
}

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_committed_header_is_what_cbindgen_makes() {
    let mut builder =
        cbindgen::Builder::new().with_config(cbindgen::Config::from_file(here().join("cbindgen.toml")).unwrap());
    for name in ["error", "store", "frame", "fix", "candidates"] {
        builder = builder.with_src(here().join("src").join(name).with_extension("rs"));
    }
    let mut made = Vec::new();
    builder.generate().unwrap().write(&mut made);
    let made = String::from_utf8(made).unwrap();
    let fresh = Path::new(env!("CARGO_TARGET_TMPDIR")).join("overfly.h");
    std::fs::write(&fresh, &made).unwrap();
    let committed = std::fs::read_to_string(here().join("include/overfly.h")).unwrap_or_default();
    assert!(committed == made, "include/overfly.h is not up to date; copy {} there", fresh.display());
}

/// The folder where cargo put this crate's libraries: beside this test.
fn libraries() -> PathBuf {
    std::env::current_exe().unwrap().parent().unwrap().to_path_buf()
}

#[test]
fn the_example_in_c_prints_the_librarys_fix() {
    let folder = tempfile::tempdir().unwrap();
    let cc = std::env::var_os("CC").unwrap_or_else(|| "cc".into());
    let example = project("examples/c/fix.c");
    assert!(std::fs::read_to_string(&example).unwrap().lines().count() <= 60);
    let fix = expected();
    let expected = format!(
        "fix {:.7} {:.7} heading {:.2}, {} windows agree\n",
        fix.position.latitude_deg(),
        fix.position.longitude_deg(),
        fix.heading.degrees(),
        fix.inliers
    );
    for linked in ["static", "shared"] {
        let program = folder.path().join(linked);
        let mut command = Command::new(&cc);
        command.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-I"]).arg(here().join("include")).arg(&example);
        if linked == "static" {
            command.arg(libraries().join("liboverfly_capi.a")).args(["-lpthread", "-lm", "-ldl"]);
        } else {
            command.arg("-L").arg(libraries()).arg("-loverfly_capi");
            command.arg(format!("-Wl,-rpath,{}", libraries().display()));
        }
        let made = command.arg("-o").arg(&program).output().unwrap();
        assert!(made.status.success(), "{linked}: {}", String::from_utf8_lossy(&made.stderr));
        // Cargo's own search path would come before that of the program, and may hold an older library.
        let run = |frame: PathBuf| {
            let mut command = Command::new(&program);
            command.env_remove("LD_LIBRARY_PATH").arg(drawn_store().path()).arg(frame).output().unwrap()
        };
        let located = run(project(FRAME));
        assert_eq!(String::from_utf8_lossy(&located.stdout), expected, "{linked}");
        assert!(located.status.success());
        let refused = run(project("tiles/flight/camera.toml"));
        assert_eq!(refused.status.code(), Some(1));
        assert!(String::from_utf8_lossy(&refused.stderr).contains("error[not_an_image]"), "{linked}");
    }
}
