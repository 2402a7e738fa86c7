//! `ExportRequest`: what shall be exported.

use super::corridor::{Drift, Width};
use overfly_core::coupling::Calibration;
use overfly_core::route::Route;
use overfly_store::package::{Date, SecretKey};

/// What shall be exported.
#[derive(Debug)]
pub struct ExportRequest {
    /// The planned route first, its alternates after it.
    pub routes: Vec<Route>,
    /// W: the corridor on each side, metres.
    pub corridor_m: f64,
    /// What the corridor grows by.
    pub drift: Option<Drift>,
    /// The calibration that the drift comes from; written down in the manifest.
    pub calibration: Option<Calibration>,
    /// Layers to take; all where none is named.
    pub layers: Vec<String>,
    /// Most bytes of the file.
    pub max_bytes: Option<u64>,
    /// The JPEG quality, 1 to 100, to encode imagery with anew; as it is in the store where none is stated.
    pub jpeg_quality: Option<u8>,
    /// The last day on which it may be flown.
    pub valid_until: Option<Date>,
    /// Who signs.
    pub key: Option<SecretKey>,
}

impl ExportRequest {
    /// All that lies along routes, as it is in the store, unsigned.
    pub fn along(routes: Vec<Route>, corridor_m: f64) -> Self {
        Self {
            routes,
            corridor_m,
            drift: None,
            calibration: None,
            layers: Vec::new(),
            max_bytes: None,
            jpeg_quality: None,
            valid_until: None,
            key: None,
        }
    }

    /// How wide the corridor is.
    pub(super) fn width(&self) -> Width {
        Width { half_width_m: self.corridor_m, drift: self.drift }
    }
}
