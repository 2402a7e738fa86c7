//! Opens the store that is served: at the start, and again when its file was replaced, with the same checks.

use crate::cli::failure::Failure;
use crate::cli::mission_text::mission_text;
use crate::server::StoreRefusal;
use overfly_store::package::{Date, PublicKey, StalePolicy, open_onboard, require_serial};
use overfly_store::{CacheLimits, Reader};
use parking_lot::Mutex;
use std::path::PathBuf;

/// What is opened, and what is checked.
pub struct Opening {
    /// The store.
    pub db: PathBuf,
    /// Whether it is opened as on the aircraft.
    pub is_onboard: bool,
    /// Onboard, the key that must have signed it.
    pub key: Option<PublicKey>,
    /// Onboard, how old its imagery may be.
    pub policies: Vec<StalePolicy>,
    /// Onboard, the least serial that it may have: once a store is open, that of this store. So no store takes the place of a newer one.
    pub least_serial: Mutex<Option<u64>>,
    /// The date at the start of the service. A clock that jumps in flight changes nothing.
    pub today: Date,
    /// Onboard, the limits of its caches.
    pub keep: CacheLimits,
}

impl Opening {
    /// The store and its warnings.
    ///
    /// # Errors
    /// If the store cannot be opened, or must not be served.
    pub fn open(&self) -> Result<(Reader, Vec<String>), Failure> {
        if !self.is_onboard {
            return Ok((Reader::open_proved(&self.db)?, Vec::new()));
        }
        let opened = open_onboard(&self.db, self.key.as_ref(), &self.policies, self.today).map_err(Failure::of_crew)?;
        let mut least = self.least_serial.lock();
        require_serial(&self.db, opened.manifest.as_ref(), *least).map_err(Failure::of_crew)?;
        *least = opened.manifest.as_ref().and_then(|manifest| manifest.serial).or(*least);
        if let Some(manifest) = &opened.manifest {
            let (name, valid_until) = (manifest.name.as_deref(), manifest.valid_until.as_deref());
            let mission = mission_text(name, manifest.serial, valid_until);
            tracing::info!("{}: {mission}digest {}", self.db.display(), manifest.digest);
        }
        let warnings: Vec<String> = opened.findings.into_iter().map(|f| f.message).collect();
        warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
        Ok((opened.store.with_cache_limits(self.keep).map_err(Failure::of_crew)?, warnings))
    }

    /// As [`Opening::open`], for the running service.
    ///
    /// # Errors
    /// As [`Opening::open`], without the path.
    pub fn reopen(&self) -> Result<(Reader, Vec<String>), StoreRefusal> {
        self.open().map_err(|failure| {
            let (text, path) = (failure.error.to_string(), self.db.display().to_string());
            let reason = text.strip_prefix(&format!("{path}: ")).unwrap_or(&text).replace(&path, "the store");
            StoreRefusal { code: failure.code, reason }
        })
    }
}
