//! `TerrainRequest`: the build of a store's terrain, a layer of heights.

use super::error::BuildError;
use super::request::Request;
use crate::raster::{StatedDatum, find_sources, stated_datum};
use jiff::civil::Date;
use overfly_core::geodesy::VerticalDatum;
use overfly_store::{Reader, StoreError, Terms, Terrain};
use std::path::PathBuf;

/// The name of the layer of heights, where the store has none yet.
pub const TERRAIN_LAYER: &str = "terrain";

/// The largest vertical error that can be stated, metres.
const MOST_VERTICAL_ERROR_M: f64 = 1000.0;

/// What a planner states of a store's terrain.
#[derive(Debug, Clone, Default)]
pub struct TerrainRequest {
    /// The store's file; it is created where there is none.
    pub db: PathBuf,
    /// GeoTIFF files of heights, metres, or folders to search.
    pub sources: Vec<PathBuf>,
    /// The surface that the heights are above, where the files do not state it.
    pub vertical_datum: Option<VerticalDatum>,
    /// One standard deviation of the heights, metres: `None` where it is not known.
    pub vertical_error_m: Option<f64>,
    /// EPSG code of all given files; it overrides what they state.
    pub crs: Option<u32>,
    /// Threads that warp and encode, at least 1.
    pub threads: usize,
    /// Whether the terrain is made of the given files only.
    pub replace: bool,
    /// The day of the clock: heights of the future are refused.
    pub today: Option<Date>,
}

impl TerrainRequest {
    /// Returns the build of the layer of heights.
    ///
    /// # Errors
    /// [`BuildError::NoDatum`] and [`BuildError::OtherDatum`] where the surface below the heights is not known or contradicted: it is
    /// never guessed; [`BuildError::Parameter`]; [`StoreError::LayerExists`] where imagery has the layer's name.
    pub fn request(&self) -> Result<Request, BuildError> {
        if let Some(value) = self.vertical_error_m.filter(|error_m| !(0.0..=MOST_VERTICAL_ERROR_M).contains(error_m)) {
            return Err(BuildError::Parameter { name: "terrain_error_m", value, expected: "metres, from 0 to 1000" });
        }
        let (layer, before) = self.layer()?;
        let vertical_datum = self.datum()?;
        let before = before.filter(|_| !self.replace);
        if let Some(other) = before.map(|before| before.vertical_datum).filter(|before| *before != vertical_datum) {
            let says = format!("the terrain of {} is above {}", self.db.display(), other.word());
            return Err(BuildError::OtherDatum { says, stated: vertical_datum.word() });
        }
        let vertical_error_m = self.vertical_error_m.or(before.and_then(|before| before.vertical_error_m));
        Ok(Request {
            db: self.db.clone(),
            layer,
            sources: self.sources.clone(),
            crs: self.crs,
            terrain: Some(Terrain { vertical_datum, vertical_error_m }),
            terms: Terms::default(),
            threads: self.threads,
            replace_layer: self.replace,
            today: self.today,
            ..Request::default()
        })
    }

    /// The name of the layer of heights, and what it states of them where the store has it.
    fn layer(&self) -> Result<(String, Option<Terrain>), BuildError> {
        let Ok(store) = Reader::open(&self.db) else { return Ok((TERRAIN_LAYER.into(), None)) };
        if let Some((layer, terrain)) = store.terrain() {
            return Ok((layer.name.clone(), Some(*terrain)));
        }
        match store.imagery_layers().find(|layer| layer.name == TERRAIN_LAYER) {
            Some(layer) => Err(StoreError::LayerExists { path: self.db.clone(), name: layer.name.clone() }.into()),
            None => Ok((TERRAIN_LAYER.into(), None)),
        }
    }

    /// The surface that all files' heights are above.
    fn datum(&self) -> Result<VerticalDatum, BuildError> {
        let mut known = self.vertical_datum;
        let mut by = None;
        // What cannot be found or read is left to the build to report.
        let found = find_sources(&self.sources).map(|found| found.files).unwrap_or_default();
        for path in &found {
            let said = match stated_datum(path) {
                Ok(StatedDatum::Known(said)) => said,
                Ok(StatedDatum::Other(named)) => {
                    return Err(match self.vertical_datum {
                        None => BuildError::NoDatum { path: path.clone(), named: Some(named) },
                        Some(stated) => {
                            let says = format!("{} says its heights are above {named}", path.display());
                            BuildError::OtherDatum { says, stated: stated.word() }
                        }
                    });
                }
                Ok(StatedDatum::Unstated) if self.vertical_datum.is_none() => {
                    return Err(BuildError::NoDatum { path: path.clone(), named: None });
                }
                _ => continue,
            };
            if let Some(other) = known.filter(|known| *known != said) {
                let stated = other.word();
                let says = format!("{} says its heights are above {}", path.display(), said.word());
                return Err(match by {
                    Some(first) => BuildError::MixedDatums { says, first, stated },
                    None => BuildError::OtherDatum { says, stated },
                });
            }
            if known.is_none() {
                (known, by) = (Some(said), Some(path.clone()));
            }
        }
        // No file was found: the datum does not matter, for the build fails.
        Ok(known.unwrap_or(VerticalDatum::Ellipsoid))
    }
}
