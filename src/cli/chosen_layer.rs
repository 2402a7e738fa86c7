//! The layer that a command reads.

use crate::cli::failure::Failure;
use overfly_flight::locate::candidates::{default_layer, named_layer};
use overfly_store::{Layer, Reader};

/// The layer with the given name; without a name, the only layer, or `ortho` if there are several.
///
/// # Errors
/// If the store has no such layer, or several layers and none is called `ortho`.
pub fn chosen_layer<'a>(store: &'a Reader, name: Option<&str>) -> Result<&'a Layer, Failure> {
    Ok(match name {
        Some(name) => named_layer(store, name)?,
        None => default_layer(store)?,
    })
}
