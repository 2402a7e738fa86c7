//! `ExportRequest`: what to export.

use super::corridor::{CorridorDrift, CorridorWidth};
use super::error::ExportError;
use overfly_core::coupling::Calibration;
use overfly_core::route::Route;
use overfly_store::Reader;
use overfly_store::package::{Date, SecretKey, require_past_imagery};

/// What to export.
#[derive(Debug)]
pub struct ExportRequest {
    /// The planned route, then its alternates.
    pub routes: Vec<Route>,
    /// W: the corridor's width on each side, metres.
    pub corridor_m: f64,
    /// The growth of the corridor along the route.
    pub drift: Option<CorridorDrift>,
    /// The calibration that the drift comes from; the manifest states it.
    pub calibration: Option<Calibration>,
    /// The layers to export; all layers where the list is empty.
    pub layers: Vec<String>,
    /// The largest size of the file, bytes.
    pub max_bytes: Option<u64>,
    /// The JPEG quality, 1 to 100, with which imagery is encoded again; by default imagery stays as it is in the store.
    pub jpeg_quality: Option<u8>,
    /// The last day on which the export may be flown.
    pub valid_until: Option<Date>,
    /// The mission's name, for people.
    pub name: Option<String>,
    /// The serial number: an aircraft takes no store of a lower one than it has.
    pub serial: Option<u64>,
    /// The key to sign with.
    pub key: Option<SecretKey>,
}

impl ExportRequest {
    /// Makes a request for everything along routes, as it is in the store, unsigned.
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
            name: None,
            serial: None,
            key: None,
        }
    }

    /// Checks the dates by the clock: the last day must not have passed, and what is signed must not hold imagery of the future. An
    /// aircraft would refuse either.
    ///
    /// # Errors
    /// [`ExportError::LastDayPassed`], [`overfly_store::package::PackageError::Clock`].
    pub fn check_dates(&self, store: &Reader, today: Date) -> Result<(), ExportError> {
        if let Some(last_day) = self.valid_until.filter(|day| *day < today) {
            return Err(ExportError::LastDayPassed { last_day, today });
        }
        if self.key.is_some() {
            let layers = store.imagery_layers();
            let asked = layers.filter(|layer| self.layers.is_empty() || self.layers.contains(&layer.name));
            require_past_imagery(store.path(), asked, today)?;
        }
        Ok(())
    }

    /// The width of the corridor.
    pub(super) fn width(&self) -> CorridorWidth {
        CorridorWidth { half_width_m: self.corridor_m, drift: self.drift }
    }
}
