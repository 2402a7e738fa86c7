//! How a service is: what it has found wrong with its store since it was started, and what it was told to warn of.

use super::state::ServiceState;
use serde::Serialize;
use utoipa::ToSchema;

/// In which state a store is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum State {
    /// Nothing was found wrong.
    Good,
    /// Some tiles are damaged: they are neither served nor matched; the rest is.
    Degraded,
}

/// How a service is.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(super) struct Health {
    /// Good or degraded.
    pub state: State,
    /// Tiles found damaged.
    pub damaged_tiles: usize,
    /// Why it is degraded.
    pub reasons: Vec<String>,
    /// What is told of and not refused: layers older than they should be.
    pub warnings: Vec<String>,
}

impl Health {
    /// Of a service now.
    pub fn of(state: &ServiceState) -> Self {
        let damage = state.store.damage();
        let more = damage.tiles.saturating_sub(1);
        let told = |first: String| if more > 0 { format!("{first}; and {more} more tiles") } else { first };
        let reasons: Vec<String> = damage.first.map(told).into_iter().collect();
        let is = if reasons.is_empty() { State::Good } else { State::Degraded };
        Self { state: is, damaged_tiles: damage.tiles, reasons, warnings: state.warnings.to_vec() }
    }

    /// As text: `well` or "degraded", then a line for each reason and warning.
    pub fn text(&self, well: &str) -> String {
        let head = if self.state == State::Good { well } else { "degraded" };
        let reasons = self.reasons.iter().map(|r| format!("degraded: {r}\n"));
        let warnings = self.warnings.iter().map(|w| format!("warning: {w}\n"));
        format!("{head}\n{}", reasons.chain(warnings).collect::<String>())
    }
}
