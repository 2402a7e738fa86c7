//! `overfly fix --pictures`: one registration as pictures.

use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::output::Output;
use overfly_flight::frame::read_colour_frame;
use overfly_flight::locate::{Answer, FixRequest, Trace};
use overfly_lab::explain::Explanation;
use overfly_store::Reader;
use std::path::{Path, PathBuf};

/// The flag for pictures.
#[derive(clap::Args)]
pub struct Pictures {
    /// Write pictures of the registration here, and an index.html that shows them: the frame and what of it was compared, the
    /// correlation peaks, and the windows that agree.
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
}

impl Pictures {
    /// Whether pictures are asked for: then the registration must be traced.
    pub fn are_requested(&self) -> bool {
        self.pictures.is_some()
    }

    /// Writes the pictures, if they are asked for.
    ///
    /// # Errors
    /// If the store or the frame cannot be read, or a file cannot be written.
    pub fn write(
        &self,
        store: &Reader,
        image: &Path,
        request: &FixRequest,
        answer: &Answer,
        trace: &Trace,
        output: &Output,
    ) -> Result<(), Failure> {
        let Some(folder) = &self.pictures else { return Ok(()) };
        make_folder(folder)?;
        let colour = read_colour_frame(image)?;
        for (name, bytes) in Explanation::new(store, &colour, request, answer, trace)?.pages() {
            output.write(&folder.join(name), &bytes)?;
        }
        Ok(())
    }
}
