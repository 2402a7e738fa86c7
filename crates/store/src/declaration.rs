//! `Declaration`: what a build will make of a layer, stated before it writes the first tile.

use super::terms::Terms;
use super::terrain::Terrain;
use super::{Source, digest};

/// A layer as a build declares it.
#[derive(Debug, Clone, PartialEq)]
pub struct Declaration {
    /// Name of the layer.
    pub layer: String,
    /// Sources, in any order.
    pub sources: Vec<Source>,
    /// Base zoom, if the user stated one.
    pub zoom_override: Option<u8>,
    /// Zoom of the finest level.
    pub base_zoom: u8,
    /// Zoom of the coarsest overview.
    pub min_zoom: u8,
    /// Under what terms the imagery may be used.
    pub terms: Terms,
    /// What the layer states of its heights, where it is one of heights.
    pub terrain: Option<Terrain>,
}

impl Declaration {
    /// Returns a hash that tells builds of the same layer apart.
    pub(super) fn plan_hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new_derive_key("overfly plan 1");
        hasher.update(&[self.base_zoom, self.min_zoom, self.zoom_override.unwrap_or(0xff)]);
        let mut sources: Vec<_> = self.sources.iter().collect();
        sources.sort_by_key(|s| s.content_hash);
        for source in sources {
            digest::hash_source(&mut hasher, source);
        }
        digest::hash_terrain(&mut hasher, self.terrain.as_ref());
        hasher.finalize().into()
    }
}
