//! `Manifest`: the description of an exported store, as JSON: one line, no blanks, keys in the order of the fields here.

use super::date::parse_date;
use crate::{Layer, LevelDigests, MOST_ERROR_M, Terms};
use jiff::civil::Date;
use overfly_core::geodesy::{GeodeticBounds, bounds_as_array};
use serde::{Deserialize, Serialize};

/// The value of `format`.
const FORMAT: &str = "overfly package 2";
/// That of programs which stated neither serial, name nor terms, and 0 for an unknown error.
const FIRST_FORMAT: &str = "overfly package 1";

/// The description of an exported store.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// `overfly package 2`, or 1 in stores that an older program exported.
    pub format: String,
    /// Format version of the store.
    pub store_format: u32,
    /// Descriptor contract of its tiles.
    pub descriptor_contract: String,
    /// The mission's name, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Stores of a higher number replace those of a lower one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial: Option<u64>,
    /// Digest of the store, hexadecimal.
    pub digest: String,
    /// Digest of the store that it was exported from, hexadecimal.
    pub cut_from: String,
    /// Layers by name.
    pub layers: Vec<ManifestLayer>,
    /// Where the store may be flown.
    pub route: ManifestRoute,
    /// The calibration from which the growth of the corridor was computed.
    pub calibration: Option<serde_json::Value>,
    /// What was left out to reduce the size.
    pub dropped: Vec<Dropped>,
    /// The last day (UTC) on which the store may be flown, ISO 8601.
    pub valid_until: Option<String>,
    /// The Ed25519 public key of the signer, 32 bytes, hexadecimal.
    pub signed_by: Option<String>,
}

/// A layer of an exported store.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManifestLayer {
    /// Name.
    pub name: String,
    /// Zoom of the finest level.
    pub base_zoom: u8,
    /// Zoom of the coarsest level.
    pub min_zoom: u8,
    /// Number of tiles at the finest level.
    pub base_tiles: u64,
    /// Number of tiles at all levels.
    pub tiles: u64,
    /// Extent, degrees: west, south, east, north.
    #[serde(with = "bounds_as_array")]
    pub bounds_deg: GeodeticBounds,
    /// Earliest and latest acquisition date of its sources, if known.
    pub acquired: Option<(String, String)>,
    /// Largest horizontal error of its tiles, one standard deviation per axis, metres: `None` where that of any is unknown.
    pub horizontal_error_m: Option<f64>,
    /// Under what terms its imagery may be used.
    #[serde(default, skip_serializing_if = "Terms::is_empty")]
    pub terms: Terms,
    /// Digest over the footprints of all its levels, hexadecimal. Each footprint states the content hash of its tile.
    pub digest: String,
    /// Digests of its levels, coarsest first.
    pub levels: Vec<LevelDigests>,
}

/// Where an exported store may be flown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManifestRoute {
    /// The planned route, then its alternates, each a list of longitude and latitude in degrees.
    pub lines_deg: Vec<Vec<[f64; 2]>>,
    /// Stated width of the corridor on each side, metres.
    pub corridor_m: f64,
    /// Largest width of the corridor on each side, metres.
    pub widest_m: f64,
    /// The parameters of the aircraft by which the corridor grew, if it did.
    pub grown_by: Option<serde_json::Value>,
}

/// Something that was left out of an export, and the consequence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dropped {
    /// What was left out.
    pub what: String,
    /// The consequence for the flight.
    pub effect: String,
}

impl ManifestLayer {
    /// Describes a finished layer and its levels.
    pub fn new(layer: &Layer, horizontal_error_m: Option<f64>, levels: Vec<LevelDigests>) -> Self {
        Self {
            name: layer.name.clone(),
            base_zoom: layer.base_zoom,
            min_zoom: layer.min_zoom,
            base_tiles: layer.base_tiles,
            tiles: layer.tiles,
            bounds_deg: layer.bounds_deg,
            acquired: layer.acquired.clone(),
            horizontal_error_m,
            terms: layer.terms.clone(),
            digest: layer.digest.clone().unwrap_or_default(),
            levels,
        }
    }

    /// Whether a layer of a store is the described one, and is finished.
    pub fn matches(&self, layer: &Layer) -> bool {
        *self == Self::new(layer, self.horizontal_error_m, self.levels.clone()) && layer.complete
    }
}

impl Manifest {
    /// Returns the value of `format` that this program writes.
    pub fn format() -> String {
        FORMAT.into()
    }

    /// Returns the JSON text as stored.
    pub fn to_text(&self) -> String {
        serde_json::to_string(self).expect("a manifest serialises")
    }

    /// Parses a stored manifest.
    ///
    /// # Errors
    /// What is wrong: not a manifest, another format, or a text that this program would write differently.
    pub fn from_text(text: &str) -> Result<Self, String> {
        let manifest: Self = serde_json::from_str(text).map_err(|e| e.to_string())?;
        if ![FORMAT, FIRST_FORMAT].contains(&manifest.format.as_str()) {
            return Err(format!("its format is {:?}, this program's is {FORMAT:?}", manifest.format));
        }
        manifest.check_layers()?;
        if let Some(day) = &manifest.valid_until {
            parse_date(day)?;
        }
        if manifest.to_text() != text {
            return Err("this program would write it differently".into());
        }
        Ok(manifest)
    }

    fn check_layers(&self) -> Result<(), String> {
        let is_error = |error_m: f64| (0.0..=MOST_ERROR_M).contains(&error_m);
        match self.layers.iter().find(|layer| !layer.horizontal_error_m.is_none_or(is_error)) {
            None => Ok(()),
            Some(layer) => Err(format!("it states a horizontal error for layer {} that no map can have", layer.name)),
        }
    }

    /// Returns the last day on which the store may be flown.
    pub fn valid_until(&self) -> Option<Date> {
        self.valid_until.as_deref().and_then(|day| parse_date(day).ok())
    }
}
