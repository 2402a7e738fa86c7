//! The demo's flight in a closed loop.

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use overfly_core::coupling::Mode;
use overfly_flight::navigate::{ExecutionTimes, NavigateOptions};
use overfly_lab::report::{Mosaic, ReplayedFlight, replay_html};
use overfly_lab::trial::{Disturbances, FlyOutcome, FlyScore, FlyTrial, RecordedFlight};
use overfly_store::Reader;

const MODES: [Mode; 3] = [Mode::Sequential, Mode::Parallel, Mode::Combined];

/// The flight in each mode.
pub struct DemoFlown {
    outcomes: Vec<Vec<FlyOutcome>>,
    /// The score of each mode.
    pub scores: Vec<FlyScore>,
    execution_times: ExecutionTimes,
}

/// Flies in the paper's three modes, starting from the true position.
pub fn fly(
    store: &Reader,
    flight: &RecordedFlight,
    layer: &str,
    right_m: f64,
    threads: usize,
    output: &Output,
) -> Result<DemoFlown, Failure> {
    let options = |mode| NavigateOptions { layer: layer.into(), mode, threads, ..NavigateOptions::default() };
    let trial = FlyTrial { store, flight, disturbances: Disturbances::default() };
    let bar = output.progress((flight.frames.len() * (MODES.len() + 1)) as u64, "images");
    let reckoned = trial.reckon(&options(Mode::RelativeOnly), |_| bar.inc(1))?;
    let mut outcomes = Vec::new();
    for mode in MODES {
        outcomes.push(trial.run(&options(mode), |_| bar.inc(1))?);
    }
    bar.finish_and_clear();
    let scores =
        MODES.iter().zip(&outcomes).map(|(mode, o)| FlyScore::from_outcomes(*mode, o, &reckoned, right_m)).collect();
    Ok(DemoFlown { outcomes, scores, execution_times: options(Mode::Auto).execution_times })
}

impl DemoFlown {
    /// A line per mode.
    pub fn text(&self) -> String {
        let line = |score: &FlyScore| {
            let error =
                score.position_error_m.map_or("none".into(), |e| format!("{:.1} m, 95 % {:.1} m", e.median, e.p95));
            let (mode, fixes, images) = (score.mode.word(), score.fixes, score.frames);
            format!(
                "flown      {mode:<10} {images} positions off by {error}; {fixes} fixes, {} of them false\n",
                score.wrong
            )
        };
        self.scores.iter().map(line).collect()
    }

    /// Tracks, errors and chronograms.
    pub fn page(&self, mosaic: &Mosaic) -> String {
        let execution_times = self.execution_times;
        let modes: Vec<ReplayedFlight> = self
            .outcomes
            .iter()
            .zip(&self.scores)
            .map(|(outcomes, score)| {
                let protected = FlyOutcome::protected_errors(outcomes, score.integrity.integrity_risk);
                ReplayedFlight { outcomes, score, protected, execution_times }
            })
            .collect();
        replay_html("overfly: the demo's flight in the three coupling modes", mosaic, &modes)
    }
}
