//! What `calibrate` and `experiment` have in common: registering the pairs, and the fitted laws as text.

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use overfly_core::coupling::PixelDriftLaw;
use overfly_lab::trial::{RelativeLaws, RelativeMeasurement, RelativeTrial};

/// Registers all pairs of a trial, with a progress bar; if JSON is requested, prints one line for each.
///
/// # Errors
/// If the photos cannot be read or are too small.
pub fn measure(trial: &RelativeTrial, output: &Output) -> Result<RelativeMeasurement, Failure> {
    let bar = output.progress(trial.count() as u64, "registrations");
    let measured = trial.run(|sample| {
        bar.inc(1);
        if output.is_json() {
            output.say(sample, String::new);
        }
    });
    bar.finish_and_clear();
    Ok(measured?)
}

/// The laws as text, with one line for each number of descriptors.
pub fn laws_text(laws: &RelativeLaws) -> String {
    let r = &laws.relative;
    let law = |law: Option<PixelDriftLaw>| {
        law.map_or("none".into(), |l| format!("sqrt({:.4}^2 + {:.3}^2 / n) px", l.floor_px, l.pair_drift_px))
    };
    let mut text = format!(
        "A_c        {:.2} us a descriptor      (42)\nL          {:.2} ms                  (42)\n\
         t0         {:.2} ns a comparison      (43)\nB          {:.2} ns a descriptor      (44)\n\
         t_c        {:.2} ms                  (45)\n\
         T_exe      {:.1} ms a relative registration of {:.0} descriptors, {:.0} of them matched (45): t0 of (9)\n\
         D_U        {}; keypoints alone {}\n\n  \
         limit      N  loading  matching, ms  threshold, us  agreement  estimate     all, ms     n  drift, px  keypoints alone  registered\n",
        1e6 * r.seconds_per_descriptor,
        1e3 * r.load_s,
        1e9 * r.pair_comparison_s,
        1e9 * r.threshold_s_per_descriptor,
        1e3 * r.estimate_s,
        1e3 * laws.relative_s,
        laws.descriptor_count,
        laws.matched_count,
        law(laws.program.law),
        law(laws.keypoints.law),
    );
    for row in &laws.rows {
        let number = |v: Option<f64>, digits: usize| v.map_or("none".into(), |v| format!("{v:.digits$}"));
        text.push_str(&format!(
            "  {:>5} {:>6.0} {:>8.3} {:>13.3} {:>14.3} {:>10.3} {:>9} {:>11} {:>5.0} {:>10} {:>16}  {} of {}\n",
            row.limit,
            row.descriptors,
            1e3 * row.times.loading_s,
            1e3 * row.times.matching_s,
            1e6 * row.times.threshold_s,
            1e3 * row.times.agreement_s,
            number(row.times.estimate_s.map(|s| 1e3 * s), 3),
            number(row.total_s.map(|s| 1e3 * s), 3),
            row.matched,
            number(row.drifts.drift_px, 4),
            number(row.drifts.keypoint_drift_px, 4),
            row.registered,
            row.pairs,
        ));
    }
    text.trim_end().to_owned()
}
