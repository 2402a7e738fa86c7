//! The three arguments of every command that flies a recorded flight over a store.

use crate::cli::failure::Failure;
use crate::cli::layer::chosen_layer;
use overfly_lab::trial::RecordedFlight;
use overfly_store::{Layer, Reader};
use std::path::PathBuf;

/// A recorded flight over a store.
#[derive(clap::Args)]
pub struct FlightOverStore {
    /// The store.
    #[arg(long, value_name = "FILE")]
    pub db: PathBuf,
    /// The flight: a folder with flight.csv, camera.toml and images.
    #[arg(long, value_name = "DIR")]
    pub flight: PathBuf,
    /// Which layer [default: the only one, or ortho].
    #[arg(long, value_name = "NAME")]
    pub layer: Option<String>,
}

impl FlightOverStore {
    /// Reads the flight and opens the store.
    ///
    /// # Errors
    /// If either cannot be read.
    pub fn open(&self) -> Result<(RecordedFlight, Reader), Failure> {
        let flight = RecordedFlight::read(&self.flight)?;
        Ok((flight, Reader::open(&self.db)?))
    }

    /// Returns the layer to fly over.
    ///
    /// # Errors
    /// See [`chosen_layer`].
    pub fn layer<'a>(&self, store: &'a Reader) -> Result<&'a Layer, Failure> {
        chosen_layer(store, self.layer.as_deref())
    }
}
