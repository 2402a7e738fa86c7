//! The page itself: figures, map, plots, table.

use super::map::{TO_95, fix_of, half_axes_m, map};
use super::plot::{elapsed_in_time, error_in_time, error_plane};
use super::{Report, escaped, gallery};
use crate::trial::{FixOutcome, Frame};
use overfly_flight::locate::Answer;
use std::fmt::Write;

const STYLE: &str = include_str!("report.css");
const SCRIPT: &str = include_str!("report.js");

pub(super) fn page(report: &Report) -> String {
    let (map, larger) = map(report);
    let shown = gallery::gallery(report);
    let gallery = if shown.is_empty() {
        String::new()
    } else {
        format!(
            r#"<section><h2>What the camera saw, and the map from there</h2><p>Left the frame; right the stored map as the same camera would see it from the fix that was found: same height, heading, tilt and lens.</p><div class="gallery">{shown}</div></section>"#
        )
    };
    format!(
        r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><title>{title}</title><style>{STYLE}</style></head>
<body><main>
<header><h1>{title}</h1><p>{introduction}</p></header>
<section class="cards">{cards}</section>
<section><h2>Map</h2><p class="legend"><span class="key track"></span>true track <span class="key right"></span>fix, right <span class="key false"></span>fix, false <span class="key none"></span>no fix <span class="key ellipse"></span>its own 95&nbsp;% ellipse, drawn {larger} times as large. Point at a fix or a row to see the square that was searched for it.</p>{map}</section>
{gallery}
<section><h2>Errors</h2><div class="plots">
<figure>{plane}<figcaption>Fix less truth, each with its own 95&nbsp;% ellipse: it should hold the cross.</figcaption></figure>
<div><figure>{errors}<figcaption>Error of each fix (stems), and the long half axis of its own 95&nbsp;% ellipse (line).</figcaption></figure>
<figure>{elapsed}<figcaption>From the decoded frame to the answer.</figcaption></figure></div></div></section>
<section><h2>Frames</h2><div class="scroll"><table><thead><tr><th>frame</th><th>answer</th><th>error, m</th><th>95&nbsp;% ellipse, m</th><th>holds the truth</th><th>heading error, deg</th><th>score</th><th>windows</th><th>tiles</th><th>ms</th></tr></thead><tbody>{rows}</tbody></table></div></section>
<section><h2>Store and machine</h2><dl>{facts}</dl></section>
</main><script>{SCRIPT}</script></body></html>
"#,
        title = escaped(report.title),
        introduction = escaped(report.introduction),
        cards = cards(report),
        plane = error_plane(report),
        errors = error_in_time(report),
        elapsed = elapsed_in_time(report),
        rows = rows(report),
        facts = facts(report),
    )
}

fn cards(report: &Report) -> String {
    let score = report.score;
    let number = |v: Option<f64>, digits: usize, unit: &str| {
        v.map_or_else(|| "none".to_owned(), |v| format!("{v:.digits$}<small>{unit}</small>"))
    };
    let cards = [
        (
            format!("{}<small>of {}</small>", score.right, score.frames),
            format!("right, within {:.1} m", score.right_m),
            "",
        ),
        (score.wrong.to_string(), "false".into(), if score.wrong > 0 { "bad" } else { "" }),
        (number(score.error_m.map(|e| e.median), 2, "m"), "median error".into(), ""),
        (number(score.error_m.map(|e| e.p95), 2, "m"), "error, 95 % below".into(), ""),
        (
            number(score.ellipse95_coverage.map(|c| c * 100.0), 0, "%"),
            "truths inside the stated 95 % ellipse".into(),
            "",
        ),
        (
            number(score.elapsed_ms.map(|e| e.median), 0, "ms"),
            format!("per frame, median, {} threads", score.threads),
            "",
        ),
    ];
    let card = |(value, name, class): &(String, String, &str)| {
        format!(r#"<div class="card {class}"><b>{value}</b><span>{name}</span></div>"#)
    };
    cards.iter().map(card).collect()
}

fn rows(report: &Report) -> String {
    let mut text = String::new();
    for (index, (outcome, frame)) in report.outcomes.iter().zip(&report.flight.frames).enumerate() {
        let _ = write!(text, r#"<tr data-frame="{index}">{}</tr>"#, row(report, outcome, frame));
    }
    text
}

fn row(report: &Report, outcome: &FixOutcome, frame: &Frame) -> String {
    let image = escaped(&outcome.image);
    let (tiles, elapsed_ms) = (outcome.tiles_searched(), outcome.elapsed_ms);
    let Some(fix) = fix_of(outcome) else {
        let Answer::NoFix(none) = &outcome.answer else { unreachable!("an answer is a fix or none") };
        return format!(
            r#"<td>{image}</td><td class="none">no fix</td><td colspan="6">{}</td><td>{tiles}</td><td>{elapsed_ms:.0}</td>"#,
            escaped(&none.detail)
        );
    };
    let error_m = outcome.error.map_or(f64::NAN, |e| e.length_m());
    let class = if error_m > report.score.right_m { "false" } else { "right" };
    let [long, short] = half_axes_m(fix);
    let holds = if outcome.is_in_ellipse95() == Some(true) { "yes" } else { "no" };
    let heading = frame.true_heading_rad.map_or_else(String::new, |truth| {
        let off = (fix.heading_deg - truth.to_degrees() + 180.0).rem_euclid(360.0) - 180.0;
        format!("{off:+.2} (1&sigma; {:.2})", fix.heading_sigma_deg)
    });
    format!(
        r#"<td>{image}</td><td class="{class}">{class}</td><td>{error_m:.2}</td><td>{long:.2} &times; {short:.2}</td><td>{holds}</td><td>{heading}</td><td>{:.1}</td><td>{}</td><td>{tiles}</td><td>{elapsed_ms:.0}</td>"#,
        fix.score, fix.inliers
    )
}

fn facts(report: &Report) -> String {
    let ellipse = ("95 % ellipse".to_owned(), format!("half axes of {TO_95:.3} standard deviations"));
    report
        .facts
        .iter()
        .chain([&ellipse])
        .map(|(name, value)| format!("<dt>{}</dt><dd>{}</dd>", escaped(name), escaped(value)))
        .collect()
}
