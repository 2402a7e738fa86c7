//! The page of a simulation: what was predicted beside what happened.

use super::escaped;
use crate::trial::simulation::{Family, Summary};
use std::fmt::Write;

const STYLE: &str = include_str!("report.css");

/// The page. Every plot is embedded; nothing is loaded from anywhere.
pub fn simulated_page(title: &str, summaries: &[Summary], family: &Family, svgs: &[(&'static str, String)]) -> String {
    let title = escaped(title);
    let figure =
        |(name, svg): &(&str, String)| format!("<figure>{svg}<figcaption>{}</figcaption></figure>", caption(name));
    let is_overview = |plot: &&(&str, String)| plot.0 == "failures";
    let overview: String = svgs.iter().filter(is_overview).map(figure).collect();
    let figures: String = svgs.iter().filter(|plot| !is_overview(plot)).map(figure).collect();
    format!(
        r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><title>{title}</title><style>{STYLE}</style></head>
<body><main><header><h1>{title}</h1><p>No image was registered: errors, times and failures are drawn as the file states them. Bands are where a figure comes out if its prediction is true, so wide that all of them hold with {confidence:.0}&nbsp;%.</p></header>
<section class="cards">{cards}</section>
{overview}<section><h2>Plots</h2><div class="plots">{figures}</div></section>
<section><h2>Failures a flight</h2><div class="scroll"><table><thead><tr><th>scenario</th><th>mode</th><th>hours</th><th>n</th><th>(14) as printed</th><th>model (11)</th><th>with what it leaves out</th><th>simulated</th><th>over the model's</th><th>p</th><th>p after a failure</th><th>variance over mean</th><th>lost</th></tr></thead><tbody>{failures}</tbody></table></div></section>
<section><h2>Comparisons</h2><div class="scroll"><table><thead><tr><th>scenario</th><th>figure</th><th>mode</th><th>predicted</th><th>simulated</th><th>band</th><th></th></tr></thead><tbody>{comparisons}</tbody></table></div></section>
</main></body></html>
"#,
        confidence = 100.0 * family.confidence,
        cards = cards(family),
        failures = failure_rows(summaries),
        comparisons = comparison_rows(summaries),
    )
}

fn caption(name: &str) -> &'static str {
    match name {
        "failures" => {
            "Failures a flight over those that (11) predicts: simulated (dots), the band of the prediction (bars), what (14) says as printed (crosses), and the prediction with what the model leaves out (rings)."
        }
        "survival" => {
            "Share of the flights without a failure (steps) and (1 - p)^N as predicted (line), against time over T0_max."
        }
        "spread" => "Flights by their number of failures, simulated (bars) and as predicted (dots).",
        "together" => "The same where failures come together most.",
        "optimum" => {
            "Failures a flight against n: equation 11 (line), simulated with its band (bars), n_opt of (13) upright."
        }
        "coverage" => {
            "Share of the flights whose truth lies in the estimate's own 95&nbsp;% ellipse, over the mission."
        }
        _ => "",
    }
}

fn cards(family: &Family) -> String {
    let cards = [
        (format!("{}<small>of {}</small>", family.inside, family.comparisons), "comparisons inside their bands"),
        (family.flights.to_string(), "flights"),
        (family.absolute_count.to_string(), "absolute registrations"),
    ];
    cards.iter().map(|(value, name)| format!(r#"<div class="card"><b>{value}</b><span>{name}</span></div>"#)).collect()
}

fn failure_rows(summaries: &[Summary]) -> String {
    let mut rows = String::new();
    for s in summaries.iter().filter(|s| s.simulated.absolute_count > 0.0) {
        let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.4}"));
        let (p, out) = (&s.predicted, &s.simulated);
        let _ = write!(
            rows,
            r#"<tr><td title="{}">{}</td><td>{}</td><td>{:.2}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.4}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.2}&nbsp;%</td></tr>"#,
            s.departures.join(", "),
            escaped(&s.variation),
            s.mode.word(),
            s.mission_s / 3600.0,
            s.relative_count.map_or(String::new(), |n| n.to_string()),
            number(p.failures_printed),
            number(p.failures),
            number(s.adjusted.and_then(|a| a.failures)),
            out.failures,
            number(p.failures.map(|p| out.failures / p)),
            number(out.failure_probability),
            number(out.failure_probability_after_failure),
            number(out.dispersion),
            100.0 * out.flights_lost,
        );
    }
    rows
}

fn comparison_rows(summaries: &[Summary]) -> String {
    let mut rows = String::new();
    for (s, c) in summaries.iter().flat_map(|s| s.comparisons.iter().map(move |c| (s, c))) {
        let (class, verdict) = if c.inside { ("right", "inside") } else { ("false", "outside") };
        let _ = write!(
            rows,
            r#"<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.5}</td><td>{:.5}</td><td>{:.5} to {:.5}</td><td class="{class}">{verdict}</td></tr>"#,
            escaped(&s.variation),
            c.what,
            s.mode.word(),
            c.predicted,
            c.simulated,
            c.band[0],
            c.band[1],
        );
    }
    rows
}
