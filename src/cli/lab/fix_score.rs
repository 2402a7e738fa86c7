//! What `demo`, `fly` and `evaluate fixes` have in common: when a fix is right, and the score as text.

use crate::cli::failure::Failure;
use crate::cli::lab::integrity_args::integrity_text;
use overfly_lab::trial::{FixScore, Quantiles, Refusals};
use overfly_store::{Layer, Reader};

/// The greatest error of a right fix, metres: three ground pixels of the layer's coarsest source.
///
/// # Errors
/// If the store cannot be read.
pub fn default_right_m(store: &Reader, layer: &Layer) -> Result<f64, Failure> {
    let coarsest = store.sources(layer)?.iter().map(|s| s.gsd_m_per_px).fold(0.0, f64::max);
    Ok(3.0 * coarsest)
}

/// The score as text.
pub fn fix_text(score: &FixScore) -> String {
    let spread = |s: &Option<Quantiles>, digits: usize| {
        s.map_or("none".into(), |s| {
            format!("median {:.digits$}, 95 % {:.digits$}, max {:.digits$}", s.median, s.p95, s.max)
        })
    };
    format!(
        "frames     {} ({} fixes, {} no fix)\n{}right      {} (within {:.2} m)\nfalse      {}\nerror      {} m\n\
         ellipse    {} of the fixes have the truth in their own 95 % ellipse (half axis {} m)\n\
         NEES       {}\n\
         protection {}\n\
         elapsed    {} ms per frame on {} threads (decoding {})\ntiles      {} searched",
        score.frames,
        score.fixes,
        score.no_fix,
        refusals_text(score),
        score.right,
        score.right_m,
        score.wrong,
        spread(&score.error_m, 2),
        score.ellipse95_coverage.map_or("none".into(), |c| format!("{:.1} %", 100.0 * c)),
        spread(&score.semi_major_95_m, 2),
        score.nees.map_or("none".into(), |n| {
            let [low, high] = n.band95;
            format!("mean {:.2} (true covariances: {low:.2} to {high:.2}), trimmed {:.2}", n.mean, n.trimmed_mean)
        }),
        integrity_text(&score.integrity),
        spread(&score.elapsed_ms, 0),
        score.threads,
        spread(&score.decode_ms, 1),
        spread(&score.tiles_searched, 0),
    )
}

/// What refused frames, and which share of them.
fn refusals_text(score: &FixScore) -> String {
    let share = |frames: usize| 100.0 * frames as f64 / score.no_fix as f64;
    let one = |r: &Refusals| format!("{} {} ({:.0} %)", r.frames, r.reason.word().replace('_', " "), share(r.frames));
    let all = score.refusals.iter().map(one).collect::<Vec<_>>().join(", ");
    if all.is_empty() { all } else { format!("refused    {all}\n") }
}
