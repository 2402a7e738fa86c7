//! `overfly fly --simulate`: thousands of drawn flights, predicted against simulated.

use super::evaluate::make_folder;
use super::{Exit, Failure, Output};
use overfly_lab::report::{simulation_html, simulation_svgs};
use overfly_lab::trial::simulation::{
    BandComparison, Family, Simulation, SimulationSummary, read_simulation, summarize, write_simulation,
};
use serde::Serialize;
use std::path::Path;

/// What summary.json holds.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    family: Family,
    scenarios: &'a [SimulationSummary],
}

/// Runs a simulation; exit code 0 whatever came out.
pub fn run(
    file: &Path,
    db: Option<&Path>,
    threads: usize,
    out: Option<&Path>,
    output: &Output,
) -> Result<Exit, Failure> {
    let mut variations = read_simulation(file)?;
    if let Some(db) = db {
        let mut stores = variations.iter_mut().filter_map(|v| v.scenario.store.as_mut()).peekable();
        if stores.peek().is_none() {
            let reason = format!("--db: {} has no table [store], which says how to fly over one", file.display());
            return Err(Failure::unusable("usage", anyhow::anyhow!(reason)));
        }
        stores.for_each(|store| store.path = Some(db.into()));
    }
    out.map_or(Ok(()), make_folder)?;
    let simulation = Simulation { path: file.into(), variations, threads };
    let bar = output.progress(simulation.flights(), "flights");
    let flown = simulation.run(|| bar.inc(1))?;
    bar.finish_and_clear();
    let (summaries, family) = summarize(&flown);
    if let Some(folder) = out {
        output.note(&format!("wrote {}", write_simulation(folder, &flown)?.display()));
        let written = serde_json::to_vec_pretty(&Written { family, scenarios: &summaries }).expect("plain numbers");
        output.write(&folder.join("summary.json"), &written)?;
        let svgs = simulation_svgs(&flown, &summaries);
        for (name, svg) in &svgs {
            output.write(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
        }
        let title = format!("overfly: {} simulated", file.display());
        output
            .write(&folder.join("simulation.html"), simulation_html(&title, &summaries, &family, &svgs).as_bytes())?;
    }
    for summary in &summaries {
        output.say(summary, || text(summary));
    }
    output.say(&family, || family_text(&family));
    Ok(Exit::Done)
}

fn text(s: &SimulationSummary) -> String {
    let count = s.relative_count.map_or(String::new(), |n| format!(", n {n}"));
    let mut text = format!(
        "{}, {}: {} flights of {:.2} h{count}\n  departs by   {}\n",
        s.variation,
        s.mode.word(),
        s.runs,
        s.mission_s / 3600.0,
        if s.departures.is_empty() { "nothing".into() } else { s.departures.join(", ") }
    );
    let both = |predicted: Option<f64>, simulated: Option<f64>, digits: usize| {
        let number = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.digits$}"));
        format!("predicted {}, simulated {}", number(predicted), number(simulated))
    };
    if s.simulated.absolute_count > 0.0 {
        let (p, out) = (&s.predicted, &s.simulated);
        text.push_str(&format!("  searches     {} a flight\n", both(p.absolute_count, Some(out.absolute_count), 1)));
        text.push_str(&format!("  t_exe        {} s\n", both(p.execution_s, out.execution_s, 4)));
        text.push_str(&format!("  p            {}\n", both(p.failure_probability, out.failure_probability, 6)));
        text.push_str(&format!("  T0_max       {} s\n", both(p.max_mission_s, out.max_mission_s, 0)));
        if let Some(failures) = s.adjusted.and_then(|a| a.failures) {
            text.push_str(&format!("  with what the model leaves out: {failures:.4} failures a flight\n"));
        }
        if out.failures > 0.0 {
            text.push_str(&format!(
                "  failures     {} drawn, {} outside the region, {} off the map; {} wrong positions; {:.1} % of flights lost\n",
                out.drawn, out.outside_region, out.no_map, out.false_fixes, 100.0 * out.flights_lost
            ));
        }
    }
    for c in &s.comparisons {
        text.push_str(&format!("  {}\n", comparison_text(c)));
    }
    text
}

fn comparison_text(c: &BandComparison) -> String {
    let verdict = if c.inside { "inside" } else { "OUTSIDE" };
    format!(
        "{:<22} predicted {:.5}, simulated {:.5}, band {:.5} to {:.5}: {verdict}",
        c.what, c.predicted, c.simulated, c.band[0], c.band[1]
    )
}

fn family_text(family: &Family) -> String {
    format!(
        "{} of {} comparisons inside their bands ({} flights, {} searches; all are inside with {:.0} % where every prediction is true)",
        family.inside,
        family.comparisons,
        family.flights,
        family.absolute_count,
        100.0 * family.confidence
    )
}
