//! A plan as text.

use crate::cli::lab::plan::summary::PlanSummary;
use overfly_ingest::plan::{Forecast, RouteForecast, Sensitivity};

/// The number with three significant digits; very small and very large ones with a power of ten.
fn short(value: f64) -> String {
    match value.abs() {
        v if v.is_infinite() => "without limit".into(),
        v if v == 0.0 || (1e-3..1e6).contains(&v) => {
            let digits = (2 - v.max(1e-3).log10().floor() as i32).clamp(0, 5) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.2e}"),
    }
}

fn maybe(value: Option<f64>) -> String {
    value.map_or("none".into(), short)
}

/// The plan as text.
pub fn text(summary: &PlanSummary) -> String {
    let f = summary.forecast;
    let mut text = format!("verdict    {}\n\n", summary.verdict);
    text += &[image_text(f), sequential_text(f), parallel_text(f), combined_text(f)].join("\n");
    let mode = f.advice.mode.map_or("none", |m| m.word());
    text.push_str(&format!("\nuse        {mode}: {}\n\n", f.advice.why));
    text.push_str(&sensitivity_text(summary.sensitivity));
    summary.route.inspect(|route| text.push_str(&route_text(route)));
    text.trim_end().to_owned()
}

fn works(fails: Option<&String>) -> String {
    fails.map_or("works".to_owned(), |why| format!("does not work: {why}"))
}

fn image_text(f: &Forecast) -> String {
    let p = &f.parameters;
    format!(
        "image      {} x {} m on the ground ({} m/px), left after {} s at {} m/s\n\
         K1         {} s an image, and {} s a search\nt0         {} s a relative registration\n\
         D_U        {} m, I {} m\n",
        short(p.across_m),
        short(p.along_m),
        short(f.gsd_m_per_px),
        short(f.scan_limit_s),
        short(p.speed_mps),
        short(p.seconds_per_tile),
        short(p.search_constant_s),
        short(p.relative_s),
        short(p.unit_drift_m),
        short(p.inaccuracy_m),
    )
}

fn sequential_text(f: &Forecast) -> String {
    let s = &f.sequential;
    let best = match s.best_relative_count {
        None => "none".into(),
        Some(u64::MAX) => "without limit".into(),
        Some(n) => n.to_string(),
    };
    format!(
        "sequential {}\n  v_max    {} m/s (7)\n  n_max    {} (8)\n  n_opt    {best} (13); as printed, {}\n\
         \x20 at n_opt t_exe {} s over {} images, p {} (5), a cycle of {} s\n\
         \x20 T0_max   {} s (16): less than one failure expected; as printed {} s; at most 5 % chance of one: {} s\n",
        works(s.fails.as_ref()),
        short(s.max_speed_mps),
        maybe(s.max_relative_count),
        short(s.optimal_relative_count_paper),
        maybe(s.execution_s),
        maybe(s.nominal_count),
        maybe(s.failure_probability),
        maybe(s.cycle_s),
        maybe(s.max_mission_s),
        short(s.max_mission_paper_s),
        maybe(s.mission_within_risk_s),
    )
}

fn parallel_text(f: &Forecast) -> String {
    let l = &f.parallel;
    format!(
        "parallel   {}\n  settles  at {} s over {} images; t1 {} s (21), t2 {} s (22): so long it holds without a fix\n\
         \x20 D_U      up to {} m; speed up to {} m/s (b / t0)\n",
        works(l.fails.as_ref()),
        maybe(l.settles_at_s),
        maybe(l.nominal_count),
        maybe(l.stable_s),
        maybe(l.unstable_s),
        short(l.max_unit_drift_m),
        short(l.max_speed_mps),
    )
}

fn combined_text(f: &Forecast) -> String {
    let c = &f.combined;
    format!(
        "combined   {}\n  settles  at {} s over {} images; fixed points {} and {} s\n\
         \x20 v_max    {} m/s; as printed (b / K1) {} m/s\n  turn     a quarter takes {} s; beyond it no bound is claimed\n",
        works(c.fails.as_ref()),
        maybe(c.settles_at_s),
        maybe(c.nominal_count),
        maybe(c.stable_s),
        maybe(c.unstable_s),
        short(c.max_speed_mps),
        short(c.max_speed_paper_mps),
        short(c.quarter_turn_s),
    )
}

fn sensitivity_text(rows: &[Sensitivity]) -> String {
    let head = "  sensitivity           v_max, m/s    n_max   T0_max, s   parallel t1, s   combined v_max, m/s\n";
    let rows = rows.iter().map(|r| {
        format!(
            "  {:<17} x{:<4} {:>10} {:>8} {:>11} {:>16} {:>21}\n",
            r.parameter,
            r.factor,
            short(r.sequential_max_speed_mps),
            maybe(r.max_relative_count),
            maybe(r.max_mission_s),
            maybe(r.parallel_stable_s),
            short(r.combined_max_speed_mps)
        )
    });
    std::iter::once(head.to_owned()).chain(rows).collect()
}

fn route_text(route: &RouteForecast) -> String {
    let (gap, t) = (&route.longest_gap, &route.thresholds);
    let holds = |holds: bool| if holds { "still settles" } else { "does not" };
    format!(
        "\nroute      {:.0} m in {} images, {:.0} m apart\n\
         fixes      expected in {:.1} % of the images, map in {:.1} % (from {} of the image, {} keypoints a tile, distinctiveness {})\n\
         longest    gap from {:.0} to {:.0} m: {} s, {} relative registrations, drift {} m\n\
         at its end a search of {} images, {} s; the parallel mode {} after it, the combined {}{}\n",
        route.length_m,
        route.steps.len(),
        route.step_m,
        100.0 * route.with_fix,
        100.0 * route.with_map,
        t.least_covered,
        t.least_keypoints,
        t.least_distinctiveness,
        gap.from_m,
        gap.to_m,
        short(gap.duration_s),
        short(gap.relative_count),
        short(gap.drift_m),
        short(gap.nominal_count),
        short(gap.execution_s),
        holds(gap.parallel_holds),
        holds(gap.combined_holds),
        gap.combined_nominal_count.map_or(" (more than a quarter of a turn: no bound is claimed)".into(), |n| {
            format!(" ({} images with absolute registrations alone)", short(n))
        }),
    )
}
