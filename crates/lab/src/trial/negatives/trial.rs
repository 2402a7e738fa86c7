//! `NegativeTrial`: the options of a trial of negatives.

use super::kind::NegativeKind;
use crate::trial::error::TrialError;

/// The options of a trial.
#[derive(Debug, Clone)]
pub struct NegativeTrial {
    /// Layer to search.
    pub layer: String,
    /// Number of trials, spread evenly over kinds and regions.
    pub trials: usize,
    /// Seed of everything random. The same seed gives the same trials with any number of threads.
    pub seed: u64,
    /// Half width of the usual square, metres.
    pub prior_error_m: f64,
    /// Areas to search, in usual squares.
    pub regions: Vec<f64>,
    /// Kinds of negatives to try.
    pub kinds: Vec<NegativeKind>,
    /// Share of trials without a stated heading ([`NegativeKind::Turned`] always states one).
    pub unknown_heading_share: f64,
    /// One standard deviation stated for the heading, degrees.
    pub heading_sigma_deg: f64,
    /// One standard deviation stated for the height, as a ratio.
    pub height_sigma_ratio: f64,
    /// Greatest error of a right fix, metres, in the kinds where frame and map repeat themselves together.
    pub right_m: f64,
    /// Trials at the same time; each search has one thread.
    pub threads: usize,
}

impl NegativeTrial {
    /// Whether all options are in range.
    ///
    /// # Errors
    /// [`TrialError::Option`] with the first that is not.
    pub fn check(&self) -> Result<(), TrialError> {
        let refuse = |name, value: f64, expected| Err(TrialError::Option { name, value, expected });
        let positive = |name, value: f64, expected| {
            if value.is_finite() && value > 0.0 { Ok(()) } else { refuse(name, value, expected) }
        };
        positive("prior_error_m", self.prior_error_m, "a positive number of metres")?;
        positive("heading_sigma_deg", self.heading_sigma_deg, "a positive number of degrees")?;
        positive("height_sigma_ratio", self.height_sigma_ratio, "a positive ratio")?;
        positive("right_m", self.right_m, "a positive number of metres")?;
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
}
