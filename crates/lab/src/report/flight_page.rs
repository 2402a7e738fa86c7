//! The page of located frames: figures, map, plots, table.

use super::data_url::data_url;
use super::flight_map::map;
use super::flight_plots::{elapsed_in_time, error_in_time, error_plane};
use super::flight_report::{FlightReport, fix_of};
use super::gallery::gallery;
use super::html::{Card, Page, cards, figure, number, with_unit};
use crate::trial::{FixOutcome, RecordedFrame};
use maud::{Markup, html};
use overfly_core::geodesy::{CHI_SQUARE_95, Heading};
use overfly_flight::locate::Answer;

const SCRIPT: &str = include_str!("report.js");
const WIDTH_PX: usize = 1500;
const COLUMNS: [&str; 10] = [
    "frame",
    "answer",
    "error, m",
    "95\u{a0}% ellipse, m",
    "holds the truth",
    "heading error, deg",
    "score",
    "windows",
    "tiles",
    "ms",
];

impl FlightReport<'_> {
    /// The page. It embeds every image and plot, and loads nothing.
    pub fn to_html(&self) -> String {
        let body = html! {
            section class="cards" { (score_cards(self)) }
            (map_section(self))
            (gallery_section(self))
            (error_section(self))
            section {
                h2 { "Frames" }
                div class="scroll" {
                    table {
                        thead { tr { @for name in COLUMNS { th { (name) } } } }
                        tbody { (rows(self)) }
                    }
                }
            }
            section { h2 { "Store and machine" } dl { (facts(self)) } }
        };
        let introduction = html! { (self.introduction) };
        Page { title: self.title, heading: self.title, introduction, body, script: SCRIPT }.into_html()
    }
}

fn map_section(report: &FlightReport) -> Markup {
    let (picture, factor) = report.mosaic.shrunk(WIDTH_PX);
    let size = (picture.width_px(), picture.height_px());
    let (map, enlargement) = map(report, factor as f64, size, &data_url(&picture, 78));
    html! {
        section {
            h2 { "Map" }
            p class="legend" {
                span class="key track" {} "true track "
                span class="key right" {} "fix, right "
                span class="key false" {} "fix, false "
                span class="key none" {} "no fix "
                span class="key ellipse" {}
                "its own 95\u{a0}% ellipse, drawn " (enlargement) " times as large. Point at a fix or a row to see the square that was "
                "searched for it."
            }
            (map)
        }
    }
}

fn gallery_section(report: &FlightReport) -> Markup {
    let shown = gallery(report);
    html! {
        @if !shown.0.is_empty() {
            section {
                h2 { "What the camera saw, and the map from there" }
                p {
                    "Left: the frame. Right: the stored map as the same camera would see it from the fix, with the same height, heading, "
                    "tilt and lens."
                }
                div class="gallery" { (shown) }
            }
        }
    }
}

fn error_section(report: &FlightReport) -> Markup {
    let plane = "Fix minus truth, each with its own 95\u{a0}% ellipse, which should contain the cross.";
    let errors = "Error of each fix (stems), and the semi-major axis of its own 95\u{a0}% ellipse (line).";
    html! {
        section {
            h2 { "Errors" }
            div class="plots" {
                (figure(error_plane(report), plane))
                div {
                    (figure(error_in_time(report), errors))
                    (figure(elapsed_in_time(report), "From the decoded frame to the answer."))
                }
            }
        }
    }
}

fn score_cards(report: &FlightReport) -> Markup {
    let score = report.score;
    let right = with_unit(score.right, &format!("of {}", score.frames));
    let threads = format!("per frame, median, {} threads", score.threads);
    cards([
        Card::new(right, format!("right, within {:.1} m", score.right_m)),
        Card { is_bad: score.wrong > 0, ..Card::new(html! { (score.wrong) }, "false") },
        Card::new(number(score.error_m.map(|e| e.median), 2, "m"), "median error"),
        Card::new(number(score.error_m.map(|e| e.p95), 2, "m"), "error, 95 % below"),
        Card::new(number(score.ellipse95_coverage.map(|c| c * 100.0), 0, "%"), "truths inside the stated 95 % ellipse"),
        Card::new(number(score.elapsed_ms.map(|e| e.median), 0, "ms"), threads),
    ])
}

fn rows(report: &FlightReport) -> Markup {
    let rows = report.outcomes.iter().zip(&report.flight.frames).enumerate();
    html! {
        @for (index, (outcome, frame)) in rows {
            tr data-frame=(index) {
                td { (outcome.image) }
                @match &outcome.answer {
                    Answer::Fix(_) => { (fix_cells(report, outcome, frame)) }
                    Answer::NoFix(no_fix) => { td class="none" { "no fix" } td colspan="6" { (no_fix.detail) } }
                }
                td { (outcome.tiles_searched()) }
                td { (format!("{:.0}", outcome.elapsed_ms)) }
            }
        }
    }
}

fn fix_cells(report: &FlightReport, outcome: &FixOutcome, frame: &RecordedFrame) -> Markup {
    let Some(fix) = fix_of(outcome) else { return html! {} };
    let error_m = outcome.error.map_or(f64::NAN, |e| e.length_m());
    let class = if error_m > report.score.right_m { "false" } else { "right" };
    let ellipse = fix.covariance.ellipse_95();
    let (long, short) = (ellipse.semi_major_m, ellipse.semi_minor_m);
    let holds = if outcome.is_in_ellipse95() == Some(true) { "yes" } else { "no" };
    let heading = frame.true_heading_rad.map_or_else(String::new, |truth| {
        let off = fix.heading.turn_rad_from(Heading::from_radians(truth)).to_degrees();
        format!("{off:+.2} (1σ {:.2})", fix.heading_sigma_rad.to_degrees())
    });
    html! {
        td class=(class) { (class) }
        td { (format!("{error_m:.2}")) }
        td { (format!("{long:.2} × {short:.2}")) }
        td { (holds) }
        td { (heading) }
        td { (format!("{:.1}", fix.score)) }
        td { (fix.inliers) }
    }
}

fn facts(report: &FlightReport) -> Markup {
    let ellipse = ("95 % ellipse".to_owned(), format!("half axes of {:.3} standard deviations", CHI_SQUARE_95.sqrt()));
    html! { @for (name, value) in report.facts.iter().chain([&ellipse]) { dt { (name) } dd { (value) } } }
}
