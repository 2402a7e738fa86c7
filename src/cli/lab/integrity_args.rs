//! `IntegrityArgs`: for which risk protection levels are stated, and up to which they are of use.

use crate::cli::number::{positive_metres, risk};
use overfly_core::integrity::DEFAULT_INTEGRITY_RISK;
use overfly_lab::trial::{IntegrityScore, ProtectedError};

/// For which risk protection levels are stated, and up to which they are of use.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct IntegrityArgs {
    /// Integrity risk of the protection levels: the probability with which an error may exceed its level without warning.
    #[arg(long, value_name = "P", value_parser = risk, default_value_t = DEFAULT_INTEGRITY_RISK)]
    pub integrity_risk: f64,
    /// The largest protection level with which a position is of use, metres: then availability counts only these.
    #[arg(long, value_name = "M", value_parser = positive_metres)]
    pub alert_limit_m: Option<f64>,
}

impl IntegrityArgs {
    /// Scores positions.
    pub fn score(&self, errors: &[ProtectedError]) -> IntegrityScore {
        IntegrityScore::from_errors(errors, self.integrity_risk, self.alert_limit_m)
    }
}

/// The score as text, without a name.
pub fn integrity_text(score: &IntegrityScore) -> String {
    let levels = score
        .protection_level_m
        .map_or("none".into(), |s| format!("median {:.1}, 95 % {:.1}, max {:.1} m", s.median, s.p95, s.max));
    let limit = score.alert_limit_m.map_or(String::new(), |limit_m| format!(" of at most {limit_m} m"));
    format!(
        "{levels} at a risk of {:e}; {} of {} exceeded; {:.1} % have one{limit}",
        score.integrity_risk,
        score.misleading,
        score.protected_count,
        100.0 * score.availability.unwrap_or(0.0),
    )
}
