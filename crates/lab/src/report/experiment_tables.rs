//! The tables of the experiment's page.

use crate::trial::{DriftCurve, Experiment, OverlapRow, Shape};
use maud::{Markup, html};
use overfly_core::coupling::PixelDriftLaw;

/// The value as text, or "none".
pub fn or_none(value: Option<impl ToString>) -> String {
    value.map_or_else(|| "none".into(), |v| v.to_string())
}

fn table(head: &[&str], rows: &[Vec<Markup>]) -> Markup {
    html! {
        table class="words" {
            thead { tr { @for name in head { th { (name) } } } }
            tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
        }
    }
}

fn text(cells: Vec<String>) -> Vec<Markup> {
    cells.into_iter().map(|cell| html! { (cell) }).collect()
}

/// A symbol with an index below the line.
fn indexed(symbol: &str, index: &str, rest: &str) -> Markup {
    html! { (symbol) sub { (index) } (rest) }
}

/// The measured constants beside the printed ones.
pub fn beside_the_paper(e: &Experiment) -> Markup {
    let (r, paper) = (e.laws.relative, e.paper);
    let row = |name: Markup, here: String, there: String| vec![name, html! { (here) }, html! { (there) }];
    let loading_ms = 1e3 * (paper.seconds_per_descriptor * e.laws.descriptor_count + paper.probable_load_s);
    let not_printed = || "not printed".to_owned();
    let rows = [
        row(
            indexed("A", "c", ", describing one keypoint (42)"),
            format!("{:.2} µs", 1e6 * r.seconds_per_descriptor),
            format!("{:.0} µs", 1e6 * paper.seconds_per_descriptor),
        ),
        row(
            html! { "L, an image without descriptors (42)" },
            format!("{:.2} ms", 1e3 * r.load_s),
            format!("{:.0} µs as printed; ms are likely", 1e6 * paper.load_s),
        ),
        row(
            indexed("t", "0", ", comparing two descriptors (43)"),
            format!("{:.2} ns", 1e9 * r.pair_comparison_s),
            not_printed(),
        ),
        row(
            html! { "B, keeping or dropping a match (44)" },
            format!("{:.2} ns", 1e9 * r.threshold_s_per_descriptor),
            not_printed(),
        ),
        row(indexed("t", "c", ", shift and turn (45)"), format!("{:.2} ms", 1e3 * r.estimate_s), not_printed()),
        row(
            indexed("T", "exe", " of one registration (45)"),
            format!("{:.1} ms with {:.0} descriptors", 1e3 * e.laws.relative_s, e.laws.descriptor_count),
            format!("its loading alone: {loading_ms:.0} ms"),
        ),
        row(indexed("D", "U", " of keypoints alone"), or_none(e.laws.keypoints.law.map(law)), law(paper.drift_law)),
        row(indexed("D", "U", " of the program's answers"), or_none(e.laws.program.law.map(law)), String::new()),
    ];
    table(&["", "here", "the paper"], &rows)
}

fn law(law: PixelDriftLaw) -> String {
    match law.floor_px {
        0.0 => format!("{:.3} / √n px", law.pair_drift_px),
        floor_px => format!("√({floor_px:.4}² + ({:.3} / √n)²) px", law.pair_drift_px),
    }
}

/// Each law and whether it holds.
pub fn laws(e: &Experiment) -> Markup {
    let number = |v: Option<f64>, digits: usize| v.map_or("–".into(), |v| format!("{v:.digits$}"));
    let row = |shape: &Shape| {
        text(vec![
            shape.law.to_owned(),
            shape.figure.map_or("–".into(), |figure| figure.to_string()),
            number(shape.r2, 4),
            number(shape.r2_of_registrations, 4),
            shape.expected_power.map_or("–".into(), |p| p.to_string()),
            number(shape.power, 2),
            if shape.holds { "yes" } else { "no" }.to_owned(),
        ])
    };
    let head =
        ["law", "figure", "R² of the medians", "of single registrations", "power expected", "power found", "holds"];
    table(&head, &e.shapes.iter().map(row).collect::<Vec<_>>())
}

/// From how many matches on the drift is below the bound, for each estimator.
pub fn matches_needed(e: &Experiment) -> Markup {
    let row = |(name, curve): (&str, &DriftCurve)| {
        let m = curve.matches_needed;
        text(vec![
            name.into(),
            format!("{} of {}", curve.scored, curve.tried),
            curve.beyond_one_px.to_string(),
            or_none(m.map(|m| m.fewest_seen)),
            or_none(m.and_then(|m| m.by_bins)),
            or_none(m.and_then(|m| m.by_every_registration)),
            m.map_or(String::new(), |m| m.registrations_from_there.to_string()),
            or_none(m.map(|m| m.law_in_words())),
        ])
    };
    let curves = [
        ("the program's answers", &e.laws.program),
        ("keypoints alone, of the same pairs", &e.laws.keypoints),
        ("keypoints alone, every pair, chance agreements included", &e.laws.keypoints_unchecked),
    ];
    let head = [
        "estimator",
        "registrations with an answer",
        "off by more than 1 px",
        "fewest matches seen",
        "all bins below from",
        "every registration below from",
        "registrations from there",
        "by the law",
    ];
    table(&head, &curves.map(row))
}

/// Times and drifts of each number of descriptors.
pub fn by_descriptors(e: &Experiment) -> Markup {
    let ms = |s: f64| format!("{:.3}", 1e3 * s);
    let px = |d: f64| format!("{d:.4}");
    let rows = e.laws.rows.iter().map(|r| {
        text(vec![
            r.limit.to_string(),
            format!("{:.0}", r.descriptors),
            ms(r.times.loading_s),
            ms(r.times.matching_s),
            format!("{:.2}", 1e6 * r.times.threshold_s),
            ms(r.times.agreement_s),
            or_none(r.times.estimate_s.map(ms)),
            or_none(r.total_s.map(ms)),
            format!("{:.0}", r.matched),
            or_none(r.drifts.drift_px.map(px)),
            or_none(r.drifts.keypoint_drift_px.map(px)),
            format!("{} of {}", r.registered, r.pairs),
            r.wrong.to_string(),
        ])
    });
    let head = [
        "at most",
        "N",
        "loading, ms",
        "matching, ms",
        "threshold, µs",
        "agreement, ms",
        "estimate, ms",
        "all, ms",
        "n",
        "drift, px",
        "keypoints alone",
        "registered",
        "false",
    ];
    table(&head, &rows.collect::<Vec<_>>())
}

/// Registered pairs by overlap and number of descriptors.
pub fn by_overlap(e: &Experiment) -> Markup {
    let limits: Vec<String> = e.limits.iter().map(|limit| format!("{limit} descriptors")).collect();
    let mut head = vec!["overlap", "pairs"];
    head.extend(limits.iter().map(String::as_str));
    head.push("false");
    let row = |o: &OverlapRow| {
        let mut cells = vec![format!("{} %", o.overlap_percent), o.pairs.to_string()];
        cells.extend(o.registered.iter().map(usize::to_string));
        cells.push(o.wrong.to_string());
        text(cells)
    };
    table(&head, &e.by_overlap.iter().map(row).collect::<Vec<_>>())
}
