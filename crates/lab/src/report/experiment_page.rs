//! `experiment_html`: the paper's section V.D repeated, as one page: plots and tables beside the paper's values.

use super::data_url::data_url;
use super::experiment_tables::{beside_the_paper, by_descriptors, by_overlap, laws, matches_needed, or_none};
use super::html::{Card, Page, cards, with_unit};
use super::relative_cost_plots::relative_cost_svgs;
use crate::trial::{DriftCurve, Experiment, RelativeMeasurement, Shape};
use maud::{Markup, PreEscaped, html};
use overfly_core::pixels::{Colour, Gray};

/// The page; `sources` names what the images were cut from.
pub fn experiment_html(experiment: &Experiment, measured: &RelativeMeasurement, sources: &str) -> String {
    let e = experiment;
    let title = "The paper's experiment, repeated";
    let body = html! {
        section class="cards" { (result_cards(e)) }
        section { h2 { "Figures 12 to 15" } div class="plots even" { (figures(e, measured)) } }
        section {
            h2 { "Beside the paper" }
            div class="scroll" { (beside_the_paper(e)) }
            p {
                "The paper does not print t" sub { "0" } ", B and t" sub { "c" } "; only its figures show them. Its L of 9 µs must be an error "
                "(29 GB/s for one image)."
            }
        }
        section { h2 { "Do the laws hold?" } p { (tests(e)) } div class="scroll" { (laws(e)) } }
        section {
            h2 { "Matches for a drift below " (format!("{:.2}", e.paper.drift_px)) " px" }
            p { "That is 1 m at 1.19 m/px, for which the paper needs more than 600 matches." }
            div class="scroll" { (matches_needed(e)) }
        }
        section { h2 { "By number of descriptors" } div class="scroll" { (by_descriptors(e)) } }
        section { h2 { "Registered pairs by overlap" } div class="scroll" { (by_overlap(e)) } }
        section {
            h2 { "The images" }
            figure {
                (sheet(measured))
                figcaption { "All " (e.images) ", as the first view of each pair shows them." }
            }
        }
    };
    Page { title, heading: title, introduction: introduction(e, sources), body, script: "" }.into_html()
}

fn introduction(e: &Experiment, sources: &str) -> Markup {
    let repeats = if e.repeats > 1 { format!(", the medians of {} runs", e.repeats) } else { String::new() };
    html! {
        "Section V.D of Ziaei's paper: " (e.images) " images of " (e.edge_px) " × " (e.edge_px) " px, cut from " (sources) ", and " (e.pairs)
        " pairs of them at five overlaps. The second view of a pair lies ahead of its image, up to 8 degrees turned, with noise of its own, so "
        "that the motion is known exactly. Each pair was registered with at most " (in_words(&e.limits)) " descriptors. Times are of one thread"
        (repeats) "."
    }
}

/// The numbers as a list: 1, 2 or 3.
fn in_words(limits: &[usize]) -> String {
    let texts: Vec<String> = limits.iter().map(usize::to_string).collect();
    match texts.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => texts.concat(),
    }
}

fn result_cards(e: &Experiment) -> Markup {
    let needed = |curve: &DriftCurve| {
        let matches = or_none(curve.matches_needed.and_then(|m| m.by_every_registration));
        html! { (matches) }
    };
    let reproduced = e.shapes.iter().filter(|s| s.figure.is_some() && s.holds).count();
    let answered = with_unit(e.registered, &format!("of {}", e.registrations));
    let wrong = Card::new(html! { (e.wrong) }, "of them off by more than a pixel");
    let keypoints = "matches from which on keypoints alone were never off by 0.84 px; the paper: 600";
    cards([
        Card::new(with_unit(reproduced, "of 4"), "figures whose shape came out"),
        Card::new(answered, "registrations with an answer"),
        Card { is_bad: e.wrong > 0, ..wrong },
        Card::new(needed(&e.laws.keypoints), keypoints),
        Card::new(needed(&e.laws.program), "the same of the program's answers"),
        Card::new(with_unit(format!("{:.1}", 1e3 * e.laws.relative_s), "ms"), "a relative registration (45)"),
    ])
}

