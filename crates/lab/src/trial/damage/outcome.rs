//! `DamageOutcome`: the result of one trial.

use super::change::FileChange;
use super::format::FrameFormat;
use overfly_core::geodesy::CHI_SQUARE_9999;

/// What became of a changed frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DamageResult {
    /// It was refused, with this code word.
    Refused(&'static str),
    /// It has the same pixels as before, so it is located as before.
    Unchanged,
    /// It has other pixels, and no fix was found.
    NoFix,
    /// It has other pixels, and this fix.
    Fix {
        /// Distance from the truth, metres.
        error_m: f64,
        /// Squared Mahalanobis distance from the truth, by the fix's own covariance.
        squared_mahalanobis: f64,
    },
}

/// The result of one trial.
#[derive(Debug, Clone, PartialEq)]
pub struct DamageOutcome {
    /// Number of the trial within its format.
    pub number: usize,
    /// The format of the file.
    pub format: FrameFormat,
    /// What was changed.
    pub change: FileChange,
    /// Name in `flight.csv`.
    pub image: String,
    /// What became of it.
    pub result: DamageResult,
    /// Share of the pixels that differ by more than 8 gray levels from those of the sound file.
    pub changed_share: f64,
}

impl DamageOutcome {
    /// Whether it ended in a fix farther than `right_m` from the truth.
    pub fn is_false(&self, right_m: f64) -> bool {
        matches!(self.result, DamageResult::Fix { error_m, .. } if error_m > right_m)
    }

    /// Whether it is false and does not say so: the truth lies outside the fix's own 99.99 % ellipse.
    pub fn is_outside(&self, right_m: f64) -> bool {
        // Not a number counts as outside.
        let is_inside = |square: f64| square <= CHI_SQUARE_9999;
        self.is_false(right_m)
            && matches!(self.result, DamageResult::Fix { squared_mahalanobis, .. } if !is_inside(squared_mahalanobis))
    }
}
