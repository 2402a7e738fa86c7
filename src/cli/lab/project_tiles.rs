//! The project's own tiles: drawn orthophotos and a sample flight over them.

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::preflight::remedy::explain_rejected;
use anyhow::anyhow;
use overfly_ingest::build;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// The layer that [`build_store`] makes.
pub const LAYER: &str = "ortho";

/// The given tiles/ folder, or the one of the sources that this program was built from.
///
/// # Errors
/// If the folder does not hold the map and the flight.
pub fn project_tiles(given: Option<&Path>) -> Result<PathBuf, Failure> {
    let tiles = given.map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("tiles"), Path::to_path_buf);
    if tiles.join("epoch_1").is_dir() && tiles.join("flight/flight.csv").is_file() {
        return Ok(tiles);
    }
    let remedy = "name the repository's tiles/ folder with --tiles DIR, or draw one with `cargo run --release -p overfly-lab --example generate_tiles -- --out DIR`";
    Err(Failure::unusable("no_tiles", anyhow!("{} holds no epoch_1/ and flight/: {remedy}", tiles.display())))
}

/// Builds a store from the map in a tiles/ folder.
///
/// # Errors
/// If the build fails or leaves an orthophoto out.
pub fn build_store(db: &Path, tiles: &Path, threads: usize, output: &Output) -> Result<build::BuildSummary, Failure> {
    let request = build::Request {
        db: db.to_owned(),
        layer: LAYER.into(),
        sources: vec![tiles.join("epoch_1")],
        date: Some("2018-06-12".into()),
        // Drawn: its places are exact.
        horizontal_error_m: Some(0.0),
        threads,
        replace_layer: true,
        ..build::Request::default()
    };
    let bar = output.progress(0, "tiles");
    let summary = build::run(&request, &mut |progress| {
        bar.set_length(progress.total as u64);
        bar.set_position(progress.done as u64);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    let mut summary = summary?;
    explain_rejected(&mut summary.rejected);
    match summary.rejected.first() {
        Some(rejected) => Err(Failure::failed("rejected_source", anyhow!("{}", serde_json::json!(rejected)))),
        None => Ok(summary),
    }
}
