//! The page of a replayed flight: the track over the map and the registrations, mode by mode.

use super::data_url::data_url;
use super::flight_map::{rotation, tenth, track};
use super::html::{Card, Page, cards, figure, number, with_unit};
use super::mosaic::Mosaic;
use super::replay_plots::{chronogram, errors, tiles};
use super::replayed_flight::ReplayedFlight;
use super::stanford_plot::stanford_svg;
use crate::trial::{FlyOutcome, IntegrityScore};
use maud::{Markup, html};
use overfly_flight::navigate::PositionSource;

const WIDTH_PX: usize = 1200;

/// The page. It embeds every image and plot, and loads nothing.
pub fn replay_html(title: &str, mosaic: &Mosaic, modes: &[ReplayedFlight]) -> String {
    let (picture, factor) = mosaic.shrunk(WIDTH_PX);
    let size = (picture.width_px(), picture.height_px());
    let map = FlightMap { mosaic, factor: factor as f64, size, background: data_url(&picture, 78) };
    let introduction = html! {
        "Every position comes from images, compass and altimeter alone, in a closed loop. The truth starts the flight and scores it. The "
        "true track is white and dashed; a position with a fix of its own image is green, one that was propagated is violet, one in doubt is orange. Ellipses "
        "hold 95\u{a0}%."
    };
    let body = html! { @for flown in modes { (section(flown, map.draw(flown.outcomes))) } };
    Page { title, heading: title, introduction, body, script: "" }.into_html()
}

fn section(flown: &ReplayedFlight, map: Markup) -> Markup {
    let score = flown.score;
    let fixes = with_unit(score.fixes, &format!("of {}", score.absolute_count));
    let coverage = score.ellipse95_coverage.map(|c| 100.0 * c);
    let shown = cards([
        Card::new(number(score.position_error_m.map(|e| e.median), 1, "m"), "median error of all positions"),
        Card::new(number(score.position_error_m.map(|e| e.p95), 1, "m"), "error, 95 % below"),
        Card::new(number(score.dead_reckoning_error_m.map(|e| e.max), 1, "m"), "dead reckoning, at most"),
        Card::new(number(coverage, 0, "%"), "truths inside the stated 95 % ellipse"),
        Card::new(fixes, "absolute registrations with a fix"),
        Card::new(html! { (score.wrong) }, "of them false"),
    ]);
    html! {
        section {
            h2 { (score.mode.word()) }
            div class="cards" { (shown) }
            (map)
            (figure(errors(flown), "Error of each position, and three of its own standard deviations (band)."))
            (figure(stanford_svg(&flown.protected, score.integrity.alert_limit_m), &stanford_legend(&score.integrity)))
            (figure(
                tiles(flown),
                "Tiles that each absolute registration searched (bars), and the nominal count of the model (dots).",
            ))
            (figure(
                chronogram(flown),
                "When relative (RR) and absolute (AR) registrations ran; hollow: no fix. Short ones are drawn longer than they are.",
            ))
        }
    }
}

/// What a Stanford plot shows.
fn stanford_legend(score: &IntegrityScore) -> String {
    format!(
        "Error of each position against its protection level at a risk of {:e}: {} of {} exceed theirs (misleading information), {:.0} % of all have one.",
        score.integrity_risk,
        score.misleading,
        score.protected_count,
        100.0 * score.availability.unwrap_or(0.0)
    )
}

/// The imagery under all tracks.
struct FlightMap<'a> {
    mosaic: &'a Mosaic,
    factor: f64,
    size: (usize, usize),
    background: String,
}

impl FlightMap<'_> {
    /// The map of one mode: the true track, the positions and their ellipses.
    fn draw(&self, outcomes: &[FlyOutcome]) -> Markup {
        let (width, height) = self.size;
        let at = |point| self.mosaic.pixel_of(point).map(|p: [f64; 2]| p.map(|v| v / self.factor));
        let positions = outcomes.iter().filter_map(|o| Some((o, at(o.position.position)?)));
        html! {
            svg class="map" viewBox={ "0 0 " (width) " " (height) } role="img" aria-label="map of the flight" {
                image width=(width) height=(height) href=(self.background) {}
                (track(outcomes.iter().filter_map(|o| at(o.truth))))
                @for (outcome, at) in positions { (self.position(outcome, at)) }
            }
        }
    }

    fn position(&self, o: &FlyOutcome, at: [f64; 2]) -> Markup {
        let [east, north] = self.mosaic.pixels_per_m(o.truth);
        let scale = (east * north).sqrt() / self.factor;
        let most = 2.0 * self.size.0 as f64;
        let ellipse = o.position.covariance.ellipse_95();
        let [long, short] = [ellipse.semi_major_m, ellipse.semi_minor_m].map(|a| tenth((a * scale).min(most)));
        let turn = rotation(-ellipse.semi_major_from_east_rad.to_degrees(), at);
        let colour = match o.position.source {
            PositionSource::Absolute => "#169688",
            PositionSource::Propagated => "#785abe",
            PositionSource::Lost => "#c8501e",
        };
        let [x, y] = at.map(tenth);
        html! {
            ellipse cx=(x) cy=(y) rx=(long) ry=(short) transform=(turn) fill=(colour) fill-opacity="0.12" stroke=(colour) {}
            circle cx=(x) cy=(y) r="4" fill=(colour) stroke="#fff" {
                title { (o.image) ": " (format!("{:.1}", o.error.length_m())) " m off" }
            }
        }
    }
}
