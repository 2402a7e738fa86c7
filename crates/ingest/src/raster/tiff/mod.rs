//! GeoTIFF and COG, read by blocks through `tiff-reader`.

mod bands;
mod georeference;
mod keys;
mod layout;
mod open;
mod source;
mod vertical;

pub(super) use georeference::placement;
pub(super) use source::TiffSource;
pub use vertical::{StatedDatum, stated_datum};
