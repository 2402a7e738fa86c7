//! GeoTIFF and COG, read by blocks through `tiff-reader`.

mod bands;
mod georeference;
mod keys;
mod layout;
mod open;
mod source;

pub(super) use georeference::placement;
pub(super) use source::TiffSource;
