//! The folder that a command writes its results to.

use crate::cli::failure::Failure;
use anyhow::Context;
use std::path::Path;

/// Makes the folder for the results, before anything is computed for it.
///
/// # Errors
/// If the folder cannot be made.
pub fn make_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))
        .map_err(|e| Failure::failed("unwritable", e))
}
