//! Stands in for `pictures` in a program that is built without the feature `lab`: there is no flag, and nothing is drawn.

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use overfly_flight::locate::{Answer, FixRequest, Trace};
use overfly_store::Reader;
use std::path::Path;

/// No flag.
#[derive(clap::Args)]
pub struct Pictures {}

impl Pictures {
    /// No.
    pub fn are_requested(&self) -> bool {
        false
    }

    /// Does nothing.
    ///
    /// # Errors
    /// Never.
    pub fn write(
        &self,
        _: &Reader,
        _: &Path,
        _: &FixRequest,
        _: &Answer,
        _: &Trace,
        _: &Output,
    ) -> Result<(), Failure> {
        Ok(())
    }
}
