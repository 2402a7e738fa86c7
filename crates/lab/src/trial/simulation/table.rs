//! `simulation.csv`: a row per flight, from which others can recompute the summary.

use super::Flown;
use super::tally::Tally;
use crate::trial::TrialError;
use crate::trial::fix_table::{quoted, write_table};
use std::fmt::Write;
use std::path::{Path, PathBuf};

const HEADER: &str = "variation,mode,flight,absolute_count,failures,drawn,outside_region,no_map,false_fixes,after_failure_count,\
after_failure_failures,first_failure_s,execution_s,last_execution_s,nominal_count,lost,nees,error_m";

/// Writes `simulation.csv` into a folder, made where absent, and returns its path. Sums of a flight where a column of the summary
/// is a mean: `execution_s`, `nominal_count`.
///
/// # Errors
/// Where it cannot be written.
pub fn write_simulation(folder: &Path, flown: &[Flown]) -> Result<PathBuf, TrialError> {
    let mut text = format!("{HEADER}\n");
    for f in flown {
        let name = quoted(&f.variation);
        for (flight, tally) in f.tallies.iter().enumerate() {
            let _ = writeln!(text, "{name},{},{flight},{}", f.mode.word(), row(tally));
        }
    }
    write_table(folder, "simulation.csv", &text)
}

fn row(t: &Tally) -> String {
    let optional = |value: Option<f64>, digits: usize| value.map_or(String::new(), |v| format!("{v:.digits$}"));
    let track = t.track.as_deref();
    format!(
        "{},{},{},{},{},{},{},{},{},{:.6},{},{:.6},{},{},{}",
        t.absolute_count,
        t.failures,
        t.drawn,
        t.outside_region,
        t.no_map,
        t.false_fixes,
        t.after_failure[0],
        t.after_failure[1],
        optional(t.first_failure_s, 3),
        t.execution_s,
        optional(t.last_execution_s, 9),
        t.nominal_count,
        u8::from(t.is_lost),
        optional(track.and_then(|t| t.nees), 6),
        optional(track.and_then(|t| t.error_m), 4),
    )
}
