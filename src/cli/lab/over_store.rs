//! The arguments of every command that flies a recorded flight over a store.

use crate::cli::attitude_note::attitude_note;
use crate::cli::chosen_layer::chosen_layer;
use crate::cli::failure::Failure;
use crate::cli::number::attitude_sigma;
use crate::cli::output::Output;
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
    /// One standard deviation of pitch and of roll, degrees in [0, 20]: 0 for frames that look exactly as stated
    /// [default: flight.csv's, else camera.toml's, else 2 where both are stated, else 5].
    #[arg(long, value_name = "DEG", value_parser = attitude_sigma)]
    pub attitude_sigma_deg: Option<f64>,
}

impl FlightOverStore {
    /// Reads the flight and opens the store; notes how exactly the attitude is taken to be known.
    ///
    /// # Errors
    /// If either cannot be read.
    pub fn open(&self, output: &Output) -> Result<(RecordedFlight, Reader), Failure> {
        self.with_store(RecordedFlight::read(&self.flight)?, output)
    }

    /// As [`FlightOverStore::open`], for a replay: absurd rows do not end a flight.
    ///
    /// # Errors
    /// If flight or store cannot be read.
    pub fn open_with_absurd_rows(&self, output: &Output) -> Result<(RecordedFlight, Reader), Failure> {
        self.with_store(RecordedFlight::read_with_absurd_rows(&self.flight)?, output)
    }

    fn with_store(&self, flight: RecordedFlight, output: &Output) -> Result<(RecordedFlight, Reader), Failure> {
        let flight = match self.attitude_sigma_deg {
            Some(sigma_deg) => flight.with_attitude_sigma_rad(sigma_deg.to_radians()),
            None => flight,
        };
        output.note(&attitude_note(flight.frames.iter().map(|frame| frame.attitude)));
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
