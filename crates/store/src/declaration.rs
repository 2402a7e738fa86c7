//! `Declaration`: what a layer shall be, before there is a tile of it.

use super::{Source, digest};

/// What a layer shall be.
#[derive(Debug, Clone, PartialEq)]
pub struct Declaration {
    /// Its name.
    pub layer: String,
    /// Its sources, in any order.
    pub sources: Vec<Source>,
    /// The base zoom that the user stated, where so.
    pub zoom_override: Option<u8>,
    /// The finest level.
    pub base_zoom: u8,
    /// The coarsest overview.
    pub min_zoom: u8,
}

impl Declaration {
    /// Tells one build of a layer from another.
    pub(super) fn plan_hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new_derive_key("overfly plan 1");
        hasher.update(&[self.base_zoom, self.min_zoom, self.zoom_override.unwrap_or(0xff)]);
        let mut sources: Vec<_> = self.sources.iter().collect();
        sources.sort_by_key(|s| s.content_hash);
        for source in sources {
            digest::hash_source(&mut hasher, source);
        }
        hasher.finalize().into()
    }
}
