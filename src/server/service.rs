//! `Service`: where the service runs.

/// Where the service runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Service {
    /// On the ground.
    Preflight,
    /// On the aircraft: no route writes.
    Onboard,
}
