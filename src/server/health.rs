//! `Health`: the damage found in the store since the service was started, and the warnings given at its start.

use super::error::ServerError;
use super::state::ServiceState;
use serde::Serialize;
use utoipa::ToSchema;

/// The state of a store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[schema(as = State)]
#[serde(rename_all = "snake_case")]
pub(super) enum StoreState {
    /// No damage was found.
    Good,
    /// Some tiles are damaged: they are neither served nor matched; all others are.
    Degraded,
}

/// The health of a service.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(super) struct Health {
    /// Good or degraded.
    pub state: StoreState,
    /// Number of damaged tiles found.
    pub damaged_tiles: usize,
    /// Why the store is degraded.
    pub reasons: Vec<String>,
    /// Time since the store took the place of another one, seconds; absent for the store of the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reopened_s: Option<f64>,
    /// BLAKE3 over the content of the store that is served.
    #[serde(skip)]
    digest: String,
    /// Warnings about a store that is served nevertheless, such as layers that are too old.
    pub warnings: Vec<String>,
}

impl Health {
    /// The health of a service now.
    pub fn from_state(state: &ServiceState) -> Self {
        let damage = state.store.reader.damage();
        let more = damage.tiles.saturating_sub(1);
        let described = |first: String| if more > 0 { format!("{first}; and {more} more tiles") } else { first };
        let refused = state.slot.refusal().map(|refusal| ServerError::Replaced(refusal).to_string());
        let reasons: Vec<String> = damage.first.map(described).into_iter().chain(refused).collect();
        let is = if reasons.is_empty() { StoreState::Good } else { StoreState::Degraded };
        Self {
            state: is,
            damaged_tiles: damage.tiles,
            reasons,
            reopened_s: state.store.reopened.map(|at| at.elapsed().as_secs_f64()),
            digest: state.store.reader.digest().to_owned(),
            warnings: state.store.warnings.to_vec(),
        }
    }

    /// The health as text: `well` or "degraded", then one line for each reason and warning, and for the store that took the place of another one.
    pub fn text(&self, well: &str) -> String {
        let head = if self.state == StoreState::Good { well } else { "degraded" };
        let reasons = self.reasons.iter().map(|r| format!("degraded: {r}\n"));
        let warnings = self.warnings.iter().map(|w| format!("warning: {w}\n"));
        let reopened = self.reopened_s.map(|s| format!("reopened: {s:.0} s ago, digest {}\n", self.digest));
        format!("{head}\n{}", reasons.chain(warnings).chain(reopened).collect::<String>())
    }
}
