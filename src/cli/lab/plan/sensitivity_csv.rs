//! sensitivity.csv: what the models predict with one parameter changed.

use overfly_ingest::plan::Sensitivity;
use serde::Serialize;

/// A row; an empty cell means that there is no such number.
#[derive(Serialize)]
struct SensitivityRow<'a> {
    parameter: &'a str,
    factor: String,
    sequential_max_speed_mps: String,
    max_relative_count: String,
    max_mission_s: String,
    parallel_stable_s: String,
    combined_max_speed_mps: String,
}

/// The rows as CSV with a header, numbers with six decimals.
pub fn sensitivity_csv(rows: &[Sensitivity]) -> Vec<u8> {
    let number = |v: f64| format!("{v:.6}");
    let cell = |v: Option<f64>| v.map(number).unwrap_or_default();
    let mut table = csv::Writer::from_writer(Vec::new());
    for r in rows {
        let row = SensitivityRow {
            parameter: r.parameter,
            factor: r.factor.to_string(),
            sequential_max_speed_mps: number(r.sequential_max_speed_mps),
            max_relative_count: cell(r.max_relative_count),
            max_mission_s: cell(r.max_mission_s),
            parallel_stable_s: cell(r.parallel_stable_s),
            combined_max_speed_mps: number(r.combined_max_speed_mps),
        };
        table.serialize(row).expect("a vector takes every row");
    }
    table.into_inner().expect("a vector takes every row")
}
