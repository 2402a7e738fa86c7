//! Frames that show little or nothing of the ground end in `no_fix` or in a right fix, never in a panic.

use overfly_core::geodesy::{Geodetic, LocalFrame};
use overfly_core::pixels::Gray;
use overfly_flight::frame::read_frame;
use overfly_flight::locate::{Answer, FixRequest, HeadingPrior, PositionPrior, locate};
use overfly_lab::trial::{RecordedFlight, RecordedFrame};
use overfly_testkit::drawn::{drawn_store, project};

fn flight() -> RecordedFlight {
    RecordedFlight::read(&project("tiles/flight")).unwrap()
}

fn request(flight: &RecordedFlight, frame: &RecordedFrame, heading_known: bool) -> FixRequest {
    FixRequest {
        layer: "ortho".into(),
        position: PositionPrior::Square { centre: frame.true_position.unwrap(), half_width_m: 300.0 },
        heading: heading_known.then_some(HeadingPrior { heading_rad: frame.heading_rad, sigma_rad: 0.05 }),
        view: frame.view(&flight.camera),
        scale_sigma_ratio: 0.03,
        time_s: None,
    }
}

/// Changes a frame by what `shown` makes of each pixel: column, row, value.
fn altered(gray: &Gray, shown: impl Fn(usize, usize, f32) -> f32) -> Gray {
    let (width, height) = (gray.width_px(), gray.height_px());
    let values = (0..width * height).map(|i| shown(i % width, i / width, gray.values()[i])).collect();
    Gray::from_values(width, height, values).unwrap()
}

fn noise(x: usize, y: usize) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    ((h ^ (h >> 13)) & 0xff) as f32
}

/// How far off a fix is, metres; `None` without one.
fn error_m(gray: &Gray, request: &FixRequest, truth: Geodetic) -> Option<f64> {
    match locate(drawn_store(), gray, request, 2).unwrap() {
        Answer::Fix(fix) => Some(LocalFrame::at(truth).enu_from_geodetic(fix.position).length_m()),
        Answer::NoFix(_) => None,
    }
}

#[test]
fn frames_without_ground_are_no_fix() {
    let flight = flight();
    let frame = &flight.frames[7];
    let real = read_frame(&frame.path).unwrap();
    let blind: [(&str, Gray); 5] = [
        ("black", altered(&real, |_, _, _| 0.0)),
        ("white", altered(&real, |_, _, _| 255.0)),
        ("noise", altered(&real, |x, y, _| noise(x, y))),
        ("cloud", altered(&real, |x, y, _| 205.0 + 40.0 * ((x as f32 / 37.0).sin() * (y as f32 / 29.0).cos()))),
        ("ramp", altered(&real, |x, y, _| (x + y) as f32 / 3.0)),
    ];
    for (name, gray) in blind {
        for heading_known in [true, false] {
            let found = error_m(&gray, &request(&flight, frame, heading_known), frame.true_position.unwrap());
            assert_eq!(found, None, "{name}, heading known {heading_known}");
        }
    }
}

#[test]
fn frames_that_show_part_of_the_ground_are_right_or_no_fix() {
    let flight = flight();
    for frame in flight.frames.iter().step_by(7) {
        let real = read_frame(&frame.path).unwrap();
        let (width, height) = (real.width_px(), real.height_px());
        let broken = [
            ("half black", altered(&real, |x, _, v| if x < width / 2 { 0.0 } else { v })),
            ("half white", altered(&real, |_, y, v| if y < height / 2 { 255.0 } else { v })),
            ("half noise", altered(&real, |x, y, v| if x > width / 2 { noise(x, y) } else { v })),
            ("cloud in the middle", {
                let (cx, cy) = (width as f32 / 2.0, height as f32 / 2.0);
                altered(&real, |x, y, v| {
                    let share = (1.4 - (x as f32 - cx).hypot(y as f32 - cy) / 90.0).clamp(0.0, 1.0);
                    v + (230.0 - v) * share
                })
            }),
            ("lines missing", altered(&real, |_, y, v| if y % 9 == 0 { 0.0 } else { v })),
            ("saturated", altered(&real, |_, _, v| if v > 110.0 { 255.0 } else { 0.0 })),
            ("16 x 16", real.shrunk(16, 12)),
            ("not a number", altered(&real, |x, y, v| if (x, y) == (50, 60) { f32::NAN } else { v })),
        ];
        for (name, gray) in broken {
            let found = error_m(&gray, &request(&flight, frame, true), frame.true_position.unwrap());
            assert!(found.is_none_or(|e| e < 8.0), "{} {name}: {found:?} m off", frame.image);
        }
    }
}

#[test]
fn tiny_frames_of_any_kind_are_no_fix() {
    let flight = flight();
    let frame = &flight.frames[3];
    for (width, height) in [(16, 16), (1, 1), (2, 300), (300, 2)] {
        let gray = Gray::from_values(width, height, (0..width * height).map(|i| noise(i, 3)).collect()).unwrap();
        for gsd_m_per_px in [0.01, 1.3, 26.0] {
            let view = overfly_core::camera::View::Nadir { gsd_m_per_px };
            let request = FixRequest { view, ..request(&flight, frame, true) };
            let found = error_m(&gray, &request, frame.true_position.unwrap());
            assert_eq!(found, None, "{width} x {height} at {gsd_m_per_px} m");
        }
    }
}
