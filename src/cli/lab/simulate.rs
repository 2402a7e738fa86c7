//! `overfly simulate`: thousands of drawn flights, simulated against predicted.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::output::Output;
use crate::cli::threads::default_threads;
use overfly_lab::report::{simulation_html, simulation_svgs};
use overfly_lab::trial::simulation::{
    BandComparison, Family, Simulation, SimulationSummary, read_simulation, summarize, write_simulation,
};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::PathBuf;

const HELP: &str = "\
SCENARIO.toml states errors, times and failures; docs/simulation/commented.toml has every field. Thousands of flights of hours are
drawn from it, and what happens is compared with what the models predict: failures (equations 11, 14), T0_max (16), settling times
(21, 22), covariances. No image is registered. Exit code 0 whether or not the predictions hold.

With --json: an object for each scenario and mode, then one for all comparisons. --out writes simulation.csv, summary.json, the plots,
and the page simulation.html.

Examples:
  overfly simulate docs/simulation/paper.toml --out simulated
  overfly simulate docs/simulation/store.toml --db map.gpkg --out over-the-map";

/// Arguments of `simulate`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The scenario: a TOML file.
    #[arg(value_name = "SCENARIO")]
    scenario: PathBuf,
    /// Fly over this store; for a scenario with a table [store].
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,
    /// Flights at a time; the results do not depend on it.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: NonZeroUsize,
    /// Write simulation.csv, summary.json, the plots and simulation.html here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// The content of summary.json.
#[derive(Serialize)]
struct SummaryFile<'a> {
    #[serde(flatten)]
    family: Family,
    scenarios: &'a [SimulationSummary],
}

/// Runs the command. A prediction that does not hold is a result, not a failure.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let file = &args.scenario;
    let mut variations = read_simulation(file)?;
    if let Some(db) = &args.db {
        let mut stores = variations.iter_mut().filter_map(|v| v.scenario.store.as_mut()).peekable();
        if stores.peek().is_none() {
            let reason = format!("--db: {} has no table [store], which says how to fly over one", file.display());
            return Err(Failure::unusable("usage", anyhow::anyhow!(reason)));
        }
        stores.for_each(|store| store.path = Some(db.into()));
    }
    args.out.as_deref().map_or(Ok(()), make_folder)?;
    let simulation = Simulation { path: file.clone(), variations, threads: args.threads.get() };
    let bar = output.progress(simulation.flights(), "flights");
    let flown = simulation.run(|| bar.inc(1))?;
    bar.finish_and_clear();
    let (summaries, family) = summarize(&flown);
    if let Some(folder) = &args.out {
        output.note(&format!("wrote {}", write_simulation(folder, &flown)?.display()));
        let written = serde_json::to_vec_pretty(&SummaryFile { family, scenarios: &summaries }).expect("plain numbers");
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
