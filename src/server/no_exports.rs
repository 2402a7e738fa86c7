//! Stands in for `exports` in a program that is built without the feature `preflight`.

use super::state::ServiceState;
use utoipa_axum::router::OpenApiRouter;

/// No routes.
pub(super) fn routes(_: &ServiceState) -> OpenApiRouter<ServiceState> {
    OpenApiRouter::new()
}
