//! Reading orthophotos: files in, masked colour tiles of the tile matrix out; or plain rectangles of pixels.
//!
//! GeoTIFF and COG are read by blocks, PNG and JPEG (with a world file) whole, and with the cargo feature `gdal` all that
//! GDAL reads. Nothing here writes a file.

mod affine;
mod block;
mod date;
mod error;
mod find;
#[cfg(feature = "gdal")]
mod gdal;
mod gdal_metadata;
mod georeference;
mod imagery;
mod mapping;
mod orthophoto;
mod photo;
mod side_files;
mod tiff;
mod warp;
mod window;
mod wkt;

pub use block::BlockCache;
pub use error::RasterError;
pub use find::{content_hash, find_sources};
pub use imagery::{Imagery, ImageryError};
pub use orthophoto::{Description, OpenOptions, Orthophoto};
