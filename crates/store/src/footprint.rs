//! `Footprint`: the properties of one tile, a row of the feature table.

use super::hashing::{error_bits, optional, place, text};
use blake3::Hasher;
use overfly_core::pixels::MaskOutline;
use overfly_core::tile::{MercatorBounds, TILE_SIZE_PX, TileId};

/// The properties of one tile.
#[derive(Debug, Clone, PartialEq)]
pub struct Footprint {
    /// The tile.
    pub tile: TileId,
    /// BLAKE3 hash of the content.
    pub content_hash: [u8; 32],
    /// Newest acquisition date of its sources, ISO 8601, if known.
    pub acquired: Option<String>,
    /// Share of valid pixels, above 0 and at most 1.
    pub valid_fraction: f64,
    /// Position error of the map here, one standard deviation per axis, metres: `None` where one of its sources states none.
    pub horizontal_error_m: Option<f64>,
    /// Number of described keypoints.
    pub keypoints: u32,
    /// See `feature::keypoint::distinctiveness`.
    pub distinctiveness: f64,
    /// Content hashes of its visible sources, hexadecimal, newest first, separated by spaces.
    pub sources: String,
    /// Where its valid pixels are: `None` where all are valid, and where a store of an older format does not say.
    pub valid_outline: Option<MaskOutline>,
}

/// The largest horizontal error that a store may state, metres.
pub const MOST_ERROR_M: f64 = 10_000.0;
/// Least standard deviation of a map whose error nobody states, metres.
const LEAST_UNKNOWN_ERROR_M: f64 = 3.0;

impl Footprint {
    /// Hashes the footprint: its content hash, its place (layer, zoom, row and column) and everything else that is known of the tile.
    pub fn hash(&self, layer: &str) -> [u8; 32] {
        let mut hasher = Hasher::new_derive_key("overfly footprint 1");
        text(&mut hasher, layer.as_bytes());
        place(&mut hasher, self.tile);
        hasher.update(&self.content_hash);
        optional(&mut hasher, self.acquired.as_deref());
        hasher.update(&self.valid_fraction.to_bits().to_le_bytes());
        hasher.update(&error_bits(self.horizontal_error_m));
        hasher.update(&self.distinctiveness.to_bits().to_le_bytes());
        hasher.update(&self.keypoints.to_le_bytes());
        text(&mut hasher, self.sources.as_bytes());
        match &self.valid_outline {
            Some(outline) => text(&mut hasher, &outline.to_bytes()),
            None => {
                hasher.update(&u64::MAX.to_le_bytes());
            }
        }
        hasher.finalize().into()
    }

    /// The parts of the tile's extent that have pixels, disjoint, and the share of them that is valid: where the store does not say
    /// which parts, the whole extent with its valid fraction.
    pub fn imaged_ground(&self) -> (Vec<MercatorBounds>, f64) {
        let whole = self.tile.mercator_bounds();
        let Some(outline) = &self.valid_outline else { return (vec![whole], self.valid_fraction) };
        let pixel_m = (whole.max_x_m - whole.min_x_m) / f64::from(TILE_SIZE_PX);
        let part = |[left, upper, right, lower]: [u16; 4]| MercatorBounds {
            min_x_m: whole.min_x_m + f64::from(left) * pixel_m,
            min_y_m: whole.max_y_m - f64::from(lower) * pixel_m,
            max_x_m: whole.min_x_m + f64::from(right) * pixel_m,
            max_y_m: whole.max_y_m - f64::from(upper) * pixel_m,
        };
        (outline.rectangles().into_iter().map(part).collect(), 1.0)
    }

    /// The map's error for a covariance, one standard deviation per axis, metres: where it is unknown half a pixel of the layer's
    /// finest level, whose ground sample distance is given, at least 3 m.
    pub fn error_or_default_m(&self, gsd_m_per_px: f64) -> f64 {
        self.horizontal_error_m.unwrap_or_else(|| default_error_m(gsd_m_per_px))
    }
}

/// The standard deviation per axis that stands for an unknown error of imagery of this ground sample distance, metres.
pub fn default_error_m(gsd_m_per_px: f64) -> f64 {
    (gsd_m_per_px / 2.0).max(LEAST_UNKNOWN_ERROR_M)
}

/// The larger of two horizontal errors: unknown where either is.
pub fn larger_error(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.zip(b).map(|(a, b)| a.max(b))
}