fn figures(e: &Experiment, measured: &RelativeMeasurement) -> Markup {
    html! {
        @for (name, plot) in relative_cost_svgs(&e.laws, &measured.samples) {
            figure class=[(name == "drift").then_some("wide")] {
                (PreEscaped(plot))
                figcaption { (caption(e, name)) }
            }
        }
    }
}

fn caption(e: &Experiment, name: &str) -> Markup {
    let verdict = |figure: Option<u8>| e.shapes.iter().find(|s| s.figure == figure).map_or(String::new(), verdict);
    let (number, text) = match name {
        "loading" => (12, "Loading: decoding an image and describing it."),
        "matching" => (13, "Matching: all descriptors against all."),
        "threshold" => (14, "Thresholding: keeping or dropping each match."),
        "total" => {
            return html! { "All steps together (45), beside the paper's loading. " (verdict(None)) };
        }
        _ => (
            15,
            "Drift: root mean square in bins of matches, up to the largest (bars), with the fitted laws; dashed 0.84 px, the cross is the paper's one printed point.",
        ),
    };
    html! { b { "Figure " (number) "." } " " (text) " " (verdict(Some(number))) }
}

fn verdict(shape: &Shape) -> String {
    let power = match (shape.expected_power, shape.power) {
        (Some(expected), Some(found)) => format!(", best power {found:.2} for {expected}"),
        _ => String::new(),
    };
    let r2 = shape.r2.map_or("no R²".into(), |r2| format!("R² {r2:.4}"));
    let rank = shape.rank_correlation.map_or(String::new(), |r| format!(", rank correlation {r:.2}"));
    format!("{}: {r2}{power}{rank}.", if shape.holds { "The law holds" } else { "The law does not hold" })
}

/// The condition of each test, once.
fn tests(e: &Experiment) -> String {
    let line = |shapes: &[Shape]| {
        let test = shapes.first()?.test;
        let figures: Vec<String> = shapes.iter().filter_map(|s| s.figure.map(|figure| figure.to_string())).collect();
        Some(match &figures[..] {
            [] => format!("(45): {test}."),
            [figure] => format!("Figure {figure}: {test}."),
            _ => format!("Figures {}: {test}.", figures.join(", ")),
        })
    };
    e.shapes.chunk_by(|a, b| a.test == b.test).filter_map(line).collect::<Vec<_>>().join(" ")
}

/// All images on one sheet, twelve in a row.
fn sheet(measured: &RelativeMeasurement) -> Markup {
    const GAP_PX: usize = 4;
    let pictures: Vec<&Gray> = measured.images.iter().map(|image| &image.picture).collect();
    let Some(first) = pictures.first() else { return html! {} };
    let columns = pictures.len().min(12);
    let (wide, high) = (first.width_px() + GAP_PX, first.height_px() + GAP_PX);
    let mut sheet = Colour::black(columns * wide - GAP_PX, pictures.len().div_ceil(columns) * high - GAP_PX);
    sheet.values_mut().fill(255);
    for (i, picture) in pictures.iter().enumerate() {
        let (left, top) = (i % columns * wide, i / columns * high);
        for y in 0..picture.height_px() {
            for x in 0..picture.width_px() {
                sheet.set(left + x, top + y, [picture.at(x, y).clamp(0.0, 255.0) as u8; 3]);
            }
        }
    }
    html! { img class="sheet" alt="all images" src=(data_url(&sheet, 80)); }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_descriptors_are_told_as_a_sentence() {
        assert_eq!(in_words(&[75]), "75");
        assert_eq!(in_words(&[75, 600, 2400]), "75, 600 or 2400");
        assert_eq!(in_words(&[]), "");
    }

    #[test]
    fn the_sheet_has_twelve_images_a_row() {
        let image = |shade: f32| crate::trial::CutImage {
            photo: 0,
            place: crate::trial::ImagePlacement { centre_px: [0.0; 2], heading_rad: 0.0 },
            picture: Gray::filled(96, 96, shade),
        };
        let measured = RelativeMeasurement { images: (0..13).map(|i| image(i as f32)).collect(), samples: vec![] };
        assert!(sheet(&measured).0.starts_with("<img"));
        assert_eq!(sheet(&RelativeMeasurement { images: vec![], samples: vec![] }).0, "");
    }
}
