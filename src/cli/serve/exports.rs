//! The flags of `overfly serve` that bound the exports it keeps.

use crate::cli::number::{memory_bytes, positive};
use crate::server::ExportLimits;
use std::time::Duration;

/// How many exports over HTTP are kept, and for how long. The one begun first is removed first.
#[derive(Debug, clap::Args)]
pub struct ExportArgs {
    /// Keep at most N exports of `POST /v1/exports`.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..), conflicts_with = "onboard")]
    keep_exports: u16,
    /// Keep exports of at most SIZE together, such as 500MB or 20GB; a larger one is refused.
    #[arg(long, value_name = "SIZE", default_value = "20GB", value_parser = memory_bytes, conflicts_with = "onboard")]
    keep_exports_bytes: u64,
    /// Remove exports H hours after they have ended.
    #[arg(long, value_name = "H", default_value = "24", value_parser = hours, conflicts_with = "onboard")]
    keep_exports_h: Duration,
}

impl ExportArgs {
    /// The limits that the flags state.
    pub fn limits(&self) -> ExportLimits {
        ExportLimits { count: self.keep_exports.into(), bytes: self.keep_exports_bytes, age: self.keep_exports_h }
    }
}

/// Parses hours.
fn hours(text: &str) -> Result<Duration, String> {
    Duration::try_from_secs_f64(positive(text)? * 3600.0).map_err(|e| e.to_string())
}
