//! `ExportWarning`: what a planner must know about an export before the flight.

use crate::cli::replaced::newer_note;
use overfly_ingest::export::{CorridorCoverage, CoverageGap, coverage_gaps};
use overfly_store::Reader;
use overfly_store::package::stated_serial;
use serde::Serialize;
use std::path::Path;

/// A corridor narrower than this on each side, metres, is taken for a slip of the unit: priors are not that good, and no image is that
/// small.
const NARROW_M: f64 = 20.0;

/// A warning; the export is made all the same.
#[derive(Serialize)]
pub struct ExportWarning {
    /// A stable word for scripts.
    code: &'static str,
    /// The warning as text.
    pub message: String,
}

/// The warnings about an export. `layers` are those that were asked for by name, `corridor_m` is the width that was asked for and
/// `widest_m` the largest one, metres on each side.
pub fn export_warnings(
    store: &Reader,
    layers: &[String],
    coverage: &[CorridorCoverage],
    (corridor_m, widest_m): (f64, f64),
) -> Vec<ExportWarning> {
    let unfinished = store.layers().iter().filter(|l| !l.complete && layers.is_empty()).map(|l| ExportWarning {
        code: "unfinished_layer",
        message: format!(
            "layer {} is unfinished and is left out; run its `overfly build` again to finish it, and export again",
            l.name
        ),
    });
    let gaps = coverage_gaps(coverage);
    let leaves = (!gaps.is_empty()).then(|| ExportWarning {
        code: "route_leaves_map",
        message: format!(
            "the route leaves the map, which shows less than half of the corridor {}: expect no fix there",
            gaps.iter().map(place).collect::<Vec<_>>().join(", ")
        ),
    });
    let unknown = unknown_errors(store, layers);
    let unknown = (!unknown.is_empty()).then(|| ExportWarning {
        code: "unknown_error",
        message: format!(
            "nothing states the position error of layer {}: fixes count with half a pixel, at least 3 m; `overfly build --horizontal-error-m` states it",
            unknown.join(", ")
        ),
    });
    let narrow = (corridor_m < NARROW_M).then(|| ExportWarning {
        code: "narrow_corridor",
        message: format!(
            "the corridor is {corridor_m} m wide on each side, less than an image shows and a fix needs: --corridor-m takes metres, or a unit, as in {corridor_m}km"
        ),
    });
    let widened = (widest_m > corridor_m).then(|| ExportWarning {
        code: "corridor_widened",
        message: format!(
            "the corridor was widened from {corridor_m:.0} m to up to {widest_m:.0} m on each side, by the drift without a fix that --aircraft states"
        ),
    });
    unfinished.chain(narrow).chain(leaves).chain(widened).chain(unknown).collect()
}

/// The warning that an export takes the place of one with a higher serial.
pub fn newer_replaced(out: &Path, serial: Option<u64>) -> Option<ExportWarning> {
    Some(ExportWarning { code: "newer_replaced", message: newer_note(out, stated_serial(out), serial)? })
}

/// The layers among those asked for, or among all, that have a source of an unknown error.
fn unknown_errors(store: &Reader, layers: &[String]) -> Vec<String> {
    let is_unknown = |layer: &&overfly_store::Layer| {
        store.sources(layer).is_ok_and(|sources| sources.iter().any(|source| source.horizontal_error_m.is_none()))
    };
    let asked = store.imagery_layers().filter(|layer| layers.is_empty() || layers.contains(&layer.name));
    asked.filter(is_unknown).map(|layer| layer.name.clone()).collect()
}

fn place(gap: &CoverageGap) -> String {
    let of = if gap.route == 0 { String::new() } else { format!(" of alternate {}", gap.route) };
    let (from_km, to_km) = (gap.from_m / 1e3, gap.to_m / 1e3);
    if gap.to_m > gap.from_m {
        format!("from km {from_km:.1} to {to_km:.1}{of}")
    } else {
        format!("at km {from_km:.1}{of}")
    }
}
