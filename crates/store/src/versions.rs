//! The format versions in which something began.

/// The first format version in which the hash of a footprint binds its place, errors may be unknown, and layers have terms.
pub const PLACES_SINCE: u32 = 6;
