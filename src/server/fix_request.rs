//! `fix_request`: the request for a fix, from what a caller states.

use super::dto::FixParametersJson;
use super::error::ServerError;
use overfly_flight::locate::{FixParameters, FixRequest, requested_layer};
use overfly_store::Reader;

/// Returns the request over the stated layer of a store, over all of them ([`overfly_store::ANY_LAYER`]), or over its default layer.
///
/// # Errors
/// [`ServerError::Candidates`] where the store has no such layer, or none is stated and none is the default; [`ServerError::Locate`].
pub(super) fn fix_request(store: &Reader, parameters: &FixParametersJson) -> Result<FixRequest, ServerError> {
    let layer = requested_layer(store, parameters.layer.as_deref())?;
    Ok(FixParameters::from(parameters).request(&layer)?)
}
