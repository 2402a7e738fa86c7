//! Reading orthophotos: from files to masked colour tiles of the tile matrix, or to plain rectangles of pixels.
//!
//! GeoTIFF and COG are read by blocks, PNG and JPEG (with a world file) whole. The cargo feature `gdal` adds every format
//! that GDAL reads. This module writes no file.

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
mod options;
mod orthophoto;
mod photo;
mod side_files;
mod tiff;
mod warp;
mod window;
mod wkt;

pub use block::BlockCache;
pub use error::RasterError;
pub use find::{FoundSources, content_hash, find_sources};
pub use imagery::{Imagery, ImageryError};
pub use options::OpenOptions;
pub use orthophoto::{Orthophoto, OrthophotoDescription};
pub use tiff::{StatedDatum, stated_datum};
