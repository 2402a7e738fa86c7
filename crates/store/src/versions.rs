//! The format versions in which something began.

/// The first format version in which the hash of a footprint binds its place, errors may be unknown, and layers have terms.
pub const PLACES_SINCE: u32 = 6;

/// The first format version in which a layer may hold heights.
pub const TERRAIN_SINCE: u32 = 7;
