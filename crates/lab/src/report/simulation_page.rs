//! The page of a simulation: predicted figures beside simulated ones.

use super::html::{Card, Page, cards, figure, with_unit};
use crate::trial::simulation::{BandComparison, Family, SimulationSummary};
use maud::{Markup, html};

const FAILURE_COLUMNS: [&str; 13] = [
    "scenario",
    "mode",
    "hours",
    "n",
    "(14) as printed",
    "model (11)",
    "with what it leaves out",
    "simulated",
    "over the model's",
    "p",
    "p after a failure",
    "variance over mean",
    "lost",
];
const COMPARISON_COLUMNS: [&str; 7] = ["scenario", "figure", "mode", "predicted", "simulated", "band", ""];

/// The page. It embeds every plot, and loads nothing.
pub fn simulation_html(
    title: &str,
    summaries: &[SimulationSummary],
    family: &Family,
    svgs: &[(&'static str, String)],
) -> String {
    let (overview, others): (Vec<_>, Vec<_>) = svgs.iter().partition(|plot| plot.0 == "failures");
    let introduction = html! {
        "No image was registered: errors, times and failures are drawn as the file states them. A band is where a figure comes out if its "
        "prediction is true. Bands are so wide that all of them hold with "
        (format!("{:.0}", 100.0 * family.confidence)) "\u{a0}%."
    };
    let body = html! {
        section class="cards" { (family_cards(family)) }
        @for (name, svg) in overview { (figure(svg.clone(), caption(name))) }
        section {
            h2 { "Plots" }
            div class="plots" { @for (name, svg) in others { (figure(svg.clone(), caption(name))) } }
        }
        (table_section("Failures a flight", &FAILURE_COLUMNS, failure_rows(summaries)))
        (table_section("Comparisons", &COMPARISON_COLUMNS, comparison_rows(summaries)))
    };
    Page { title, heading: title, introduction, body, script: "" }.into_html()
}

fn table_section(heading: &str, columns: &[&str], rows: Markup) -> Markup {
    html! {
        section {
            h2 { (heading) }
            div class="scroll" {
                table {
                    thead { tr { @for name in columns { th { (name) } } } }
                    tbody { (rows) }
                }
            }
        }
    }
}

fn caption(name: &str) -> &'static str {
    match name {
        "failures" => {
            "Failures a flight over those that (11) predicts: simulated (dots), the band of the prediction (bars), (14) as printed (crosses), and the prediction with what the model leaves out (rings)."
        }
        "survival" => {
            "Share of the flights without a failure (steps) and (1 - p)^N as predicted (line), against time over T0_max."
        }
        "spread" => "Flights by their number of failures, simulated (bars) and as predicted (dots).",
        "together" => "The same plot for the scenario whose failures cluster most.",
        "optimum" => {
            "Failures a flight against n: equation 11 (line), simulated with its band (bars), n_opt of (13) upright."
        }
        "coverage" => {
            "Share of the flights whose truth lies in the estimate's own 95\u{a0}% ellipse, over the mission."
        }
        _ => "",
    }
}

fn family_cards(family: &Family) -> Markup {
    let inside = with_unit(family.inside, &format!("of {}", family.comparisons));
    cards([
        Card::new(inside, "comparisons inside their bands"),
        Card::new(html! { (family.flights) }, "flights"),
        Card::new(html! { (family.absolute_count) }, "absolute registrations"),
    ])
}

fn failure_rows(summaries: &[SimulationSummary]) -> Markup {
    let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.4}"));
    html! {
        @for s in summaries.iter().filter(|s| s.simulated.absolute_count > 0.0) {
            tr {
                td title=(s.departures.join(", ")) { (s.variation) }
                td { (s.mode.word()) }
                td { (format!("{:.2}", s.mission_s / 3600.0)) }
                td { (s.relative_count.map_or(String::new(), |n| n.to_string())) }
                td { (number(s.predicted.failures_printed)) }
                td { (number(s.predicted.failures)) }
                td { (number(s.adjusted.and_then(|a| a.failures))) }
                td { (format!("{:.4}", s.simulated.failures)) }
                td { (number(s.predicted.failures.map(|p| s.simulated.failures / p))) }
                td { (number(s.simulated.failure_probability)) }
                td { (number(s.simulated.failure_probability_after_failure)) }
                td { (number(s.simulated.dispersion)) }
                td { (format!("{:.2}", 100.0 * s.simulated.flights_lost)) "\u{a0}%" }
            }
        }
    }
}

fn comparison_rows(summaries: &[SimulationSummary]) -> Markup {
    let comparisons = summaries.iter().flat_map(|s| s.comparisons.iter().map(move |c| (s, c)));
    html! { @for (summary, comparison) in comparisons { (comparison_row(summary, comparison)) } }
}

fn comparison_row(s: &SimulationSummary, c: &BandComparison) -> Markup {
    let (class, verdict) = if c.inside { ("right", "inside") } else { ("false", "outside") };
    html! {
        tr {
            td { (s.variation) }
            td { (c.what) }
            td { (s.mode.word()) }
            td { (format!("{:.5}", c.predicted)) }
            td { (format!("{:.5}", c.simulated)) }
            td { (format!("{:.5} to {:.5}", c.band[0], c.band[1])) }
            td class=(class) { (verdict) }
        }
    }
}
