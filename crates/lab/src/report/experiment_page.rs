//! `experiment_html`: the paper's section V.D repeated, as one page that loads nothing: plots beside the paper's values.

use super::relative_cost::relative_cost_svgs;
use super::{data_url, escaped};
use crate::trial::{DriftCurve, Experiment, RelativeMeasurement, Shape};
use overfly_core::coupling::PixelDriftLaw;
use overfly_core::pixels::{Colour, Gray};

const STYLE: &str = include_str!("report.css");

/// The page; `sources` says in words what the images were cut from.
pub fn experiment_html(experiment: &Experiment, measured: &RelativeMeasurement, sources: &str) -> String {
    let e = experiment;
    let title = "The paper's experiment, repeated";
    format!(
        r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><title>{title}</title><style>{STYLE}</style></head>
<body><main><header><h1>{title}</h1><p>Section V.D of Ziaei's paper: {images} images of {edge} &times; {edge} px, cut from {sources}, and {pairs} pairs of them at five overlaps. The second view of a pair lies ahead of its image, up to 8 degrees turned, with noise of its own, so that the motion is known exactly. Each pair was registered with at most {limits} descriptors. Times are of one thread{repeats}.</p></header>
<section class="cards">{cards}</section>
<section><h2>Figures 12 to 15</h2><div class="plots even">{figures}</div></section>
<section><h2>Beside the paper</h2><div class="scroll">{beside}</div><p>The paper prints no t<sub>0</sub>, B and t<sub>c</sub>: they stand in its figures alone. Its L of 9 &micro;s cannot be meant (29 GB/s for one image).</p></section>
<section><h2>Do the laws hold?</h2><p>{tests}</p><div class="scroll">{shapes}</div></section>
<section><h2>Matches for a drift below {bound:.2} px</h2><p>That is 1 m at 1.19 m/px, for which the paper needs more than 600 matches.</p><div class="scroll">{needed}</div></section>
<section><h2>By number of descriptors</h2><div class="scroll">{rows}</div></section>
<section><h2>Registered pairs by overlap</h2><div class="scroll">{overlaps}</div></section>
<section><h2>The images</h2><figure>{sheet}<figcaption>All {images}, as the first view of each pair shows them.</figcaption></figure></section>
</main></body></html>
"#,
        images = e.images,
        edge = e.edge_px,
        sources = escaped(sources),
        pairs = e.pairs,
        limits = in_words(&e.limits),
        repeats = if e.repeats > 1 { format!(", the medians of {} runs", e.repeats) } else { String::new() },
        cards = cards(e),
        figures = figures(e, measured),
        beside = beside(e),
        shapes = table(
            &[
                "law",
                "figure",
                "R&sup2; of the medians",
                "of single registrations",
                "power expected",
                "power found",
                "holds"
            ],
            &e.shapes.iter().map(shape).collect::<Vec<_>>()
        ),
        tests = tests(e),
        bound = e.paper.drift_px,
        needed = needed(e),
        rows = rows(e),
        overlaps = overlaps(e),
        sheet = sheet(measured),
    )
}

/// 1, 2 or 3.
fn in_words(limits: &[usize]) -> String {
    let texts: Vec<String> = limits.iter().map(usize::to_string).collect();
    match texts.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => texts.concat(),
    }
}

fn or_none(value: Option<impl ToString>) -> String {
    value.map_or_else(|| "none".into(), |v| v.to_string())
}

