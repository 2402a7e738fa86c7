//! Any registration can be drawn, with a fix and without.

use overfly_core::pixels::Colour;
use overfly_flight::frame::read_colour_frame;
use overfly_flight::locate::{Answer, FixRequest, HeadingPrior, PositionPrior, locate_traced};
use overfly_lab::explain::Explanation;
use overfly_lab::trial::RecordedFlight;
use overfly_testkit::drawn::{drawn_store, project};

fn pages(frame: &Colour, position: PositionPrior) -> (Answer, Vec<(&'static str, Vec<u8>)>) {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let stated = &flight.frames[19];
    let request = FixRequest {
        layer: "ortho".into(),
        position,
        heading: Some(HeadingPrior { heading_rad: stated.heading_rad, sigma_rad: 0.05 }),
        view: stated.view(&flight.camera),
        scale_sigma_ratio: 0.03,
        time_s: None,
    };
    let (answer, trace) = locate_traced(drawn_store(), &frame.to_gray(), &request, 2).unwrap();
    let pages = Explanation::new(drawn_store(), frame, &request, &answer, &trace).unwrap().pages();
    (answer, pages)
}

fn square() -> PositionPrior {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    PositionPrior::Square { centre: flight.frames[19].true_position.unwrap(), half_width_m: 300.0 }
}

#[test]
fn a_fix_is_drawn_with_its_surface_windows_and_outline() {
    let frame = read_colour_frame(&project("tiles/flight/frames/019.jpg")).unwrap();
    for position in [square(), PositionPrior::WholeLayer] {
        let (answer, pages) = pages(&frame, position);
        assert!(matches!(answer, Answer::Fix(_)), "{answer:?}");
        let names: Vec<_> = pages.iter().map(|p| p.0).collect();
        for name in ["frame.jpg", "view.jpg", "map-doubled.jpg", "surface.svg", "windows.svg", "footprint.svg"] {
            assert!(names.contains(&name), "{names:?}");
        }
        let html = String::from_utf8(pages.last().unwrap().1.clone()).unwrap();
        assert!(names.last() == Some(&"index.html") && names[..names.len() - 1].iter().all(|n| html.contains(n)));
        assert!(pages.iter().filter(|p| p.0.ends_with("jpg")).all(|p| p.1.starts_with(&[0xff, 0xd8])));
    }
}

#[test]
fn no_fix_is_drawn_where_the_frame_was_thought_to_be() {
    let (answer, pages) = pages(&Colour::black(320, 240), square());
    assert!(matches!(answer, Answer::NoFix(_)), "{answer:?}");
    let names: Vec<_> = pages.iter().map(|p| p.0).collect();
    assert!(names.contains(&"windows.svg") && !names.contains(&"footprint.svg"), "{names:?}");
}
