//! `fix_request`: the request for a fix, from what a caller states.

use super::dto::FixParametersJson;
use super::error::ServerError;
use overfly_flight::locate::candidates::default_layer;
use overfly_flight::locate::{FixParameters, FixRequest};
use overfly_store::Reader;

/// Returns the request over the stated layer of a store, or over its default layer.
///
/// # Errors
/// [`ServerError::Store`], [`ServerError::Candidates`] where no layer is stated and none is the default, [`ServerError::Locate`].
pub(super) fn fix_request(store: &Reader, parameters: &FixParametersJson) -> Result<FixRequest, ServerError> {
    let layer = match &parameters.layer {
        Some(name) => store.layer(name)?,
        None => default_layer(store)?,
    };
    Ok(FixParameters::from(parameters).request(&layer.name)?)
}