fn cards(e: &Experiment) -> String {
    let needed = |curve: &DriftCurve| or_none(curve.matches_needed.and_then(|m| m.by_every_registration));
    let reproduced = e.shapes.iter().filter(|s| s.figure.is_some() && s.holds).count();
    let wrong = if e.wrong > 0 { "bad" } else { "" };
    let cards = [
        (format!("{reproduced}<small>of 4</small>"), "figures whose shape came out", ""),
        (format!("{}<small>of {}</small>", e.registered, e.registrations), "registrations with an answer", ""),
        (e.wrong.to_string(), "of them off by more than a pixel", wrong),
        (
            needed(&e.laws.keypoints),
            "matches from which on keypoints alone were never off by 0.84 px; the paper: 600",
            "",
        ),
        (needed(&e.laws.program), "the same of the program's answers", ""),
        (format!("{:.1}<small>ms</small>", 1e3 * e.laws.relative_s), "a relative registration (45)", ""),
    ];
    let card = |(value, name, class): (String, &str, &str)| {
        format!(r#"<div class="card {class}"><b>{value}</b><span>{name}</span></div>"#)
    };
    cards.into_iter().map(card).collect()
}

fn figures(e: &Experiment, measured: &RelativeMeasurement) -> String {
    let caption = |name: &str| {
        let shape = |figure: Option<u8>| e.shapes.iter().find(|s| s.figure == figure).map_or(String::new(), verdict);
        match name {
            "loading" => format!("<b>Figure 12.</b> Loading: decoding an image and describing it. {}", shape(Some(12))),
            "matching" => format!("<b>Figure 13.</b> Matching: all descriptors against all. {}", shape(Some(13))),
            "threshold" => {
                format!("<b>Figure 14.</b> Thresholding: keeping or dropping each match. {}", shape(Some(14)))
            }
            "total" => format!("All steps together (45), beside the paper's loading. {}", shape(None)),
            _ => format!(
                "<b>Figure 15.</b> Drift: root of the mean square in bins of matches, up to the largest (bars), with the fitted laws; dashed 0.84 px, the cross is the paper's one printed point. {}",
                shape(Some(15))
            ),
        }
    };
    relative_cost_svgs(&e.laws, &measured.samples)
        .into_iter()
        .map(|(name, plot)| {
            let class = if name == "drift" { "wide" } else { "" };
            format!(r#"<figure class="{class}">{plot}<figcaption>{}</figcaption></figure>"#, caption(name))
        })
        .collect()
}

fn verdict(shape: &Shape) -> String {
    let power = match (shape.expected_power, shape.power) {
        (Some(expected), Some(found)) => format!(", best power {found:.2} for {expected}"),
        _ => String::new(),
    };
    let r2 = shape.r2.map_or("no R&sup2;".into(), |r2| format!("R&sup2; {r2:.4}"));
    let rank = shape.rank_correlation.map_or(String::new(), |r| format!(", rank correlation {r:.2}"));
    format!("{}: {r2}{power}{rank}.", if shape.holds { "The law holds" } else { "The law does not hold" })
}

fn shape(shape: &Shape) -> Vec<String> {
    let number = |v: Option<f64>, digits: usize| v.map_or("&ndash;".into(), |v| format!("{v:.digits$}"));
    vec![
        escaped(shape.law),
        shape.figure.map_or("&ndash;".into(), |figure| figure.to_string()),
        number(shape.r2, 4),
        number(shape.r2_of_registrations, 4),
        shape.expected_power.map_or("&ndash;".into(), |p| p.to_string()),
        number(shape.power, 2),
        if shape.holds { "yes" } else { "no" }.into(),
    ]
}

/// What had to be, each test once.
fn tests(e: &Experiment) -> String {
    let tests = e.shapes.chunk_by(|a, b| a.test == b.test);
    let line = |shapes: &[Shape]| {
        let first = shapes.first()?;
        let of: Vec<String> = shapes.iter().filter_map(|s| s.figure.map(|figure| figure.to_string())).collect();
        let of = match of.len() {
            0 => "(45)".to_owned(),
            1 => format!("Figure {}", of[0]),
            _ => format!("Figures {}", of.join(", ")),
        };
        Some(format!("{of}: {}.", escaped(first.test)))
    };
    tests.filter_map(line).collect::<Vec<_>>().join(" ")
}

fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let head: String = head.iter().map(|name| format!("<th>{name}</th>")).collect();
    let cells = |row: &Vec<String>| row.iter().map(|cell| format!("<td>{cell}</td>")).collect::<String>();
    let rows: String = rows.iter().map(|row| format!("<tr>{}</tr>", cells(row))).collect();
    format!(r#"<table class="words"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"#)
}

fn beside(e: &Experiment) -> String {
    let (r, paper) = (e.laws.relative, e.paper);
    let law = |law: Option<PixelDriftLaw>| {
        or_none(law.map(|l| match l.floor_px {
            0.0 => format!("{:.3} / &radic;n px", l.pair_drift_px),
            floor_px => format!("&radic;({floor_px:.4}&sup2; + ({:.3} / &radic;n)&sup2;) px", l.pair_drift_px),
        }))
    };
    let row = |name: &str, here: String, there: String| vec![name.into(), here, there];
    table(
        &["", "here", "the paper"],
        &[
            row(
                "A<sub>c</sub>, describing one keypoint (42)",
                format!("{:.2} &micro;s", 1e6 * r.seconds_per_descriptor),
                format!("{:.0} &micro;s", 1e6 * paper.seconds_per_descriptor),
            ),
            row(
                "L, an image without descriptors (42)",
                format!("{:.2} ms", 1e3 * r.load_s),
                format!("{:.0} &micro;s as printed; ms are likely", 1e6 * paper.load_s),
            ),
            row(
                "t<sub>0</sub>, comparing two descriptors (43)",
                format!("{:.2} ns", 1e9 * r.pair_comparison_s),
                "not printed".into(),
            ),
            row(
                "B, keeping or dropping a match (44)",
                format!("{:.2} ns", 1e9 * r.threshold_s_per_descriptor),
                "not printed".into(),
            ),
            row("t<sub>c</sub>, shift and turn (45)", format!("{:.2} ms", 1e3 * r.estimate_s), "not printed".into()),
            row(
                "T<sub>exe</sub> of one registration (45)",
                format!("{:.1} ms with {:.0} descriptors", 1e3 * e.laws.relative_s, e.laws.descriptor_count),
                format!(
                    "its loading alone: {:.0} ms",
                    1e3 * (paper.seconds_per_descriptor * e.laws.descriptor_count + paper.probable_load_s)
                ),
            ),
            row("D<sub>U</sub> of keypoints alone", law(e.laws.keypoints.law), law(Some(paper.drift_law))),
            row("D<sub>U</sub> of the program's answers", law(e.laws.program.law), String::new()),
        ],
    )
}

fn needed(e: &Experiment) -> String {
    let row = |(name, curve): (&str, &DriftCurve)| {
        let m = curve.matches_needed;
        let least = m.map(|m| m.fewest_seen);
        vec![
            name.into(),
            format!("{} of {}", curve.scored, curve.tried),
            curve.beyond_one_px.to_string(),
            or_none(least),
            or_none(m.and_then(|m| m.by_bins)),
            or_none(m.and_then(|m| m.by_every_registration)),
            m.map_or(String::new(), |m| m.registrations_from_there.to_string()),
            or_none(m.map(|m| m.law_in_words())),
        ]
    };
    let laws = &e.laws;
    let curves = [
        ("the program's answers", &laws.program),
        ("keypoints alone, of the same pairs", &laws.keypoints),
        ("keypoints alone, every pair, accidents included", &laws.keypoints_unchecked),
    ];
    table(
        &[
            "estimator",
            "registrations with an answer",
            "off by more than 1 px",
            "fewest matches seen",
            "all bins below from",
            "every registration below from",
            "so many registrations",
            "by the law",
        ],
        &curves.map(row),
    )
}

fn rows(e: &Experiment) -> String {
    let ms = |s: f64| format!("{:.3}", 1e3 * s);
    let rows: Vec<Vec<String>> = e
        .laws
        .rows
        .iter()
        .map(|r| {
            vec![
                r.limit.to_string(),
                format!("{:.0}", r.descriptors),
                ms(r.times.loading_s),
                ms(r.times.matching_s),
                format!("{:.2}", 1e6 * r.times.threshold_s),
                ms(r.times.agreement_s),
                or_none(r.times.estimate_s.map(ms)),
                or_none(r.total_s.map(ms)),
                format!("{:.0}", r.matched),
                or_none(r.drifts.drift_px.map(|d| format!("{d:.4}"))),
                or_none(r.drifts.keypoint_drift_px.map(|d| format!("{d:.4}"))),
                format!("{} of {}", r.registered, r.pairs),
                r.wrong.to_string(),
            ]
        })
        .collect();
    table(
        &[
            "at most",
            "N",
            "loading, ms",
            "matching, ms",
            "threshold, &micro;s",
            "agreement, ms",
            "estimate, ms",
            "all, ms",
            "n",
            "drift, px",
            "keypoints alone",
            "registered",
            "false",
        ],
        &rows,
    )
}

fn overlaps(e: &Experiment) -> String {
    let head: Vec<String> = e.limits.iter().map(|limit| format!("{limit} descriptors")).collect();
    let mut names = vec!["overlap", "pairs"];
    names.extend(head.iter().map(String::as_str));
    names.push("false");
    let row = |o: &crate::trial::OverlapRow| {
        let mut cells = vec![format!("{} %", o.overlap_percent), o.pairs.to_string()];
        cells.extend(o.registered.iter().map(usize::to_string));
        cells.push(o.wrong.to_string());
        cells
    };
    table(&names, &e.by_overlap.iter().map(row).collect::<Vec<_>>())
}

/// All images on one sheet, twelve a row.
fn sheet(measured: &RelativeMeasurement) -> String {
    const GAP_PX: usize = 4;
    let pictures: Vec<&Gray> = measured.images.iter().map(|image| &image.picture).collect();
    let Some(first) = pictures.first() else { return String::new() };
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
    format!(r#"<img class="sheet" alt="all images" src="{}">"#, data_url(&sheet, 80))
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
            place: crate::trial::Place { centre_px: [0.0; 2], heading_rad: 0.0 },
            picture: Gray::filled(96, 96, shade),
        };
        let measured = RelativeMeasurement { images: (0..13).map(|i| image(i as f32)).collect(), samples: vec![] };
        assert!(sheet(&measured).starts_with("<img"));
        assert_eq!(sheet(&RelativeMeasurement { images: vec![], samples: vec![] }), "");
    }
}
