//! `Manifest`: what an exported store says of itself, as JSON: one line, no blanks, keys in the order of the fields here.

use super::Date;
use crate::{Layer, LevelDigests};
use serde::{Deserialize, Serialize};

/// What `format` says.
const FORMAT: &str = "overfly package 1";

/// What an exported store says of itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// "overfly package 1".
    pub format: String,
    /// The version of the store's format.
    pub store_format: u32,
    /// How its tiles are described.
    pub descriptor_contract: String,
    /// The store's digest, hexadecimal.
    pub digest: String,
    /// The digest of the store it was cut from.
    pub cut_from: String,
    /// Its layers, by name.
    pub layers: Vec<ManifestLayer>,
    /// Where it may be flown.
    pub route: ManifestRoute,
    /// The calibration that the corridor's growth comes from.
    pub calibration: Option<serde_json::Value>,
    /// What was left out to keep it small.
    pub dropped: Vec<Dropped>,
    /// The last day on which it may be flown, ISO 8601.
    pub valid_until: Option<String>,
    /// The Ed25519 public key of who signed it, 32 bytes, hexadecimal.
    pub signed_by: Option<String>,
}

/// A layer of an exported store.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManifestLayer {
    /// Its name.
    pub name: String,
    /// Finest level.
    pub base_zoom: u8,
    /// Coarsest level.
    pub min_zoom: u8,
    /// Tiles at the finest level.
    pub base_tiles: u64,
    /// Tiles at all levels.
    pub tiles: u64,
    /// West, south, east, north, degrees.
    pub bounds_deg: [f64; 4],
    /// Earliest and latest acquisition date of its sources, where known.
    pub acquired: Option<(String, String)>,
    /// The largest horizontal error of its tiles, one standard deviation per axis, metres.
    pub horizontal_error_m: f64,
    /// Its digest, hexadecimal: over all its levels' footprints, each of which states its tile's content hash.
    pub digest: String,
    /// Level by level, coarsest first.
    pub levels: Vec<LevelDigests>,
}

/// Where an exported store may be flown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManifestRoute {
    /// The planned route, then its alternates: positions as longitude and latitude, degrees.
    pub lines_deg: Vec<Vec<[f64; 2]>>,
    /// The corridor on each side as stated, metres.
    pub corridor_m: f64,
    /// The corridor on each side at its widest, metres.
    pub widest_m: f64,
    /// The aircraft's numbers by which it grew; absent where it did not.
    pub grown_by: Option<serde_json::Value>,
}

/// Something that was left out of an export, and what that costs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dropped {
    /// What.
    pub what: String,
    /// What it does to the flight.
    pub effect: String,
}

impl ManifestLayer {
    /// Of a finished layer and its levels.
    pub fn of(layer: &Layer, horizontal_error_m: f64, levels: Vec<LevelDigests>) -> Self {
        Self {
            name: layer.name.clone(),
            base_zoom: layer.base_zoom,
            min_zoom: layer.min_zoom,
            base_tiles: layer.base_tiles,
            tiles: layer.tiles,
            bounds_deg: layer.bounds_deg,
            acquired: layer.acquired.clone(),
            horizontal_error_m,
            digest: layer.digest.clone().unwrap_or_default(),
            levels,
        }
    }

    /// Whether a layer of a store is this one.
    pub fn is(&self, layer: &Layer) -> bool {
        *self == Self::of(layer, self.horizontal_error_m, self.levels.clone()) && layer.complete
    }
}

impl Manifest {
    /// What `format` says of manifests that this program writes.
    pub fn format() -> String {
        FORMAT.into()
    }

    /// The bytes that stand in the store.
    pub fn to_text(&self) -> String {
        serde_json::to_string(self).expect("a manifest serialises")
    }

    /// A manifest of its bytes.
    ///
    /// # Errors
    /// What is wrong with it, for people: no manifest, one of another format, or not written as this program writes it.
    pub fn from_text(text: &str) -> Result<Self, String> {
        let manifest: Self = serde_json::from_str(text).map_err(|e| e.to_string())?;
        if manifest.format != FORMAT {
            return Err(format!("its format is {:?}, this program's is {FORMAT:?}", manifest.format));
        }
        if let Some(day) = &manifest.valid_until {
            day.parse::<Date>()?;
        }
        if manifest.to_text() != text {
            return Err("it is not written as this program writes it".into());
        }
        Ok(manifest)
    }

    /// The last day on which it may be flown.
    pub fn valid_until(&self) -> Option<Date> {
        self.valid_until.as_deref().and_then(|day| day.parse().ok())
    }
}
