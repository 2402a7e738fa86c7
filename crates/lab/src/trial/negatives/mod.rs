//! `evaluate negatives`: searches in which every fix is false.
//!
//! A trial takes a frame of a flight and spoils it, or the region, in one of the ways of [`Kind`]; what the search
//! answers shows how often it is falsely sure, and whether the accidents it states are those that happen.

mod altered;
mod bench;
mod bound;
mod drawn;
mod ground;
mod kind;
mod score;
mod table;

pub(super) use ground::MappedGround;
pub use kind::Kind;
pub use score::{CalibrationStep, KindScore, NegativeScore, RegionScore};
pub use table::write_negatives;

use super::{Flight, TrialError};
use bench::Bench;
use overfly_core::geodesy::Geodetic;
use overfly_flight::locate::Answer;
use overfly_store::Reader;
use rayon::prelude::*;

/// What is tried.
#[derive(Debug, Clone)]
pub struct NegativeTrial {
    /// Layer to search.
    pub layer: String,
    /// How many, over all kinds and regions alike.
    pub trials: usize,
    /// Of everything that is drawn: the same seed, the same trials, whatever the number of threads.
    pub seed: u64,
    /// Half width of the usual square, metres.
    pub prior_error_m: f64,
    /// Areas to search, in usual squares.
    pub regions: Vec<f64>,
    /// Kinds to try.
    pub kinds: Vec<Kind>,
    /// Share of trials that state no heading ([`Kind::Turned`] always states one).
    pub unknown_heading_share: f64,
    /// One standard deviation stated for the heading, degrees.
    pub heading_sigma_deg: f64,
    /// One standard deviation stated for the height, as a ratio.
    pub height_sigma_ratio: f64,
    /// Trials at a time; each search has one thread.
    pub threads: usize,
}

/// One trial and what came of it.
#[derive(Debug, Clone)]
pub struct NegativeOutcome {
    /// Counted from 0.
    pub number: usize,
    /// Why a fix is false.
    pub kind: Kind,
    /// Area searched, in usual squares, as asked for.
    pub region: f64,
    /// The frame, as `flight.csv` names it.
    pub image: String,
    /// Whether the heading was stated.
    pub is_heading_known: bool,
    /// The search; `None` where the layer has no room for such a region away from the frame.
    pub search: Option<NegativeSearch>,
}

/// A search that was made.
#[derive(Debug, Clone)]
pub struct NegativeSearch {
    /// The middle of the square.
    pub prior: Geodetic,
    /// Area of the imagery within the square, in usual squares.
    pub searched_ratio: f64,
    /// What came of it.
    pub answer: Answer,
    /// From the frame in memory to the answer, milliseconds.
    pub elapsed_ms: f64,
}

impl NegativeOutcome {
    /// Whether the search was falsely sure.
    pub fn is_accepted(&self) -> bool {
        self.search.as_ref().is_some_and(|s| matches!(s.answer, Answer::Fix(_)))
    }

    /// What the search itself expected of such an accident; `None` where it was not made, or found nothing that agrees.
    pub fn log10_false_alarms(&self) -> Option<f64> {
        match &self.search.as_ref()?.answer {
            Answer::Fix(fix) => fix.log10_false_alarms,
            Answer::NoFix(no_fix) => no_fix.log10_false_alarms,
        }
    }
}

impl NegativeTrial {
    fn check(&self) -> Result<(), TrialError> {
        let refuse = |name, value: f64, expected| Err(TrialError::Option { name, value, expected });
        let positive = |name, value: f64, expected| {
            if value.is_finite() && value > 0.0 { Ok(()) } else { refuse(name, value, expected) }
        };
        positive("prior_error_m", self.prior_error_m, "a positive number of metres")?;
        positive("heading_sigma_deg", self.heading_sigma_deg, "a positive number of degrees")?;
        positive("height_sigma_ratio", self.height_sigma_ratio, "a positive ratio")?;
        for &region in &self.regions {
            positive("regions", region, "positive areas, in usual squares")?;
        }
        if self.regions.is_empty() || self.kinds.is_empty() || self.trials == 0 {
            return refuse("trials", self.trials as f64, "at least one trial of one kind over one region");
        }
        if !(0.0..=1.0).contains(&self.unknown_heading_share) {
            return refuse("unknown_heading_share", self.unknown_heading_share, "a share from 0 to 1");
        }
        Ok(())
    }

    /// Makes all trials; `progress` is called after each. Without frames of a `foreign` flight that kind is left out.
    ///
    /// # Errors
    /// Where a frame has no truth or cannot be decoded, or the store fails. "No fix" is an outcome, and the wanted one.
    pub fn run(
        &self,
        store: &Reader,
        flight: &Flight,
        foreign: Option<&Flight>,
        progress: impl Fn(&NegativeOutcome) + Sync,
    ) -> Result<Vec<NegativeOutcome>, TrialError> {
        self.check()?;
        if let Some(frame) = flight.frames.iter().find(|f| f.true_position.is_none()) {
            return Err(TrialError::NoTruth { path: flight.path.clone(), line: frame.line });
        }
        let bench = Bench::new(self, store, flight, foreign)?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build().map_err(|_| {
            let expected = "a number of threads that this machine can start";
            TrialError::Option { name: "threads", value: self.threads as f64, expected }
        })?;
        let chunks = bench.chunks();
        let done: Result<Vec<Vec<NegativeOutcome>>, TrialError> = pool
            .install(|| chunks.par_iter().map(|(frame, numbers)| bench.try_all(*frame, numbers, &progress)).collect());
        let mut outcomes: Vec<NegativeOutcome> = done?.into_iter().flatten().collect();
        outcomes.sort_by_key(|o| o.number);
        Ok(outcomes)
    }
}
