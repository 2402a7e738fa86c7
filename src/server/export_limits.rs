//! `ExportLimits`: how many finished exports the service keeps, and for how long.

use std::time::Duration;

/// How many finished exports the service keeps, and for how long. The one begun first is removed first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExportLimits {
    /// Most exports.
    pub count: usize,
    /// Most bytes of all exports; one that alone has more is refused.
    pub bytes: u64,
    /// Longest time for which an export is kept after it has ended.
    pub age: Duration,
}

impl Default for ExportLimits {
    fn default() -> Self {
        Self { count: 16, bytes: 20_000_000_000, age: Duration::from_secs(24 * 3600) }
    }
}
